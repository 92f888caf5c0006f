"""The ways a part comes to rest on a flat table, with their probabilities.

A part dropped in a random orientation first touches the table with some facet of its convex
hull and topples, without inertia, downhill until it rests ([Goldberg1999], as in trimesh).
Here toppling is a watershed on the hull's height function, and basins that only a negligible
hump divides are one pose: a part of revolution does not rest on each of its narrow facets.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.cache import cache_key, cached_arrays
from reach.hull import Hull, convex_hull
from reach.symmetry import Symmetry, symmetry, tolerance
from reach.transforms import as_transform

if TYPE_CHECKING:
    from reach.objects import GraspObject

VERSION = 7
MIN_PROBABILITY = 0.01
"""Poses below this probability are not planned on."""
NEGLIGIBLE_HUMP = 1e-4
"""A part rolls on over an edge that lifts its center of mass by less than this [m]: the
height of a printed layer."""
ROLL_WINDOW = np.radians(15.0)
"""... unless it has rolled by more than this: a part that rolls freely but is not round has a
pose every so often, so that each pose tells how the part lies [rad]."""
SAME_FACET = np.radians(5.0)
"""Resting facets of one height that are nearer, up to symmetry, are one pose [rad]."""
ROLL_FALL = 5e-4
"""Beyond the window too a part rolls on if that lowers its center of mass by this [m]."""
_LEVEL = 1e-9
"""Rises below this are rounding: there is no hump at all [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class StablePose:
    """One way to rest on the table.

    Args:
        index: position in the list sorted by falling probability.
        probability: of coming to rest like this, or like a symmetric copy of it.
        T_world_object: pose with the table at z = 0 and the center of mass above the origin,
            shape (4, 4); the turn about z is arbitrary.
    """

    index: int
    probability: float
    T_world_object: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_world_object", as_transform(self.T_world_object, "T_world_object")
        )


def stable_poses(
    obj: GraspObject, min_probability: float = MIN_PROBABILITY
) -> tuple[StablePose, ...]:
    """Stable poses of a part by falling probability, merged under its symmetry, cached.

    Args:
        obj: the part.
        min_probability: less probable poses are left out; with 0 the probabilities sum to one.
    """
    key = cache_key("stable poses", VERSION, obj.content_hash, tuple(np.round(obj.com, 9)))

    def compute() -> dict[str, FloatArray]:
        hull = convex_hull(obj.vertices, obj.com)
        facets, probabilities = resting_facets(hull)
        facets, probabilities = _merged(hull, facets, probabilities, symmetry(obj), tolerance(obj))
        return {"normals": hull.normals[facets], "probabilities": probabilities}

    entry = cached_arrays("stable_poses", key, compute)
    return tuple(
        StablePose(index, float(p), _resting_pose(obj, down))
        for index, (p, down) in enumerate(
            zip(entry["probabilities"], entry["normals"], strict=True)
        )
        if p >= min_probability
    )


def resting_facets(hull: Hull, hump: float = NEGLIGIBLE_HUMP) -> tuple[IntArray, FloatArray]:
    """Facets a part comes to rest on.

    Args:
        hull: of the part, about its center of mass.
        hump: rise of the center of mass that does not stop a rolling part [m].

    Returns:
        Numbers of the facets (N,), and probabilities (N,) that sum to one.
    """
    basin = _basins(hull, hump)
    shares = np.bincount(basin, weights=hull.solid_angles, minlength=len(basin))
    facets = np.flatnonzero(shares > 0)
    return facets, shares[facets] / shares.sum()


def _basins(hull: Hull, hump: float) -> IntArray:
    """Resting facet that each facet's landing ends on, shape (F,).

    Passes between facets are visited from the lowest up; a pass joins two basins if it rises
    less than the hump over the shallower one (persistence of the height function), and if the
    part has not rolled far on one level in between.
    """
    heights = hull.heights
    least_cosine = np.cos(ROLL_WINDOW)
    facets, across, passes = _passes(hull, heights)
    parent = np.arange(len(heights))

    def root(facet: int) -> int:
        while parent[facet] != facet:
            parent[facet] = parent[parent[facet]]
            facet = int(parent[facet])
        return facet

    rank = _tie_breaking_rank(hull, heights)
    for a, b, height in zip(facets, across, passes, strict=True):
        low, high = sorted((root(a), root(b)), key=rank.__getitem__)
        if low == high or height - heights[high] > hump:
            continue
        downhill = height - heights[high] <= _LEVEL or heights[high] - heights[low] > ROLL_FALL
        if downhill or hull.normals[low] @ hull.normals[high] >= least_cosine:
            parent[high] = low
    return np.array([root(facet) for facet in range(len(heights))])


def _passes(hull: Hull, heights: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Neighboring facets and the highest point of the way between them, lowest first.

    The way leads over a saddle if the center's foot lies inside the common edge on both sides;
    otherwise it falls monotonically, and of several ways down the steepest is the first.
    """
    insets = hull.insets
    rows, slots = np.nonzero(np.arange(len(heights))[:, None] < hull.neighbors)
    across = hull.neighbors[rows, slots]
    back = np.argmax(hull.neighbors[across] == rows[:, None], axis=1)
    here, there = insets[rows, slots], insets[across, back]
    over_saddle = np.hypot(heights[rows], here)
    level = np.maximum(heights[rows], heights[across])
    height = np.where((here > 0) & (there > 0), over_saddle, level)
    order = np.lexsort((np.minimum(here, there), height))
    return rows[order], across[order], height[order]


def _tie_breaking_rank(hull: Hull, heights: FloatArray) -> IntArray:
    """Order of facets by height; equal heights by vertex number, whatever the mesh's pose."""
    coarse = np.round(heights / 1e-8).astype(np.int64)
    corners = np.sort(hull.corners, axis=1)
    order = np.lexsort((corners[:, 2], corners[:, 1], corners[:, 0], coarse))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return rank


def _merged(
    hull: Hull,
    facets: IntArray,
    probabilities: FloatArray,
    sym: Symmetry,
    same_height: float,
) -> tuple[IntArray, FloatArray]:
    """Add up the probabilities of facets that are symmetric copies; sorted, likeliest first."""
    normals, heights = hull.normals, hull.heights
    sums: dict[int, float] = {}
    order = _likeliest_first(hull, facets, probabilities)
    for facet, probability in zip(facets[order], probabilities[order], strict=True):
        same = (
            other
            for other in sums
            if abs(heights[facet] - heights[other]) <= same_height
            and sym.equivalent_directions(normals[facet], normals[other]) < SAME_FACET
        )
        first = next(same, int(facet))
        sums[first] = sums.get(first, 0.0) + float(probability)
    merged, totals = np.array(list(sums)), np.array(list(sums.values()))
    order = _likeliest_first(hull, merged, totals)
    return merged[order], totals[order]


def _likeliest_first(hull: Hull, facets: IntArray, probabilities: FloatArray) -> IntArray:
    """Order by falling probability; equal ones by vertex number, whatever the mesh's pose."""
    corners = np.sort(hull.corners[facets], axis=1)
    coarse = np.round(-probabilities, 6)
    return np.lexsort((corners[:, 2], corners[:, 1], corners[:, 0], coarse))


def _resting_pose(obj: GraspObject, down: FloatArray) -> FloatArray:
    """Pose that turns a direction of the object (3,) down, lowest vertex on the table."""
    z = -down / np.linalg.norm(down)
    # World x is the object axis that lies flattest, so that a box comes to lie square.
    x = np.eye(3)[np.argmin(np.abs(z).round(6))]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = [x, np.cross(z, x), z]
    T[:3, 3] = -T[:3, :3] @ obj.com
    T[2, 3] = -(obj.vertices @ z).min()
    return T
