"""Scores of one grasp under many parameter sets of a model at once, for cross-validation.

The same scores as one set after the other, at a fraction of the time: what the sets share is
computed once (see [reach.kernels.draws][]).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from reach.arrays import FloatArray, IntArray
from reach.grasp import Grasp
from reach.kernels import draws as kernels
from reach.kernels.compiling import announce_compilation
from reach.kernels.pads import Pads, pads_of
from reach.kernels.tree import MeshTree, mesh_tree
from reach.models.analytic import NominalScorer, RobustScorer
from reach.models.area import AreaContact
from reach.models.base import TORQUE_LENGTH, depths
from reach.models.ellipse import EllipseContact
from reach.models.point import PointContact
from reach.pose_error import PoseError
from reach.robustness import draw_samples
from reach.scene import GRAVITY, Scene


def share_work(scorers: Sequence[Any]) -> bool:
    """Whether [scores_of_draws][] takes these scorers: one analytic model, parameters apart."""
    kinds = {(type(one), type(getattr(one, "model", None))) for one in scorers}
    known = {
        (scorer, model)
        for scorer in (NominalScorer, RobustScorer)
        for model in (PointContact, EllipseContact, AreaContact)
    }
    return len(kinds) == 1 and kinds <= known and len({_sampling(one) for one in scorers}) == 1


def scores_of_draws(
    scorers: Sequence[Any],
    scene: Scene,
    grasp: Grasp,
    *,
    pose_error: PoseError | None,
    seed: int,
) -> FloatArray:
    """Score one grasp by every scorer, shape (D,).

    Args:
        scorers: of one analytic model, for which [share_work][] is true: they differ in friction,
            torsion, compliance and saturation only.
        scene: part, gripper and believed pose.
        grasp: as planned.
        pose_error: the station's; the scorers' own if None.
        seed: of the perturbations.
    """
    tree, pads = mesh_tree(scene.object), pads_of(scene.gripper, grasp.opening)
    T, factor, mass = _samples(scorers[0], scene, grasp, pose_error, seed)
    gravity = mass[:, None] * (scene.T_world_object[:3, :3].T @ GRAVITY)
    models = [one.model for one in scorers]
    friction = np.array([model.friction for model in models])
    held = np.zeros(len(models), np.int64)
    shared = (tree, pads, T, gravity, np.array(scene.object.com), factor, grasp.force)
    cap = float(models[0].margin_cap)
    if isinstance(models[0], PointContact):
        torsion = np.array([model.torsion for model in models])
        _run(kernels.count_point_draws, *shared, torsion, friction, cap, TORQUE_LENGTH, held)
        return held / len(factor)
    force = np.array([grasp.force])
    depth = np.concatenate([depths(pads, force, m.compliance, m.saturate) for m in models])
    if isinstance(models[0], EllipseContact):  # its size is the patch's, whatever the pressure
        depth = np.minimum(depth, _extent(tree, pads, T))
    order, groups = _groups(depth, friction)
    area = isinstance(models[0], AreaContact)
    count = kernels.count_area_draws if area else kernels.count_ellipse_draws
    of_groups = (np.ascontiguousarray(depth[order[groups[:-1]]]), groups, friction[order])
    _run(count, *shared, *of_groups, cap, TORQUE_LENGTH, held)
    result = np.empty(len(models))
    result[order] = held / len(factor)
    return result


def _sampling(scorer: Any) -> tuple[object, ...]:
    """What must be equal for scorers to see the same samples and margins."""
    own = tuple(
        getattr(scorer, name, None)
        for name in ("samples", "friction_spread", "mass_spread", "default_pose_error", "adaptive")
    )
    return (*own, getattr(getattr(scorer, "model", None), "margin_cap", None))


def _samples(
    scorer: NominalScorer | RobustScorer,
    scene: Scene,
    grasp: Grasp,
    pose_error: PoseError | None,
    seed: int,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Poses (S, 4, 4), factors of friction (S,) and masses (S,) that a scorer judges."""
    if isinstance(scorer, NominalScorer):
        return np.array(grasp.T_object_gripper[None]), np.ones(1), np.array([scene.object.mass])
    return draw_samples(
        scene,
        grasp,
        pose_error or scorer.default_pose_error,
        scorer.samples,
        seed,
        scorer.friction_spread,
        scorer.mass_spread,
    )


def _groups(depth: FloatArray, friction: FloatArray) -> tuple[IntArray, IntArray]:
    """Order of the draws by depth, then friction; and where each depth begins, and the end."""
    order = np.lexsort((friction, *depth.T))
    changes = (np.diff(depth[order], axis=0) != 0).any(axis=1)
    return order, np.concatenate([[0], np.flatnonzero(changes) + 1, [len(order)]])


def _extent(tree: MeshTree, pads: Pads, T_object_gripper: FloatArray) -> float:
    """Depth below first contact that no part of the object exceeds, at any of the poses [m]."""
    size = 2.0 * tree.boxes[0, 3:]
    closing = np.einsum("nij,kj->nki", T_object_gripper[:, :3, :3], pads.T_gripper_pad[:, :3, 2])
    return float((np.abs(closing) @ size).max())


def _run(kernel: Any, *arguments: Any) -> None:
    announce_compilation(kernel)
    kernel(*arguments)
