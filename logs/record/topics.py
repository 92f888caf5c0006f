"""The channels of a record: their names and message types.

Rerun and Foxglove both draw the Foxglove types; the project's own types can be queried in both.
"""

from __future__ import annotations

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import Message

from logs.schema import trial_v1_pb2 as v1

START = "/trial/start"
DESCRIPTOR = "/trial/descriptor"
EVENT = "/trial/event"
LOG = "/trial/log"
ATTACHMENT = "/trial/attachment"
STOP = "/trial/stop"
FRAMES = "/tf"
JOINTS = "/robot/joint_states"
JAW = "/gripper/jaw"
REGISTRATION = "/registration/result"
OBJECT_POSE = "/registration/object_pose"
EXECUTION = "/grasp/execution"
PLANNED_POSE = "/grasp/planned_pose"
EXECUTED_POSE = "/grasp/executed_pose"
LABEL = "/annotation/label"
SCORE = "/annotation/score"
ANNOTATION_LOG = "/annotation/log"
"""One line for people, beside each label or score."""

_FIXED: dict[str, type[Message]] = {
    START: v1.TrialStart,
    DESCRIPTOR: v1.TrialDescriptor,
    EVENT: v1.TrialEvent,
    LOG: Log,
    ATTACHMENT: v1.AttachmentNote,
    STOP: v1.TrialStop,
    FRAMES: FrameTransforms,
    JOINTS: JointStates,
    JAW: v1.JawSample,
    REGISTRATION: v1.Registration,
    OBJECT_POSE: PoseInFrame,
    EXECUTION: v1.Execution,
    PLANNED_POSE: PoseInFrame,
    EXECUTED_POSE: PoseInFrame,
    LABEL: v1.Label,
    SCORE: v1.Score,
    ANNOTATION_LOG: Log,
}
_OF_CAMERA: dict[str, type[Message]] = {
    "calibration": CameraCalibration,
    "depth": RawImage,
    "color": CompressedImage,
    "points": PointCloud,
}


def camera_topic(camera: str, what: str) -> str:
    """Channel of a camera: `what` is calibration, depth, color or points."""
    return f"/camera/{camera}/{what}"


def is_camera_topic(topic: str, what: str) -> bool:
    """Whether a channel is that one of some camera."""
    pieces = topic.split("/")
    return len(pieces) == 4 and pieces[1] == "camera" and pieces[3] == what


def camera_of_topic(topic: str) -> str:
    """Name of the camera whose channel this is."""
    return topic.split("/")[2]


def message_type(topic: str) -> type[Message] | None:
    """Type of a channel's messages, or None for a channel this format does not know."""
    if topic in _FIXED:
        return _FIXED[topic]
    pieces = topic.split("/")
    if len(pieces) == 4 and pieces[1] == "camera":
        return _OF_CAMERA.get(pieces[3])
    return None
