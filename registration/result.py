"""What a registration tells about the part's pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from reach.arrays import FloatArray, frozen
from reach.objects import GraspObject
from reach.transforms import as_transform, inverse


@dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """A physically different pose that explains the image nearly as well.

    Args:
        T_world_object: shape (4, 4).
        stable_pose: its index, None if it is none of them.
        render_cost: as of the chosen pose.
        margin: evidence for the chosen pose against this one, see `Registration.margin`.
        log_odds: natural logarithm of how much more likely the image makes the chosen pose.
        ruled_out: whether that is evidence enough.
    """

    T_world_object: FloatArray
    stable_pose: int | None
    render_cost: float
    margin: float = 0.0
    log_odds: float = 0.0
    ruled_out: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "T_world_object", as_transform(self.T_world_object, "T_world_object of a rival")
        )


@dataclass(frozen=True, slots=True, eq=False)
class TableFit:
    """The table's plane in the world: normal @ p = offset.

    Args:
        normal: unit, upward, shape (3,), world frame.
        offset: [m].
        rms: of its points about the plane [m].
        tilt: angle of the normal to the world's z [rad].
    """

    normal: FloatArray
    offset: float
    rms: float
    tilt: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", frozen(self.normal))


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """The pose of a part in one depth image, and how far to trust it.

    Args:
        T_camera_object: pose in the camera's frame, shape (4, 4).
        T_world_object: T_world_camera @ T_camera_object, shape (4, 4).
        covariance: of the pose in the camera's frame, without calibration: (rotation [rad],
            translation [m]), right perturbation, object frame, shape (6, 6).
        stable_pose: index of the stable pose found, None if it is none of them.
        fitness: share of the candidate's points within three noise widths of the surface.
        rmse: of those points' distances [m].
        observed_overlap: share of the candidate's pixels that the pose explains.
        model_overlap: share of the pose's visible pixels with a return that agree.
        free_space_violation: share of them that the camera looked through.
        unexplained: share of the candidate's pixels that the pose leaves unexplained.
        render_cost: mean robust disagreement with the image, 0 (perfect) to 1.
        margin: evidence against the strongest physically different pose, -1 to 1: over the
            pixels where the two differ, the share that speaks for this one; 1 without a rival.
        rivals: physically different poses that explain the image nearly as well, strongest first.
        unobservable: directions that the image does not tell, in words.
        tilt: angle between the part and the stable pose found [rad]; NaN without one.
        table: the table's plane.
        ambiguous: a rival is not ruled out: ask the operator, or place the part again.
        contradicts_declared: another stable pose than the declared one explains the image.
        seed: of the random draws.
        timings: CPU seconds by stage.
    """

    T_camera_object: FloatArray
    T_world_object: FloatArray
    covariance: FloatArray
    stable_pose: int | None
    fitness: float
    rmse: float
    observed_overlap: float
    model_overlap: float
    free_space_violation: float
    unexplained: float
    render_cost: float
    margin: float
    rivals: tuple[Rival, ...]
    unobservable: tuple[str, ...]
    tilt: float
    table: TableFit
    ambiguous: bool
    contradicts_declared: bool
    seed: int
    timings: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        for name in ("T_camera_object", "T_world_object"):
            set_field(self, name, as_transform(getattr(self, name), name))
        set_field(self, "covariance", frozen(self.covariance))

    @property
    def accepted(self) -> bool:
        """Whether a trial may go on without asking anyone."""
        return not (self.ambiguous or self.contradicts_declared)

    def same_grasp_outcome(
        self,
        obj: GraspObject,
        T_object_gripper: FloatArray,
        *,
        max_turn: float = float(np.radians(5.0)),
        max_shift: float = 2e-3,
        max_surface: float = 1e-3,
    ) -> bool:
        """Whether a grasp lands on the same place of the part whichever rival is true.

        The gripper goes where the chosen pose puts it. Had a rival been true, it would stand
        at another T_object_gripper; only if that is the planned one up to a symmetry of the
        part, for every rival that is not ruled out, may an ambiguous trial run unasked. A turn
        that moves the surface nowhere by more than a gripper can notice is such a symmetry: the
        hand meets the same shape. Nobody could tell such rivals apart if asked.

        Args:
            obj: the part.
            T_object_gripper: the planned grasp, shape (4, 4).
            max_turn: rotation that still counts as the same [rad].
            max_shift: translation that still counts as the same [m].
            max_surface: distance between two poses' surfaces that no grasp notices [m]; zero
                allows symmetries of the part alone.
        """
        from reach.symmetry import symmetry
        from registration.grasp_symmetry import same_grasp
        from registration.mesh_model import mesh_model

        T_object_gripper = as_transform(T_object_gripper, "T_object_gripper")
        T_world_gripper = self.T_world_object @ T_object_gripper
        sym, open_rivals = symmetry(obj), [r.T_world_object for r in self.rivals if not r.ruled_out]
        others = [
            T_world_object
            for T_world_object in open_rivals
            if not same_grasp(
                sym,
                T_object_gripper,
                inverse(T_world_object) @ T_world_gripper,
                max_turn,
                max_shift,
            )
        ]
        if not others:
            return True
        apart = mesh_model(obj).surface_distances(self.T_world_object, np.stack(others))
        return bool(apart.max() <= max_surface)
