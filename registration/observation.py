"""The image seen as table, candidate parts, and pixels without a return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reach.arrays import BoolArray, FloatArray
from registration.errors import TooFewPointsError
from registration.frame import DepthFrame
from registration.mesh_model import MeshModel
from registration.options import RegistrationOptions, SensorProfile
from registration.table import Table, plane_heights

NO_RETURN, TABLE, FOREIGN, PART = -1, 0, 1, 2
"""Labels of pixels; FOREIGN stands on the table but is not the candidate."""
MAX_GROUPS = 4
SMALLEST_SHARE = 0.02
"""A speck of less than this share of the largest group of pixels is the sensor's noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A window of the depth image around one candidate for the part.

    Args:
        depth: shape (H, W) [m], NaN without a return.
        labels: NO_RETURN, TABLE, FOREIGN or PART, shape (H, W).
        corner: image coordinates (u, v) of the window's first pixel.
        points: of the candidate, shape (N, 3), camera frame [m].
        frame: the image.
        table: fitted to it.
    """

    depth: FloatArray
    labels: NDArray[np.int16]
    corner: tuple[int, int]
    points: FloatArray
    frame: DepthFrame
    table: Table

    def rays(self, stride: int) -> FloatArray:
        """Points (h, w, 3) at depth 1 m of every stride-th pixel of the window, camera frame."""
        k = self.frame.intrinsics
        height, width = self.depth.shape
        u = self.corner[0] + np.arange(0, width, stride)
        v = self.corner[1] + np.arange(0, height, stride)
        rays = np.ones((len(v), len(u), 3))
        rays[..., 0] = ((u - k.cx) / k.fx)[None, :]
        rays[..., 1] = ((v - k.cy) / k.fy)[:, None]
        return rays


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """The whole image, divided.

    Args:
        frame: the image.
        table: fitted to it.
        labels: NO_RETURN, TABLE, FOREIGN, or a component's number from PART on, shape (H, W).
        components: points of each component, largest first, (N, 3) each, camera frame [m].
        standing: of each component, whether it is clearly higher than noise raises bare table.
        diameter: of the part [m].
    """

    frame: DepthFrame
    table: Table
    labels: NDArray[np.int16]
    components: tuple[FloatArray, ...]
    standing: tuple[bool, ...]
    diameter: float

    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Sets of components that together are no larger than the part, largest first.

        Shadows and occluders divide a part's image, so that what fits together is first taken
        together.
        """
        groups: list[tuple[int, ...]] = []
        for seed in range(len(self.components)):
            members = [seed]
            for other in range(len(self.components)):
                if other != seed and self._fits([*members, other]):
                    members.append(other)
            group = tuple(sorted(members))
            if self._stand(group) and not any(set(group) <= set(known) for known in groups):
                groups.append(group)
        return tuple(groups[:MAX_GROUPS])

    def singles(self) -> tuple[tuple[int, ...], ...]:
        """Components one by one, those left out that are a group already."""
        known = self.groups()
        return tuple(
            (i,)
            for i in range(min(MAX_GROUPS, len(self.components)))
            if self.standing[i] and (i,) not in known
        )

    def subsets(self) -> tuple[tuple[int, ...], ...]:
        """All components but one, for each, and each alone: what if one is not the part's?"""
        count = min(MAX_GROUPS + 1, len(self.components))
        if count == 1:
            return ((0,),)
        all_but: list[tuple[int, ...]] = [
            tuple(j for j in range(count) if j != i) for i in range(count)
        ]
        alone: list[tuple[int, ...]] = [(i,) for i in range(count)]
        return tuple(filter(self._stand, dict.fromkeys(all_but + alone)))

    def observation(self, group: tuple[int, ...]) -> Observation:
        """The window around one group of components; all others are foreign to it."""
        points = np.concatenate([self.components[i] for i in group])
        window = self._window(points)
        labels = self.labels[window]
        own = np.isin(labels, [PART + i for i in group])
        labels = np.where(own, PART, np.minimum(labels, FOREIGN)).astype(np.int16)
        depth = self.frame.depth[window].astype(float)
        corner = (window[1].start, window[0].start)
        return Observation(depth, labels, corner, points, self.frame, self.table)

    def _stand(self, group: tuple[int, ...]) -> bool:
        return any(self.standing[i] for i in group)

    def _fits(self, group: list[int]) -> bool:
        """Whether components lie within the part's diameter of each other, about."""
        points = np.concatenate([self.components[i][::7] for i in group])
        x, y = self.table.T_camera_table(points[0])[:3, :2].T
        allowed = self.diameter + 4e-3 + 4 * self.table.noise
        for angle in np.arange(4) * np.pi / 4:
            along = np.cos(angle) * x + np.sin(angle) * y
            extent = float(np.ptp((points * along).sum(axis=1)))
            if extent > allowed:
                return False
        return True

    def _window(self, points: FloatArray) -> tuple[slice, slice]:
        """Rows and columns that a part seen at the points can cover."""
        k = self.frame.intrinsics
        u = points[:, 0] / points[:, 2] * k.fx + k.cx
        v = points[:, 1] / points[:, 2] * k.fy + k.cy
        pad = 0.6 * self.diameter * max(k.fx, k.fy) / float(points[:, 2].min()) + 4
        return (
            slice(max(0, int(v.min() - pad)), min(k.height, int(v.max() + pad) + 1)),
            slice(max(0, int(u.min() - pad)), min(k.width, int(u.max() + pad) + 1)),
        )


def scan(
    frame: DepthFrame,
    table: Table,
    *,
    model: MeshModel,
    profile: SensorProfile,
    options: RegistrationOptions,
    split: bool = False,
) -> Scan:
    """Cut the table away and find what stands on it.

    Args:
        frame: the depth image.
        table: fitted to it.
        model: of the part.
        profile: of the sensor.
        options: of the registration.
        split: also part components where the depth jumps, as between a hand and what it hides.

    Raises:
        TooFewPointsError: nothing large enough stands on the table.
    """
    cut = max(profile.cut, 3.0 * table.noise)
    heights = plane_heights(frame, table.normal_camera, table.offset_camera)
    with np.errstate(invalid="ignore"):
        above = heights > cut
        too_high = heights > model.obj.diameter + 5e-3 + 4 * table.noise
    smooth = _smooth(frame, above, 4e-3 + 4 * table.noise)
    foreign = _foreign(above, smooth, too_high)
    mask = above & ~foreign
    labels, count = _connected(
        mask & smooth if split else mask, options.min_points, bridge=not split
    )
    labels[above & (labels == TABLE)] = FOREIGN
    labels[np.isnan(heights)] = NO_RETURN
    components = tuple(_points(frame, labels == PART + i) for i in range(count))
    # Correlated noise raises patches of bare table a little above the cut.
    standing = tuple(_stands(table, points, cut + 1.5 * table.noise) for points in components)
    if not any(standing):
        raise TooFewPointsError(
            f"nothing stands on the table: no group of {options.min_points} depth points is "
            f"clearly higher than {cut * 1e3:.1f} mm"
        )
    return Scan(frame, table, labels, components, standing, model.obj.diameter)


def _stands(table: Table, points: FloatArray, height: float) -> bool:
    return float(np.quantile(table.heights(points), 0.9)) > height


def _smooth(frame: DepthFrame, above: BoolArray, step: float) -> BoolArray:
    """Pixels above the table whose neighbors above it are at nearly the same depth."""
    import cv2

    window = np.ones((3, 3), np.uint8)
    near = cv2.erode(np.where(above, frame.depth, np.float32(1e3)), window)
    far = cv2.dilate(np.where(above, frame.depth, np.float32(0)), window)
    return np.asarray(above & (far - near < step))


def _foreign(above: BoolArray, smooth: BoolArray, too_high: BoolArray) -> BoolArray:
    """Mark what reaches higher than the part could, with all that hangs on it without a step."""
    if not too_high.any():
        return np.zeros_like(above)
    import cv2

    count, parts = cv2.connectedComponents(smooth.astype(np.uint8), connectivity=4)
    hit = np.bincount(parts[too_high & smooth], minlength=count) > 3
    hit[0] = False
    grown = cv2.dilate(hit[parts].astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    return np.asarray(above & (grown | too_high))


def _connected(mask: BoolArray, min_points: int, *, bridge: bool) -> tuple[NDArray[np.int16], int]:
    """Number groups of pixels from PART on, largest first; `bridge` gaps of a pixel."""
    import cv2

    image = mask.astype(np.uint8)
    if bridge:
        image = cv2.morphologyEx(image, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, parts = cv2.connectedComponents(image, connectivity=8 if bridge else 4)
    size = np.bincount(parts[mask], minlength=count)
    size[0] = 0
    order = np.argsort(-size, kind="stable")[: 3 * MAX_GROUPS]
    enough = max(min_points, SMALLEST_SHARE * int(size.max()))
    kept = [int(i) for i in order if size[i] >= enough]
    names = np.full(count, FOREIGN, np.int16)
    names[kept] = PART + np.arange(len(kept))
    return np.where(mask, names[parts], np.int16(TABLE)), len(kept)


def _points(frame: DepthFrame, mask: BoolArray) -> FloatArray:
    """Points (N, 3) of some pixels, camera frame [m]."""
    k = frame.intrinsics
    v, u = np.nonzero(mask)
    z = frame.depth[v, u].astype(float)
    return np.stack([(u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z], axis=-1)
