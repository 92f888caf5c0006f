"""Collects what happens during a trial motion: phases, and readings of arm and hand together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from collection.clock import Clock
from collection.robots.execution import Phase, PhaseEvent, PhaseSpan, TraceSample
from collection.robots.protocol import GripperDevice
from collection.robots.readings import ArmSample, GripperSample
from reach.arrays import FloatArray, frozen
from reach.transforms import make_transform

HOLD_PERIOD = 0.04
"""Between two readings while nothing moves [s]."""

EventListener = Callable[[PhaseEvent], None]
SampleListener = Callable[[TraceSample], None]


class MotionRecorder:
    """Collects phases and readings, and passes them on."""

    def __init__(
        self,
        clock: Clock,
        gripper: GripperDevice,
        on_event: EventListener | None,
        on_sample: SampleListener | None,
    ) -> None:
        self.clock = clock
        self.phases: list[PhaseSpan] = []
        self.samples: list[TraceSample] = []
        self._gripper = gripper
        self._on_event = on_event
        self._on_sample = on_sample
        self._joints: FloatArray = frozen(np.zeros(0))
        self._T_world_gripper: FloatArray = make_transform()

    @contextmanager
    def phase(self, phase: Phase) -> Iterator[None]:
        """Mark the beginning and end of a phase."""
        start_ns = self.clock.now_ns()
        if self._on_event is not None:
            self._on_event(PhaseEvent(phase, start_ns))
        yield
        self.phases.append(PhaseSpan(phase, start_ns, self.clock.now_ns()))

    def arm_rests(self, joints: FloatArray, T_world_gripper: FloatArray) -> None:
        """Remember where the arm is while only the hand is read."""
        self._joints, self._T_world_gripper = frozen(joints), frozen(T_world_gripper)

    def arm_sample(self, sample: ArmSample) -> None:
        """Record a reading of the moving arm, with one of the hand."""
        self.arm_rests(sample.joints, sample.T_world_gripper)
        self._add(sample.time_ns, self._gripper.read())

    def gripper_sample(self, sample: GripperSample) -> None:
        """Record a reading of the moving jaws; the arm rests."""
        self._add(sample.time_ns, sample)

    def watch_hand(self, seconds: float) -> None:
        """Read the hand for some time while nothing moves."""
        end_ns = self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < end_ns:
            self.clock.sleep(min(HOLD_PERIOD, (end_ns - self.clock.now_ns()) * 1e-9))
            sample = self._gripper.read()
            self._add(sample.time_ns, sample)

    def _add(self, time_ns: int, hand: GripperSample) -> None:
        sample = TraceSample(time_ns, self._joints, self._T_world_gripper, hand.width, hand.force)
        self.samples.append(sample)
        if self._on_sample is not None:
            self._on_sample(sample)
