"""What the trial motion really did."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from reach.arrays import FloatArray


class Phase(StrEnum):
    """Steps of the trial motion, in order."""

    CHECK = "check"
    OPEN = "open"
    AVOIDANCE = "avoidance"
    APPROACH = "approach"
    DESCEND = "descend"
    CLOSE = "close"
    LIFT = "lift"
    HOLD = "hold"
    SHAKE = "shake"
    RETURN = "return"
    RELEASE = "release"
    RETREAT = "retreat"


@dataclass(frozen=True, slots=True)
class PhaseEvent:
    """A phase has begun, at a time [ns]."""

    phase: Phase
    time_ns: int


@dataclass(frozen=True, slots=True)
class PhaseSpan:
    """When a phase was executed [ns]."""

    phase: Phase
    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class TraceSample:
    """One reading of arm and hand.

    Args:
        time_ns: [ns].
        joints: measured, kinematic order, shape (J,) [rad].
        T_world_gripper: measured, shape (4, 4).
        width: distance of the pads' faces [m].
        force: grip force [N].
    """

    time_ns: int
    joints: FloatArray
    T_world_gripper: FloatArray
    width: float
    force: float


@dataclass(frozen=True, slots=True)
class SensorVerdict:
    """What the hand's own sensors say of the lift.

    Args:
        lifted: the jaws were still held apart, and pressed, at the end of the hold.
        width_closed: after closing [m].
        width_held: at the end of the hold [m].
        force_held: at the end of the hold [N].
    """

    lifted: bool
    width_closed: float
    width_held: float
    force_held: float


@dataclass(frozen=True, slots=True, eq=False)
class Execution:
    """The executed trial motion.

    Args:
        T_world_gripper_planned: the commanded grasp, shape (4, 4).
        T_world_gripper: measured when the jaws closed, shape (4, 4).
        phases: when each was executed.
        samples: readings of the whole motion.
        sensor_verdict: of the hand's sensors.
        start_ns: [ns].
        end_ns: [ns].
        put_down_early: the part met the table before the hand was down again.
    """

    T_world_gripper_planned: FloatArray
    T_world_gripper: FloatArray
    phases: tuple[PhaseSpan, ...]
    samples: tuple[TraceSample, ...]
    sensor_verdict: SensorVerdict
    start_ns: int
    end_ns: int
    put_down_early: bool = False

    @property
    def measurements(self) -> dict[str, float]:
        """The readings that a table of trials shows, SI units."""
        verdict = self.sensor_verdict
        return {
            "width_closed": verdict.width_closed,
            "width_held": verdict.width_held,
            "force_held": verdict.force_held,
            "duration": (self.end_ns - self.start_ns) * 1e-9,
        }
