"""Measured streams to Foxglove's messages. The inverse is [logs.record.decode_streams][]."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from logs.record.stamps import timestamp
from logs.record.streams import WORLD, CameraRecord, CloudRecord, ColorImage, DepthImage
from logs.schema import trial_v1_pb2 as v1
from reach.arrays import FloatArray

DEPTH_METERS = "32FC1"
DEPTH_MILLIMETERS = "16UC1"


def camera_frame(camera: str) -> str:
    """Name of a camera's frame."""
    return f"camera_{camera}"


def quaternion_xyzw(R: FloatArray) -> tuple[float, float, float, float]:
    """Unit quaternion (x, y, z, w), w >= 0, of a rotation matrix (3, 3).

    The largest of the four is found first, so that no difference loses digits
    (Shepperd's method); plain floats, because it runs for every link and sample.
    """
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    squares = (1 + a - e - i, 1 - a + e - i, 1 - a - e + i, 1 + a + e + i)
    largest = max(range(4), key=squares.__getitem__)
    s = math.sqrt(squares[largest])
    q = (
        (s, (b + d) / s, (c + g) / s, (h - f) / s),
        ((b + d) / s, s, (f + h) / s, (c - g) / s),
        ((c + g) / s, (f + h) / s, s, (d - b) / s),
        ((h - f) / s, (c - g) / s, (d - b) / s, s),
    )[largest]
    half = 0.5 if q[3] >= 0 else -0.5
    return q[0] * half, q[1] * half, q[2] * half, q[3] * half


def encode_calibration(camera: CameraRecord, time_ns: int) -> CameraCalibration:
    """A camera's intrinsics; its pose is a frame, the kind of sensor the channel's event."""
    K = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
    P = [camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return CameraCalibration(
        timestamp=timestamp(time_ns),
        frame_id=camera_frame(camera.name),
        width=camera.width,
        height=camera.height,
        K=K,
        R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=P,
    )


def encode_depth(image: DepthImage) -> RawImage:
    """A depth image: float32 meters with NaN, or uint16 millimeters, as it was given."""
    height, width = image.depth.shape
    in_meters = image.depth.dtype == np.float32
    pixels = image.depth.astype("<f4" if in_meters else "<u2", copy=False)
    return RawImage(
        timestamp=timestamp(image.time_ns),
        frame_id=camera_frame(image.camera),
        width=width,
        height=height,
        encoding=DEPTH_METERS if in_meters else DEPTH_MILLIMETERS,
        step=width * pixels.dtype.itemsize,
        data=pixels.tobytes(),
    )


def encode_color(image: ColorImage) -> CompressedImage:
    """A color frame, already compressed."""
    return CompressedImage(
        timestamp=timestamp(image.time_ns),
        frame_id=camera_frame(image.camera),
        data=image.data,
        format=image.format,
    )


def encode_cloud(cloud: CloudRecord) -> PointCloud:
    """An unorganized cloud."""
    message = PointCloud(
        timestamp=timestamp(cloud.time_ns),
        frame_id=camera_frame(cloud.camera),
        point_stride=12,
        fields=[
            PackedElementField(name=name, offset=4 * i, type=PackedElementField.FLOAT32)
            for i, name in enumerate("xyz")
        ],
        data=cloud.points_camera.astype("<f4", copy=False).tobytes(),
    )
    message.pose.orientation.w = 1.0
    return message


def encode_frames(parent: str, poses: Mapping[str, FloatArray], time_ns: int) -> FrameTransforms:
    """Poses T_parent_child of several frames at one instant."""
    message = FrameTransforms()
    stamp = timestamp(time_ns)
    for child, T_parent_child in poses.items():
        transform = message.transforms.add(parent_frame_id=parent, child_frame_id=child)
        transform.timestamp.CopyFrom(stamp)
        translation, rotation = transform.translation, transform.rotation
        translation.x, translation.y, translation.z = T_parent_child[:3, 3].tolist()
        rotation.x, rotation.y, rotation.z, rotation.w = quaternion_xyzw(T_parent_child[:3, :3])
    return message


def encode_joints(
    names: Sequence[str],
    positions: Sequence[float],
    velocities: Sequence[float] | None,
    efforts: Sequence[float] | None,
    time_ns: int,
) -> JointStates:
    """Joint positions, and velocities and efforts where the robot tells them."""
    unknown = [None] * len(names)
    return JointStates(
        timestamp=timestamp(time_ns),
        joints=[
            JointState(name=name, position=position, velocity=velocity, effort=effort)
            for name, position, velocity, effort in zip(
                names, positions, velocities or unknown, efforts or unknown, strict=True
            )
        ],
    )


def encode_jaw(width: float, force: float | None, time_ns: int) -> v1.JawSample:
    """Distance between the pads, and the jaws' force if it is measured."""
    return v1.JawSample(timestamp=timestamp(time_ns), width=width, force=force)


def encode_pose(T_world_frame: FloatArray, time_ns: int) -> PoseInFrame:
    """A pose in the world that viewers draw; readers take the exact matrix elsewhere."""
    message = PoseInFrame(timestamp=timestamp(time_ns), frame_id=WORLD)
    position, orientation = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = T_world_frame[:3, 3].tolist()
    x, y, z, w = quaternion_xyzw(T_world_frame[:3, :3])
    orientation.x, orientation.y, orientation.z, orientation.w = x, y, z, w
    return message
