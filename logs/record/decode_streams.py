"""Foxglove's messages to measured streams. The inverse is [logs.record.encode_streams][]."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from logs.record.encode_streams import DEPTH_METERS, DEPTH_MILLIMETERS, camera_frame
from logs.record.records import TrialEvent
from logs.record.stamps import nanoseconds
from logs.record.streams import (
    CameraRecord,
    CloudRecord,
    ColorImage,
    DepthImage,
    FrameTrack,
    JawTrack,
    JointTrack,
)
from logs.record.topics import camera_of_topic, is_camera_topic
from logs.schema import trial_v1_pb2 as v1
from reach.arrays import frozen

ByTopic = Mapping[str, Sequence[bytes]]
_T = TypeVar("_T")
_DEPTH_TYPES = {DEPTH_METERS: "<f4", DEPTH_MILLIMETERS: "<u2"}


def _of_cameras(by_topic: ByTopic, what: str) -> Iterator[tuple[str, bytes]]:
    for topic, messages in by_topic.items():
        if is_camera_topic(topic, what):
            for data in messages:
                if data:  # empty if the reader wanted no images
                    yield camera_of_topic(topic), data


def _by_time(
    by_topic: ByTopic, what: str, decode: Callable[[str, bytes], _T], time_of: Callable[[_T], int]
) -> tuple[_T, ...]:
    return tuple(sorted((decode(*item) for item in _of_cameras(by_topic, what)), key=time_of))


def decode_cameras(
    by_topic: ByTopic, events: Sequence[TrialEvent], frames: Mapping[str, FrameTrack]
) -> dict[str, CameraRecord]:
    """Cameras whose calibration and pose the record has."""
    sensors = {
        event.data["camera"]: event.data["sensor"] for event in events if "sensor" in event.data
    }
    cameras: dict[str, CameraRecord] = {}
    for name, data in _of_cameras(by_topic, "calibration"):
        message = CameraCalibration.FromString(data)
        track = frames.get(camera_frame(name))
        if track is None:
            continue  # cut short between calibration and pose
        cameras[name] = CameraRecord(
            name=name,
            width=message.width,
            height=message.height,
            fx=message.K[0],
            fy=message.K[4],
            cx=message.K[2],
            cy=message.K[5],
            T_world_camera=track.transforms()[-1],
            sensor=sensors.get(name, ""),
        )
    return cameras


def decode_depths(by_topic: ByTopic) -> tuple[DepthImage, ...]:
    """Depth images of all cameras, by time."""
    return _by_time(by_topic, "depth", _decode_depth, lambda image: image.time_ns)


def _decode_depth(camera: str, data: bytes) -> DepthImage:
    message = RawImage.FromString(data)
    depth: Any = np.frombuffer(message.data, _DEPTH_TYPES[message.encoding])
    return DepthImage(
        nanoseconds(message.timestamp), depth.reshape(message.height, message.width), camera
    )


def decode_colors(by_topic: ByTopic) -> tuple[ColorImage, ...]:
    """Color frames of all cameras, by time."""
    return _by_time(by_topic, "color", _decode_color, lambda image: image.time_ns)


def _decode_color(camera: str, data: bytes) -> ColorImage:
    message = CompressedImage.FromString(data)
    return ColorImage(nanoseconds(message.timestamp), message.data, message.format, camera)


def decode_clouds(by_topic: ByTopic) -> tuple[CloudRecord, ...]:
    """Unorganized clouds of all cameras, by time."""
    return _by_time(by_topic, "points", _decode_cloud, lambda cloud: cloud.time_ns)


def _decode_cloud(camera: str, data: bytes) -> CloudRecord:
    message = PointCloud.FromString(data)
    points = np.frombuffer(message.data, "<f4").reshape(-1, 3)
    return CloudRecord(nanoseconds(message.timestamp), points, camera)


def decode_frames(messages: Sequence[bytes]) -> dict[str, FrameTrack]:
    """Moving frames by the child's name."""
    rows: dict[str, list[tuple[int, str, tuple[float, ...]]]] = {}
    for data in messages:
        for item in FrameTransforms.FromString(data).transforms:
            t, r = item.translation, item.rotation
            numbers = (t.x, t.y, t.z, r.x, r.y, r.z, r.w)
            row = (nanoseconds(item.timestamp), item.parent_frame_id, numbers)
            rows.setdefault(item.child_frame_id, []).append(row)
    tracks = {}
    for child, samples in rows.items():
        poses = np.array([numbers for _, _, numbers in samples])
        times = frozen([time for time, _, _ in samples], np.int64)
        parent = samples[-1][1]
        tracks[child] = FrameTrack(parent, child, times, frozen(poses[:, :3]), frozen(poses[:, 3:]))
    return tracks


def decode_joints(messages: Sequence[bytes]) -> tuple[JointTrack, ...]:
    """A track for each set of joints."""
    rows: dict[tuple[str, ...], list[tuple[int, list[tuple[float, float, float]]]]] = {}
    for data in messages:
        message = JointStates.FromString(data)
        values = [
            (
                joint.position,
                joint.velocity if joint.HasField("velocity") else np.nan,
                joint.effort if joint.HasField("effort") else np.nan,
            )
            for joint in message.joints
        ]
        names = tuple(joint.name for joint in message.joints)
        rows.setdefault(names, []).append((nanoseconds(message.timestamp), values))
    tracks = []
    for names, samples in rows.items():
        numbers = np.array([values for _, values in samples]).reshape(len(samples), -1, 3)
        times = frozen([time for time, _ in samples], np.int64)
        columns = [frozen(column) for column in np.moveaxis(numbers, -1, 0)]
        tracks.append(JointTrack(times, names, *columns))
    return tuple(tracks)


def decode_jaw(messages: Sequence[bytes]) -> JawTrack:
    """The jaws over time."""
    samples = [v1.JawSample.FromString(data) for data in messages]
    return JawTrack(
        frozen([nanoseconds(sample.timestamp) for sample in samples], np.int64),
        frozen([sample.width for sample in samples]),
        frozen([s.force if s.HasField("force") else np.nan for s in samples]),
    )
