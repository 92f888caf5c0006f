"""The emulated SmartGripper: the HandDriver routines a RAPID program calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from yumi_emulator.faults import Faults
from yumi_emulator.runtime import Arguments, RapidError, Run

TRAVEL = 25.0
"""Of one jaw [mm]."""


class Hand:
    """One hand; positions are of one jaw [mm], 0 closed.

    Args:
        now: reads the controller's time [s].
        faults: what a test makes go wrong.
    """

    def __init__(self, now: Callable[[], float], faults: Faults) -> None:
        self.position = 12.0
        self.calibrated = False
        self.object_width = 0.0
        self.force = 0.0
        self.calibrations = 0
        self._max_speed = 20.0
        self._now, self._faults = now, faults
        self.procedures: dict[str, Callable[[Arguments], Run]] = {
            "hand_initialize": self._initialize,
            "hand_setmaxspeed": self._set_max_speed,
            "hand_gripinward": self._grip_inward,
            "hand_gripoutward": self._grip_outward,
            "hand_moveto": self._move_to,
        }
        self.functions: dict[str, Callable[[Arguments], Any]] = {
            "hand_getactualpos": lambda _: self._read(self.position),
            "hand_iscalibrated": lambda _: self._read(self.calibrated),
        }

    def _read(self, value: Any) -> Any:
        if self._faults.hand_unpowered:
            raise RapidError("ERR_HAND_WRONGSTATE")
        return value

    def _initialize(self, arguments: Arguments) -> Run:
        self._max_speed = arguments.optional["maxspd"]
        if arguments.optional.get("calibrate"):
            self.calibrations += 1
            yield from self._travel_to(0.0)
            self.calibrated = not self._faults.calibration_fails

    def _set_max_speed(self, arguments: Arguments) -> Run:
        if not 0.0 < arguments.positional[0] <= 25.0:
            raise RapidError("ERR_HAND_WRONGSTATE")
        self._max_speed = arguments.positional[0]
        yield from ()

    def _grip_inward(self, arguments: Arguments) -> Run:
        self._require_ready()
        if not 0.0 <= arguments.optional["holdforce"] <= 20.0:
            raise RapidError("ERR_HAND_WRONGSTATE")
        yield from self._travel_to(min(self.object_width / 2, TRAVEL))
        self.force = arguments.optional["holdforce"]

    def _grip_outward(self, arguments: Arguments) -> Run:
        self._require_ready()
        self.force = 0.0
        yield from self._travel_to(TRAVEL)

    def _move_to(self, arguments: Arguments) -> Run:
        self._require_ready()
        if not 0.0 <= arguments.positional[0] <= TRAVEL:
            raise RapidError("ERR_HAND_FAILEDMOVEPOS")
        self.force = 0.0
        yield from self._travel_to(arguments.positional[0])

    def _require_ready(self) -> None:
        if self._faults.hand_faults > 0:
            self._faults.hand_faults -= 1
            raise RapidError("ERR_HAND_WRONGSTATE")
        if not self.calibrated:
            raise RapidError("ERR_HAND_NOTCALIBRATED")

    def _travel_to(self, goal: float) -> Run:
        begin, start = self._now(), self.position
        duration = abs(goal - start) / self._max_speed
        while (elapsed := self._now() - begin) < duration:
            self.position = start + (goal - start) * elapsed / duration
            yield
        self.position = goal
