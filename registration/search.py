"""From many starts to a few distinct, refined and rendered hypotheses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.stable_poses import StablePose
from reach.transforms import inverse
from registration.alignment import align_planar, align_rigid
from registration.hypotheses import free_starts, planar_starts, put_where_seen, turned_over
from registration.mesh_model import MeshModel
from registration.observation import Observation
from registration.options import SensorProfile
from registration.polish import Polished
from registration.quick_check import seen_through
from registration.render_check import RenderCheck, render_check

COARSE_POINTS, FINE_POINTS = 220, 1500
KEPT_QUICK, KEPT_RENDERED = 14, 6
"""Hypotheses kept after the quick check and after the low-resolution render check."""
KEPT_QUICK_FREE, KEPT_RENDERED_FREE = 32, 10
TURNED_OVER = 2
"""So many of a free search's best hypotheses are also tried turned over."""
COARSE_PIXELS, FINE_PIXELS = 500, 5000
"""Pixels of the part that a render check looks at, about."""
COARSE_STEPS, FINE_STEPS = 12, 6
SCREENING, SCREENED, FEWEST_KEPT = 5, 1 / 3, 144
"""After so many coarse steps this share of the starts goes on, but no fewer than so many."""
HOPELESS = 0.2
"""A hypothesis whose render cost is this far above the best one's is not refined."""
BASIN = np.radians(8.0)
"""Hypotheses turned by less than this against each other slide into the same minimum [rad]."""
FREE = -1
"""Stable pose of a hypothesis that keeps to none."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One refined and rendered pose.

    Args:
        T_camera_object: shape (4, 4).
        stable_pose: index of the stable pose it keeps to, or FREE.
        cost: render cost.
        search: that found it.
        polished: its exact fit, None before it is refined.
    """

    T_camera_object: FloatArray
    stable_pose: int
    cost: float
    search: Search
    polished: Polished | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """A search for one part in one image.

    Args:
        model: of the part.
        seen: the image's window.
        profile: of the sensor.
        noise: standard deviation of the table's heights [m].
    """

    model: MeshModel
    seen: Observation
    profile: SensorProfile
    noise: float

    @property
    def depth_noise(self) -> float:
        """Standard deviation of a depth along its ray [m]: the table shows only its height."""
        return self.noise / self.seen.table.slope(self.seen.points.mean(axis=0))

    @property
    def fine_tolerance(self) -> float:
        """Depth difference that counts as full disagreement in the final render check [m]."""
        return max(1.0e-3, 4.0 * self.noise)

    def on_table(self, poses: Sequence[StablePose]) -> list[Hypothesis]:
        """Search stable poses x yaw, with the part standing on the table."""
        starts = planar_starts(poses)
        names = np.repeat([pose.index for pose in poses], len(starts) // len(poses))
        return self._run(starts, names, planar=True)

    def anywhere(self) -> list[Hypothesis]:
        """Search all orientations, table or not."""
        com = self.model.obj.com
        starts = free_starts(com)
        found = self._run(starts, np.full(len(starts), FREE), planar=False)
        # A nearly symmetric part's other poses lie half and quarter turns away.
        best = np.stack([hypothesis.T_camera_object for hypothesis in found[:TURNED_OVER]])
        starts = _lift(inverse(self.T_camera_table()), turned_over(best, com))
        found += self._run(starts, np.full(len(starts), FREE), planar=False)
        return sorted(found, key=lambda hypothesis: hypothesis.cost)

    def T_camera_table(self) -> FloatArray:
        """The frame that hypotheses are aligned in: z up, origin on the table below the part."""
        return self.seen.table.T_camera_table(self.seen.points.mean(axis=0))

    def _run(self, starts: FloatArray, names: IntArray, *, planar: bool) -> list[Hypothesis]:
        T_camera_table = self.T_camera_table()
        T_table_camera = inverse(T_camera_table)
        points = _transform(T_table_camera, self.seen.points)
        coarse, fine = _subset(points, COARSE_POINTS), _subset(points, FINE_POINTS)
        placed = put_where_seen(
            self.model,
            self.seen,
            _lift(T_camera_table, starts),
            self.seen.points.mean(axis=0),
            self.seen.table.normal_camera if planar else None,
        )
        T, names, loss = self._screened(_lift(T_table_camera, placed), names, coarse, planar=planar)
        score = loss + seen_through(
            self.model, self.seen, _lift(T_camera_table, T), max(3e-3, 4 * self.noise)
        )
        if not planar:
            score = score + self._below_table(T)
        kept = self._distinct(T, score, KEPT_QUICK if planar else KEPT_QUICK_FREE)
        T, names = T[kept], names[kept]
        check = self._render(_lift(T_camera_table, T), COARSE_PIXELS)
        order = np.argsort(check.cost, kind="stable")
        order = order[: KEPT_RENDERED if planar else KEPT_RENDERED_FREE]
        order = order[check.cost[order] <= check.cost[order[0]] + HOPELESS]
        return self._finish(T[order], names[order], fine, planar=planar)

    def _screened(
        self, T: FloatArray, names: IntArray, points: FloatArray, *, planar: bool
    ) -> tuple[FloatArray, IntArray, FloatArray]:
        """Starts aligned at falling scales, their names and losses; most are given up on the way."""
        scales = self._coarse_scales()
        T, loss = self._align(T, points, scales[:SCREENING], planar=planar)
        order = np.argsort(loss, kind="stable")[: max(FEWEST_KEPT, int(SCREENED * len(T)))]
        T, loss = self._align(T[order], points, scales[SCREENING:], planar=planar)
        return T, names[order], loss

    def from_starts(
        self, T_table_object: FloatArray, names: IntArray, *, planar: bool
    ) -> list[Hypothesis]:
        """Align and render starts (N, 4, 4) that are nearly right, by rising cost.

        Args:
            T_table_object: starts, in the frame `T_camera_table`.
            names: stable pose of each, or FREE, shape (N,).
            planar: keep them standing on the table.
        """
        points = _transform(inverse(self.T_camera_table()), self.seen.points)
        return self._finish(T_table_object, names, _subset(points, FINE_POINTS), planar=planar)

    def _finish(
        self, T: FloatArray, names: IntArray, points: FloatArray, *, planar: bool
    ) -> list[Hypothesis]:
        T, _ = self._align(T, points, self._fine_scales(), planar=planar)
        T_camera_object = _lift(self.T_camera_table(), T)
        cost = self.check(T_camera_object).cost
        if not planar:
            cost = cost + self._below_table(T)
        return [
            Hypothesis(T_camera_object[i], int(names[i]), float(cost[i]), self)
            for i in np.argsort(cost, kind="stable")
        ]

    def check(self, T_camera_object: FloatArray, pixels: int = FINE_PIXELS) -> RenderCheck:
        """High-resolution render check of hypotheses (N, 4, 4) on about so many pixels."""
        return self._render(T_camera_object, pixels)

    def _render(self, T_camera_object: FloatArray, pixels: int) -> RenderCheck:
        stride = max(1, round(float(np.sqrt(len(self.seen.points) / pixels))))
        coarse = pixels == COARSE_PIXELS
        tolerance = max(2.5e-3, 5.0 * self.noise) if coarse else self.fine_tolerance
        return render_check(
            self.model, self.seen, T_camera_object, stride=stride, tolerance=tolerance
        )

    def _align(
        self, T: FloatArray, points: FloatArray, scales: FloatArray, *, planar: bool
    ) -> tuple[FloatArray, FloatArray]:
        sdf = self.model.sdf
        args = (sdf.values, sdf.origin, 1.0 / sdf.spacing, points, np.ascontiguousarray(T), scales)
        aligned: tuple[FloatArray, FloatArray]
        if planar:
            aligned = align_planar(*args)
        else:
            # A free step is held back a little, so that unobservable directions stay put.
            prior = np.array([1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3])
            aligned = align_rigid(*args, prior)
        return aligned

    def _coarse_scales(self) -> FloatArray:
        return np.geomspace(10e-3, max(3e-3, 2.5 * self.noise), COARSE_STEPS)

    def _fine_scales(self) -> FloatArray:
        return np.geomspace(max(3e-3, 2.5 * self.noise), max(1e-3, 2.5 * self.noise), FINE_STEPS)

    def _below_table(self, T_table_object: FloatArray) -> FloatArray:
        """Penalty (N,) for reaching below the table: a centimeter costs as much as total failure."""
        hull = self.model.hull_vertices
        z = (
            T_table_object[:, 2, 0, None] * hull[:, 0]
            + T_table_object[:, 2, 1, None] * hull[:, 1]
            + T_table_object[:, 2, 2, None] * hull[:, 2]
            + T_table_object[:, 2, 3, None]
        )
        depth: FloatArray = np.maximum(0.0, -z.min(axis=1) - 2e-3 - 2 * self.noise)
        return np.minimum(1.0, depth / 10e-3)

    def _distinct(self, T: FloatArray, score: FloatArray, count: int) -> IntArray:
        """Indices of the best hypotheses, by rising score, without those that will end alike.

        Alike are poses of one basin (near each other in rotation and place) and poses that a
        symmetry maps to each other. A part that is *nearly* symmetric keeps its variants.
        """
        order = np.argsort(score, kind="stable")[: 16 * count]
        left = np.ones(len(order), bool)
        kept: list[int] = []
        for i in range(len(order)):
            if not left[i]:
                continue
            kept.append(int(order[i]))
            if len(kept) == count:
                break
            later = np.flatnonzero(left)
            later = later[later > i]
            others = T[order[later]]
            apart = self.model.surface_distances(T[order[i]], others, 160)
            cosine = ((T[order[i], :3, :3] * others[:, :3, :3]).sum(axis=(1, 2)) - 1) / 2
            basin = (cosine > np.cos(BASIN)) & (apart < 2 * self.profile.distinct)
            left[later[basin | (apart < self.profile.distinct / 6)]] = False
        return np.array(kept, dtype=np.int64)


def _subset(points: FloatArray, count: int) -> FloatArray:
    """About `count` points, spread evenly over the list (and so over the image's rows)."""
    count = min(count, len(points))
    return np.ascontiguousarray(points[np.arange(count) * len(points) // count])


def _lift(T_camera_table: FloatArray, T_table_object: FloatArray) -> FloatArray:
    """Poses (N, 4, 4) from the table's frame to the camera's; no BLAS, so always the same bits."""
    result: FloatArray = (T_camera_table[:, :, None] * T_table_object[:, None, :, :]).sum(axis=2)
    return result


def _transform(T: FloatArray, points: FloatArray) -> FloatArray:
    """Map points (N, 3) without BLAS."""
    result: FloatArray = (
        points[:, 0, None] * T[:3, 0]
        + points[:, 1, None] * T[:3, 1]
        + points[:, 2, None] * T[:3, 2]
        + T[:3, 3]
    )
    return result
