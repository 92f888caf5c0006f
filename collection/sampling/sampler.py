"""Draw grasps on a part in one stable pose, as the paper did ([Danielczuk2019] Sect. 5)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from collection.sampling.antipodal import ContactPairs, Surface, contact_pairs
from collection.sampling.approach import (
    center_of_pads,
    draw_approaches,
    drawn_back,
    gripper_poses,
    jittered,
    tip_reach,
)
from collection.sampling.distance import grasp_distance
from collection.sampling.options import SamplingOptions
from collection.sampling.planning_mesh import planning_mesh
from reach.arrays import BoolArray, FloatArray, frozen, frozen_finite
from reach.collision import CollisionChecker
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import as_transform

Reachable = Callable[[FloatArray], BoolArray]
"""Tells of poses T_world_gripper (N, 4, 4) which the arm can reach, shape (N,)."""

_ROUNDING = 1e-9
"""Slack for a hand that was drawn back to exactly the clearance [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class SampledGrasp:
    """One grasp to be tried.

    Args:
        T_object_gripper: pose of the gripper, shape (4, 4).
        T_object_gripper_parent: the same before jitter, shape (4, 4).
        width: of the part between the parent's contacts [m].
        contacts_object: the parent's contacts, shape (2, 3), object frame [m].
        approach_angle: between approach and straight down [rad].
    """

    T_object_gripper: FloatArray
    T_object_gripper_parent: FloatArray
    width: float
    contacts_object: FloatArray
    approach_angle: float

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        for name in ("T_object_gripper", "T_object_gripper_parent"):
            set_field(self, name, as_transform(getattr(self, name), name))
        set_field(
            self, "contacts_object", frozen_finite(self.contacts_object, "contacts_object", (2, 3))
        )


@dataclass(frozen=True, slots=True, eq=False)
class SampleResult:
    """Sampled grasps, and how many candidates were discarded why.

    Args:
        grasps: fewer than asked for if the part gives no more.
        discarded: reason -> number of candidates.
        candidates: number of rays shot.
        mesh_note: what was done to the mesh for planning, empty if nothing.
    """

    grasps: tuple[SampledGrasp, ...]
    discarded: dict[str, int]
    candidates: int
    mesh_note: str = ""


def sample_grasps(
    obj: GraspObject,
    gripper: ParallelJawGripper,
    stable_pose: StablePose,
    *,
    count: int,
    rng: np.random.Generator,
    reachable: Reachable | None = None,
    options: SamplingOptions | None = None,
) -> SampleResult:
    """Sample grasps on and around a part that lies in a stable pose.

    Antipodal pairs of contacts give parents, which must be free of collision and reachable.
    Each is jittered once; a jittered grasp that misses the part is kept (the experiment needs
    failures), one that collides with open jaws is not.

    Args:
        obj: the part.
        gripper: the hand.
        stable_pose: how the part lies on the table.
        count: how many grasps.
        rng: source of randomness.
        reachable: filter of the arm; every pose is taken for reachable if None.
        options: limits of the search.
    """
    search = _Search(obj, gripper, stable_pose, reachable, options or SamplingOptions())
    return search.run(count, rng)


class _Search:
    """The state of one search: what is kept and what was discarded so far."""

    def __init__(
        self,
        obj: GraspObject,
        gripper: ParallelJawGripper,
        stable_pose: StablePose,
        reachable: Reachable | None,
        options: SamplingOptions,
    ) -> None:
        mesh = planning_mesh(obj)
        self.options = options
        self.gripper = gripper
        self.reachable = reachable
        self.mesh_note = mesh.note
        self.surface = Surface.of(mesh.vertices, mesh.faces)
        self.checker = CollisionChecker(
            mesh.vertices, mesh.faces, gripper, options.approach_distance
        )
        self.T_world_object = stable_pose.T_world_object
        self.down = -self.T_world_object[2, :3]
        self.center = center_of_pads(gripper)
        self.kept: list[SampledGrasp] = []
        self.kept_poses: FloatArray = np.empty((0, 4, 4))
        self.discarded: Counter[str] = Counter()

    def run(self, count: int, rng: np.random.Generator) -> SampleResult:
        candidates = 0
        self.kept_poses = np.empty((count, 4, 4))
        while len(self.kept) < count and candidates < self.options.max_candidates:
            self._try_batch(count, rng)
            candidates += self.options.batch
        return SampleResult(
            tuple(self.kept),
            {k: n for k, n in self.discarded.items() if n},
            candidates,
            self.mesh_note,
        )

    def _try_batch(self, count: int, rng: np.random.Generator) -> None:
        limits = (
            self.options.min_width,
            self.gripper.max_opening - 2 * self.options.opening_margin,
        )
        pairs, discarded = contact_pairs(
            self.surface,
            self.options.batch,
            rng,
            normal_angle=self.options.normal_angle,
            width_limits=limits,
        )
        self.discarded += discarded
        approaches, possible = draw_approaches(
            pairs.axes, self.down, self.options.approach_angle, rng
        )
        self.discarded["closing axis too steep"] += int((~possible).sum())
        pairs = ContactPairs(pairs.points[possible], pairs.faces[possible])
        parents = self._over_the_table(gripper_poses(pairs, approaches[possible], self.gripper))
        width = self.options.jitter
        if width is None:
            width = min(jaw.pad.width for jaw in self.gripper.jaws)
        grasps = jittered(parents, width, rng)  # drawn for all: the order of checks may change
        good = np.flatnonzero(self._usable(parents, ""))
        if width > 0:
            good = good[self._usable(grasps[good], "jittered: ")]
        for n in good:
            if len(self.kept) == count:
                return
            self._keep(grasps[n], parents[n], pairs.points[n])

    def _over_the_table(self, parents: FloatArray) -> FloatArray:
        """Parents on a low part hold it with the tips of the pads instead of their middle."""
        lowest = self.checker.lowest_point(self.T_world_object @ parents)
        shortage = self.options.table_clearance - lowest
        limit = tip_reach(self.gripper) - self.options.tip_margin
        return drawn_back(parents, shortage, self.down, max(limit, 0.0))

    def _usable(self, T_object_gripper: FloatArray, prefix: str) -> BoolArray:
        """Which poses are clear of table and part, and within reach; counts the others."""
        T_world_gripper = self.T_world_object @ T_object_gripper
        lowest = self.checker.lowest_point(T_world_gripper)
        usable: BoolArray = lowest >= self.options.table_clearance - _ROUNDING
        self.discarded[prefix + "hits the table"] += int((~usable).sum())

        rest = np.flatnonzero(usable)
        usable[rest] = ~self.checker.hits_object(T_object_gripper[rest])
        self.discarded[prefix + "hits the part"] += len(rest) - int(usable.sum())

        rest = np.flatnonzero(usable)
        if self.reachable is not None and len(rest):
            usable[rest] = self.reachable(T_world_gripper[rest])
        self.discarded[prefix + "out of the arm's reach"] += len(rest) - int(usable.sum())
        return usable

    def _keep(self, T: FloatArray, T_parent: FloatArray, contacts: FloatArray) -> None:
        number = len(self.kept)
        nearest = grasp_distance(self.kept_poses[:number], T, self.center).min(initial=np.inf)
        if nearest <= self.options.min_distance:
            self.discarded["near-duplicate"] += 1
            return
        self.kept_poses[number] = T
        self.kept.append(
            SampledGrasp(
                T,
                T_parent,
                float(np.linalg.norm(contacts[1] - contacts[0])),
                frozen(contacts),
                float(np.arccos(np.clip(T[:3, 2] @ self.down, -1, 1))),
            )
        )
