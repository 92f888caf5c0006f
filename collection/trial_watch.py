"""Hands a running motion's readings to the record: joints, links, jaws, pictures."""

from __future__ import annotations

from collection.robots.execution import PhaseEvent, TraceSample
from collection.station.station import Station
from logs.record.recorder import TrialRecorder

PICTURE_PERIOD_NS = 400_000_000
"""At most one color frame in this time."""


class TrialWatch:
    """Listens to the trial motion.

    Args:
        station: whose robot moves, and whose color camera films it.
        recorder: of the take.
    """

    def __init__(self, station: Station, recorder: TrialRecorder) -> None:
        self._station = station
        self._recorder = recorder
        self._names = station.arm.description.joint_names
        self._next_picture_ns = 0

    def phase(self, event: PhaseEvent) -> None:
        """A phase of the motion has begun."""
        self._recorder.phase(event.phase.value, event.time_ns)

    def sample(self, sample: TraceSample) -> None:
        """One reading of arm and hand."""
        record = self._recorder
        record.joints(sample.time_ns, self._names, sample.joints.tolist())
        record.jaw(sample.time_ns, sample.width, sample.force)
        links = dict(self._station.arm.link_transforms(sample.joints))
        links["gripper"] = sample.T_world_gripper  # measured, where kinematics only believe
        record.frames(sample.time_ns, links)
        self._film(sample.time_ns)

    def _film(self, time_ns: int) -> None:
        camera = self._station.color_camera
        if camera is None or time_ns < self._next_picture_ns:
            return
        self._next_picture_ns = time_ns + PICTURE_PERIOD_NS
        frame = camera.frame()
        if frame is not None:
            self._recorder.color(frame.time_ns, frame.image)
