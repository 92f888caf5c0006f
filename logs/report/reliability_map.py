"""Where on an object a grasp is reliable, under two models: the paper's Fig. 1.

Points are spread over the surface; through each goes a grasp that closes along the inward
normal and comes from as far above as that allows. Its reliability colors the object around both
places where it touches. Collisions play no part: the picture is about contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import FloatArray
from reach.grasp import Grasp
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.raycast import RaycastScene
from reach.scene import Scene

if TYPE_CHECKING:
    from reach.models.base import ContactModel
    from reach.pose_error import PoseError

SPREAD = 3.5e-3
"""How far a grasp colors the surface around its contacts [m]."""
NO_GRASP = (0.80, 0.82, 0.85)


@dataclass(frozen=True, slots=True, eq=False)
class ProbeGrasps:
    """Grasps through points of the surface.

    Args:
        T_object_gripper: shape (N, 4, 4).
        contacts: where each touches, object frame, shape (N, 2, 3) [m].
        normals: outward at the contacts, object frame, shape (N, 2, 3).
    """

    T_object_gripper: FloatArray
    contacts: FloatArray
    normals: FloatArray


def probe_grasps(
    part: GraspObject,
    gripper: ParallelJawGripper,
    down_object: FloatArray,
    count: int,
    rng: np.random.Generator,
) -> ProbeGrasps:
    """Grasps through points spread evenly over the surface, for those that have one.

    Args:
        part: the object.
        gripper: a hand with two jaws.
        down_object: direction of gravity in the object's frame, shape (3,).
        count: of points to try.
        rng: where they come from.
    """
    points, faces = _surface_points(part, count, rng)
    inward = -part.face_normals[faces]
    inset = 1e-4 * inward
    distance, opposite = RaycastScene(part.vertices, part.faces).cast(points + inset, inward)
    width = distance + np.linalg.norm(inset, axis=1)
    outward_there = part.face_normals[opposite]
    upright = np.abs(inward @ down_object) < 0.95  # else no approach from above closes along it
    usable = (width < gripper.max_opening) & (np.einsum("ij,ij->i", inward, outward_there) > 0.5)
    usable &= upright
    points, inward, width = points[usable], inward[usable], width[usable]
    other = points + width[:, None] * inward
    T = _poses(0.5 * (points + other), inward, down_object, gripper)
    contacts = np.stack([points, other], axis=1)
    normals = np.stack([-inward, outward_there[usable]], axis=1)
    return ProbeGrasps(T, contacts, normals)


def reliabilities(
    model: ContactModel,
    part: GraspObject,
    gripper: ParallelJawGripper,
    T_world_object: FloatArray,
    probes: ProbeGrasps,
    pose_error: PoseError,
    *,
    samples: int = 20,
    seed: int = 0,
) -> FloatArray:
    """Reliability of each probe grasp under a model, shape (N,)."""
    from reach.robustness import reliability

    scene = Scene(part, gripper, T_world_object)
    return np.array(
        [
            reliability(
                model, scene, Grasp(T), pose_error=pose_error, samples=samples, seed=seed
            ).value
            for T in probes.T_object_gripper
        ]
    )


class ReliabilityPaint:
    """Colors of surface points from the reliability of the grasps that touch near them.

    Args:
        probes: the grasps.
        values: their reliabilities, shape (N,).
    """

    def __init__(self, probes: ProbeGrasps, values: FloatArray) -> None:
        from scipy.spatial import cKDTree

        self._points = probes.contacts.reshape(-1, 3)
        self._normals = probes.normals.reshape(-1, 3)
        self._values = np.repeat(values, 2)
        self._tree = cKDTree(self._points)

    def __call__(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Colors (N, 3) of points (N, 3) with outward normals (N, 3), object frame."""
        neighbors = min(12, len(self._points))
        nearest = range(1, neighbors + 1)  # a list of ranks: the answer always has two axes
        distance, index = map(np.asarray, self._tree.query(points, k=list(nearest)))
        facing = np.einsum("nkj,nj->nk", self._normals[index], normals)
        weight = np.exp(-0.5 * (distance / SPREAD) ** 2) * (facing > 0.6)
        total = weight.sum(axis=1)
        value = (weight * self._values[index]).sum(axis=1) / np.maximum(total, 1e-12)
        color = reliability_color(value)
        blend = np.clip(total / 0.15, 0, 1)[:, None]
        painted: FloatArray = blend * color + (1 - blend) * np.array(NO_GRASP)
        return painted


def reliability_color(value: FloatArray) -> FloatArray:
    """Red through yellow to green, shape (N, 3), for values in [0, 1]."""
    stops = np.array([[0.76, 0.18, 0.16], [0.96, 0.74, 0.26], [0.13, 0.62, 0.42]])
    at = np.array([0.0, 0.5, 1.0])
    return np.stack([np.interp(value, at, stops[:, k]) for k in range(3)], axis=-1)


def _surface_points(
    part: GraspObject, count: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    t = part.triangles
    area = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1)
    # Systematic sampling: evenly spaced along the running total of area.
    at = (np.arange(count) + rng.uniform()) / count
    faces = np.searchsorted(np.cumsum(area) / area.sum(), at).clip(max=len(area) - 1)
    u, v = rng.uniform(size=(2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = np.moveaxis(t[faces], 1, 0)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), faces


def _poses(
    middle: FloatArray, closing: FloatArray, down: FloatArray, gripper: ParallelJawGripper
) -> FloatArray:
    """Hands whose pads meet in the middle, closing along given directions, coming from above."""
    approach = down - np.einsum("ij,j->i", closing, down)[:, None] * closing
    approach /= np.linalg.norm(approach, axis=1, keepdims=True)
    rotation = np.stack([closing, np.cross(approach, closing), approach], axis=-1)
    pads = [gripper.T_gripper_pad(jaw)[:3, 3] for jaw in (0, 1)]
    T = np.tile(np.eye(4), (len(middle), 1, 1))
    T[:, :3, :3] = rotation
    T[:, :3, 3] = middle - rotation @ (0.5 * (pads[0] + pads[1]))
    return T
