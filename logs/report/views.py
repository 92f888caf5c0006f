"""Pictures of a data set's objects and grasps, as `data:` addresses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from logs.report.rendering import Solid, data_uri, object_solid, plate_solid, render
from reach.arrays import FloatArray
from reach.evaluation.cases import GraspCase
from reach.evaluation.overlap import closed_width
from reach.transforms import apply

if TYPE_CHECKING:
    from logs.dataset.dataset import Dataset

PAD_COLOR = (0.15, 0.39, 0.92)
PAD_OPACITY = 0.55
GRASP_ELEVATION = np.radians(35.0)


def object_picture(dataset: Dataset, name: str) -> str:
    """An object as it lay in most of its trials."""
    poses: dict[bytes, list[FloatArray]] = {}
    for trial in dataset.trials:
        if trial.object_name == name:
            up = np.round(trial.T_world_object[2, :3], 3) + 0.0  # no negative zero
            poses.setdefault(up.tobytes(), []).append(trial.T_world_object)
    most = max(poses.values(), key=len)[0]
    return data_uri(render([object_solid(dataset.objects[name], most)]))


def grasp_picture(case: GraspCase) -> str:
    """A planned grasp: the object on the table, and the pads where they meet it."""
    scene, grasp = case.scene, case.grasp
    part = object_solid(scene.object, scene.T_world_object)
    width = closed_width(scene.object, scene.gripper, grasp.T_object_gripper, grasp.opening)
    pads = _pads(case, scene.gripper.max_opening if width is None else width)
    focus = np.concatenate([part.vertices, *(pad.vertices for pad in pads)])
    return data_uri(
        render([part, *pads], focus=focus, azimuth=_sideways(case), elevation=GRASP_ELEVATION)
    )


def _pads(case: GraspCase, opening: float) -> list[Solid]:
    """The jaws' pads at an opening, each a plate behind its face."""
    gripper = case.scene.gripper
    T_world_gripper = case.scene.T_world_object @ case.grasp.T_object_gripper
    plates = []
    for number, jaw in enumerate(gripper.jaws):
        polygon = jaw.pad.polygon[::-1]  # turned over, so that the plate lies behind its face
        corners = np.column_stack([polygon, np.zeros(len(polygon))])
        opening = min(max(opening, 0.0), gripper.max_opening)
        T_world_pad = T_world_gripper @ gripper.T_gripper_pad(number, opening)
        plates.append(
            plate_solid(apply(T_world_pad, corners), jaw.pad.thickness, PAD_COLOR, PAD_OPACITY)
        )
    return plates


def _sideways(case: GraspCase) -> float:
    """A camera direction that sees the pads from the side: 75 degrees off the closing axis."""
    T_world_gripper = case.scene.T_world_object @ case.grasp.T_object_gripper
    closing = T_world_gripper[:2, 0]
    if np.linalg.norm(closing) < 0.2:
        return float(np.radians(-55))
    angle = np.arctan2(closing[1], closing[0])
    options = [angle + np.radians(75) * side + np.pi * flip for side in (1, -1) for flip in (0, 1)]
    return float(min(options, key=lambda a: abs(np.angle(np.exp(1j * (a - np.radians(-55)))))))
