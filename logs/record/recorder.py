"""Recording one take: the trial hands values over, a thread of its own writes them.

No method but `stop` and `flush` waits for the disk. A disk that fails stops the trial only
where it may stop: at the next phase, result or the stop, never within a sampled motion.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from google.protobuf.message import Message
from numpy.typing import NDArray

from logs.errors import RecordWriteError
from logs.record import encode, topics
from logs.record import encode_streams as streams
from logs.record.mcap_file import DurableMcap
from logs.record.queue import RecordQueue
from logs.record.records import (
    AttachmentRecord,
    EventKind,
    ExecutionRecord,
    ExitStatus,
    RegistrationRecord,
    TrialDescriptor,
    TrialEvent,
    TrialStop,
)
from logs.record.streams import WORLD, CameraRecord, CloudRecord, ColorImage, DepthImage
from logs.trial_folder import RECORD_NAME
from reach.arrays import FloatArray, frozen

METADATA_NAME = "reach-trials"
BACKLOG_LIMIT = 256 * 2**20
"""Samples and images beyond this backlog are dropped, and reported as a gap [bytes]."""


class TrialRecorder:
    """Writes one take's record; a context manager.

    Leaving the block without a stop, or by an exception, writes a stop with status abort.

    Args:
        folder: the take's folder; created if missing.
        now: the clock of receipt [ns].
        backlog_limit: how much may wait for the disk [bytes].

    Raises:
        RecordWriteError: if the folder has a record already, or cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        *,
        now: Callable[[], int] = time.time_ns,
        backlog_limit: int = BACKLOG_LIMIT,
    ) -> None:
        self.folder = folder
        self._now = now
        self._stopped = False
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordWriteError(f"cannot create {folder}: {error}") from error
        self._file = DurableMcap(folder / RECORD_NAME)
        self._queue = RecordQueue(self._file, now, backlog_limit)
        self._writer = self._queue.writer

    # ---- what happened -----------------------------------------------------------------------

    def start(
        self, descriptor: TrialDescriptor, attachments: Iterable[AttachmentRecord] = ()
    ) -> None:
        """Write which trial this is, what is tried, and the files that describe it."""
        self._writer.add(
            lambda file: file.metadata(METADATA_NAME, encode.encode_metadata(descriptor))
        )
        stamp = descriptor.time_ns
        self._queue.result(topics.START, encode.encode_start(descriptor), stamp)
        self._queue.result(topics.DESCRIPTOR, encode.encode_descriptor(descriptor), stamp)
        for attachment in attachments:
            self.attach(attachment, stamp)
        self._writer.add(DurableMcap.flush)

    def phase(self, name: str, time_ns: int | None = None, message: str = "") -> None:
        """Begin a phase; everything before it becomes durable."""
        self.event(TrialEvent(self._stamp(time_ns), EventKind.PHASE, name, message))
        self._writer.add(DurableMcap.flush)

    def event(self, event: TrialEvent) -> None:
        """Record an event of robot, camera or operator."""
        self._writer.refuse_failed()
        self._queue.event(event)

    def attach(self, attachment: AttachmentRecord, time_ns: int | None = None) -> None:
        """Add a file to the record."""
        stamp = self._stamp(time_ns)
        self._writer.add(lambda file: file.attach(attachment, stamp), len(attachment.data))
        self._queue.result(
            topics.ATTACHMENT, encode.encode_attachment_note(attachment, stamp), stamp
        )

    def registration(self, result: RegistrationRecord) -> None:
        """Record where the object was found."""
        stamp = result.time_ns
        self._queue.result(topics.REGISTRATION, encode.encode_registration(result), stamp)
        self._queue.result(
            topics.OBJECT_POSE, streams.encode_pose(result.T_world_object, stamp), stamp
        )

    def execution(self, execution: ExecutionRecord) -> None:
        """Record what the robot really did."""
        stamp = execution.time_ns
        self._queue.result(topics.EXECUTION, encode.encode_execution(execution), stamp)
        planned = streams.encode_pose(execution.T_world_gripper_commanded, stamp)
        self._queue.result(topics.PLANNED_POSE, planned, stamp)
        executed = streams.encode_pose(execution.T_world_gripper, stamp)
        self._queue.result(topics.EXECUTED_POSE, executed, stamp)

    # ---- what is measured --------------------------------------------------------------------

    def camera(self, camera: CameraRecord, time_ns: int | None = None) -> None:
        """Record a camera's calibration and pose; before its first image."""
        stamp = self._stamp(time_ns)
        data = {"camera": camera.name, "sensor": camera.sensor}
        text = f"{camera.name}: {camera.sensor or 'unknown sensor'}"
        self.event(TrialEvent(stamp, EventKind.CAMERA, "calibration", text, data=data))
        topic = topics.camera_topic(camera.name, "calibration")
        self._queue.result(topic, streams.encode_calibration(camera, stamp), stamp)
        pose = {streams.camera_frame(camera.name): camera.T_world_camera}
        self._queue.result(topics.FRAMES, streams.encode_frames(WORLD, pose, stamp), stamp)

    def depth(self, image: DepthImage, sequence: int | None = None) -> None:
        """Record a depth image."""
        topic = topics.camera_topic(image.camera, "depth")
        size = image.depth.nbytes
        self._queue.sample(
            topic, lambda: streams.encode_depth(image), image.time_ns, sequence, size
        )

    def color(
        self,
        time_ns: int,
        pixels: NDArray[np.uint8],
        camera: str = "color",
        sequence: int | None = None,
    ) -> None:
        """Record a color frame; it is compressed off the trial's path.

        Args:
            time_ns: of capture [ns].
            pixels: RGB, shape (H, W, 3).
            camera: name of the camera.
            sequence: the camera's frame counter; a hole in it is recorded as a gap.
        """
        kept = frozen(pixels, np.uint8)

        def message() -> Message:
            return streams.encode_color(ColorImage.compress(time_ns, kept, camera))

        topic = topics.camera_topic(camera, "color")
        self._queue.sample(topic, message, time_ns, sequence, kept.nbytes)

    def cloud(self, cloud: CloudRecord, sequence: int | None = None) -> None:
        """Record a cloud; only of a camera that gives no depth image."""
        topic = topics.camera_topic(cloud.camera, "points")
        size = cloud.points_camera.nbytes
        self._queue.sample(
            topic, lambda: streams.encode_cloud(cloud), cloud.time_ns, sequence, size
        )

    def frames(self, time_ns: int, poses: Mapping[str, FloatArray], parent: str = WORLD) -> None:
        """Record poses T_parent_child of frames (robot links, gripper) at one instant.

        Args:
            time_ns: of capture [ns].
            poses: by the child frame's name, each (4, 4).
            parent: name of the parent frame.
        """
        kept = {name: np.array(T) for name, T in poses.items()}

        def message() -> Message:
            return streams.encode_frames(parent, kept, time_ns)

        self._queue.sample(topics.FRAMES, message, time_ns, None, 256 * (4 + len(kept)))

    def joints(
        self,
        time_ns: int,
        names: Sequence[str],
        positions: Sequence[float],
        velocities: Sequence[float] | None = None,
        efforts: Sequence[float] | None = None,
        sequence: int | None = None,
    ) -> None:
        """Record the robot's joints at one instant; [rad] or [m], [rad/s] or [m/s], [Nm] or [N]."""
        values = _floats(positions), _optional(velocities), _optional(efforts)
        kept = tuple(names)

        def message() -> Message:
            return streams.encode_joints(kept, *values, time_ns)

        self._queue.sample(topics.JOINTS, message, time_ns, sequence)

    def jaw(
        self, time_ns: int, width: float, force: float | None = None, sequence: int | None = None
    ) -> None:
        """Record the distance between the pads [m] and, if measured, the jaws' force [N]."""

        def message() -> Message:
            return streams.encode_jaw(width, force, time_ns)

        self._queue.sample(topics.JAW, message, time_ns, sequence)

    # ---- the end -----------------------------------------------------------------------------

    @property
    def failure(self) -> Exception | None:
        """Why writing failed, if it did."""
        return self._writer.failure

    def flush(self, timeout: float | None = None) -> None:
        """Wait until everything so far is durable.

        Raises:
            RecordWriteError: if the disk failed, or did not finish within the timeout [s].
        """
        self._writer.wait(timeout)

    def stop(self, exit_status: ExitStatus, reason: str = "", time_ns: int | None = None) -> Path:
        """End the record: write the stop, give the file its name, and wait for the disk.

        Returns:
            Path of the finished record.

        Raises:
            RecordWriteError: if the disk failed; the unfinished record stays as `.part`.
        """
        stamp, received = self._stamp(time_ns), self._now()
        self._queue.tell_dropped(stamp)

        def finish(file: DurableMcap) -> None:
            stop = TrialStop(stamp, exit_status, reason, dict(file.counts))
            message = encode.encode_stop(stop)
            file.message(topics.STOP, message, capture_ns=stamp, receive_ns=received)
            file.flush()
            file.finish()

        self._writer.add(finish)
        self._stopped = True
        self._writer.close()
        if self._writer.failure is not None:
            self._file.abandon()
        self._writer.refuse_failed()
        return self._file.path

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._stopped:
            return
        reason = f"{type(error).__name__}: {error}" if error else "the trial ended without a stop"
        try:
            self.stop(ExitStatus.ABORT, reason)
        except RecordWriteError:
            if error is None:
                raise  # otherwise the trial's own error is the one to tell

    def _stamp(self, time_ns: int | None) -> int:
        return self._now() if time_ns is None else time_ns


def _floats(values: Sequence[float]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _optional(values: Sequence[float] | None) -> tuple[float, ...] | None:
    return None if values is None else _floats(values)
