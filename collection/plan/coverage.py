"""What a set of grasps covers: angles, widths, offsets, and what the pads meet.

Pure numbers for a report: was the experiment's choice of grasps as broad as it should be?
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any

import numpy as np

from collection.plan.records import PlannedGrasp
from collection.sampling.approach import center_of_pads
from logs.report.coverage import Histogram, PlanCoverage
from reach.arrays import BoolArray, FloatArray, IntArray
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.raycast import RaycastScene

SHARP = np.radians(30.0)
"""Faces that meet at a larger angle form an edge [rad]."""
NEAR = 4e-3
"""A contact this close to an edge or corner is counted there [m]."""
_BINS = 12


class Contact(StrEnum):
    """What the middle of a closing pad meets first."""

    FACE = "face"
    EDGE = "edge"
    CORNER = "corner"
    MISS = "miss"


def coverage(
    grasps: Iterable[PlannedGrasp],
    objects: Mapping[str, GraspObject],
    gripper: ParallelJawGripper,
) -> PlanCoverage:
    """Count what grasps cover.

    Args:
        grasps: planned grasps of any parts.
        objects: the parts by name.
        gripper: the hand.
    """
    grasps = tuple(grasps)
    counts = dict.fromkeys(Contact, 0)
    for name in dict.fromkeys(grasp.object_name for grasp in grasps):
        poses = np.array([g.T_object_gripper for g in grasps if g.object_name == name])
        for kind in _met_by_pads(objects[name], gripper, poses):
            counts[kind] += 1
    center = center_of_pads(gripper)
    offsets = [
        np.linalg.norm((g.T_object_gripper @ center - g.T_object_gripper_parent @ center)[:3, 3])
        for g in grasps
    ]
    return PlanCoverage(
        grasps=len(grasps),
        approach_angle=_histogram(np.array([g.approach_angle for g in grasps]), np.pi / 3),
        width=_histogram(np.array([g.width for g in grasps]), gripper.max_opening),
        offset=_histogram(np.array(offsets), gripper.jaws[0].pad.width),
        contacts={kind.value: count for kind, count in counts.items()},
    )


def _histogram(values: FloatArray, high: float) -> Histogram:
    """Histogram of values (N,) from zero to at least `high`."""
    top = max(high, float(values.max(initial=0.0)))
    counts, edges = np.histogram(values, bins=_BINS, range=(0.0, top))
    return Histogram(tuple(edges.tolist()), tuple(counts.tolist()))


def _met_by_pads(
    obj: GraspObject, gripper: ParallelJawGripper, T_object_gripper: FloatArray
) -> list[Contact]:
    """What the middle of each pad meets as the jaws close."""
    scene = RaycastScene(obj.vertices, obj.faces)
    features = _Features.of(obj)
    met: list[Contact] = []
    for jaw in range(len(gripper.jaws)):
        T_object_pad = T_object_gripper @ gripper.T_gripper_pad(jaw)
        starts, ahead = T_object_pad[:, :3, 3], T_object_pad[:, :3, 2]
        distance, _ = scene.cast(starts, ahead)
        hit = distance <= gripper.max_opening
        points = starts[hit] + distance[hit, None] * ahead[hit]
        met += [Contact.MISS] * int((~hit).sum())
        met += [features.at(point) for point in points]
    return met


class _Features:
    """Sharp edges of a part, and the corners where at least three of them meet."""

    def __init__(self, starts: FloatArray, ends: FloatArray, corners: FloatArray) -> None:
        self._starts, self._ends, self._corners = starts, ends, corners

    @classmethod
    def of(cls, obj: GraspObject) -> _Features:
        mesh: Any = obj.mesh
        sharp: BoolArray = mesh.face_adjacency_angles > SHARP
        edges: IntArray = np.asarray(mesh.face_adjacency_edges)[sharp]
        degree = np.bincount(edges.ravel(), minlength=len(obj.vertices))
        corners = obj.vertices[degree >= 3]
        return cls(obj.vertices[edges[:, 0]], obj.vertices[edges[:, 1]], corners)

    def at(self, point: FloatArray) -> Contact:
        """Whether a surface point (3,) is near a corner, near an edge, or on a face."""
        if len(self._corners) and np.linalg.norm(self._corners - point, axis=1).min() <= NEAR:
            return Contact.CORNER
        if len(self._starts) and self._edge_distance(point) <= NEAR:
            return Contact.EDGE
        return Contact.FACE

    def _edge_distance(self, point: FloatArray) -> float:
        along = self._ends - self._starts
        squared = np.maximum(np.einsum("ij,ij->i", along, along), 1e-18)
        share = np.clip(np.einsum("ij,ij->i", point - self._starts, along) / squared, 0, 1)
        nearest = self._starts + share[:, None] * along
        return float(np.linalg.norm(nearest - point, axis=1).min())
