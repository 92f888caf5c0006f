"""REACH as the paper writes it: readable beside [Danielczuk2019], and the yardstick of the tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from reach.arrays import FloatArray, positive
from reach.contact import ContactPatch, Reason, Verdict, VerdictBatch
from reach.errors import InvalidInputError
from reach.grasp import DEFAULT_CLOSING_FORCE, Grasp
from reach.limit_surface import TriangleContacts
from reach.models.base import MARGIN_CAP, TORQUE_LENGTH, check_batch
from reach.models.defaults import COMPLIANCE, FRICTION
from reach.models.patches import describe_patch
from reach.patch import Patch, find_patch, largest
from reach.pressure import normal_integrals, stiffness, torsion_bounds, triangle_frames
from reach.scene import GRAVITY, Scene
from reach.transforms import inverse
from reach.wrench import WrenchSet, distance_to, linearized_margin, wrench_set

TOLERANCE = 1e-4
"""A wrench this close to Lambda, relative to its length, counts as inside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceAreaContact:
    """The area contact model by booleans, linearized limit surfaces, and a quadratic program.

    Args:
        friction: coefficient mu between pad and part.
        compliance: kappa, how deep a pad is pressed in by the closing force [m/N].
        saturate: whether the depth ends at the pad's `max_deformation`.
        triangles: how many of a contact's largest triangles count; None for all.
        solver: of the quadratic program, any of qpsolvers.
        margin_cap: margins are not sought beyond this many times gravity.
        torque_length: torques are divided by this length [m].

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    friction: float = FRICTION
    compliance: float = COMPLIANCE
    saturate: bool = True
    triangles: int | None = 10
    solver: str = "daqp"
    margin_cap: float = MARGIN_CAP
    torque_length: float = TORQUE_LENGTH
    name: ClassVar[str] = "reach-reference"
    version: ClassVar[str] = "1"

    def __post_init__(self) -> None:
        positive(self.friction, "friction", zero_allowed=True)
        positive(self.compliance, "compliance [m/N]")
        positive(self.margin_cap, "margin_cap")
        positive(self.torque_length, "torque_length [m]")
        if self.triangles is not None and self.triangles < 1:
            raise InvalidInputError(f"triangles is {self.triangles!r}, expected at least 1 or None")

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""
        return {
            "friction": self.friction,
            "compliance": self.compliance,
            "saturate": self.saturate,
            "triangles": "all" if self.triangles is None else float(self.triangles),
            "solver": self.solver,
            "margin_cap": self.margin_cap,
        }

    def patch(self, scene: Scene, grasp: Grasp, jaw: int) -> Patch | None:
        """Patch of one jaw (Sect. 4.1), in the opened pad's frame."""
        pad = scene.gripper.jaws[jaw].pad
        deformation = self.compliance * grasp.force  # d_def = kappa f_C
        if self.saturate:
            deformation = min(deformation, pad.max_deformation)
        return find_patch(
            scene.object,
            pad,
            grasp.T_object_gripper @ scene.gripper.T_gripper_pad(jaw),
            low=scene.gripper.travel(grasp.opening) - pad.max_deformation,
            high=scene.gripper.max_opening,
            deformation=deformation,
        )

    def contacts(self, patch: Patch, force: float, T_frame_pad: FloatArray) -> TriangleContacts:
        """Limit surfaces of a patch's triangles (Sect. 4.1, Eq. 4.1)."""
        frames = triangle_frames(patch)
        k = stiffness(frames, force)
        normal = k * normal_integrals(frames)  # f_z,i,max
        torsion = torsion_bounds(frames, k, self.friction)
        kept = largest(frames.areas, self.triangles)
        T = T_frame_pad @ frames.T_pad_triangle[kept]
        return TriangleContacts(T, normal[kept], self.friction * normal[kept], torsion[kept])

    def evaluate(self, scene: Scene, grasp: Grasp) -> Verdict:
        """Judge one grasp (Sect. 4.2)."""
        patches = {jaw: self.patch(scene, grasp, jaw) for jaw in range(len(scene.gripper.jaws))}
        found = {jaw: patch for jaw, patch in patches.items() if patch is not None}
        missing = tuple(jaw for jaw in patches if jaw not in found)
        described = lambda: _describe(scene, grasp, found)  # noqa: E731
        if len(found) < min(2, len(patches)):
            return Verdict(False, 0.0, Reason.NO_CONTACT, missing, described)
        T_frame_gripper = _com_frame(scene, grasp)
        contacts = [
            self.contacts(patch, grasp.force, T_frame_gripper @ scene.gripper.T_gripper_pad(jaw))
            for jaw, patch in found.items()
        ]
        down = T_frame_gripper[:3, :3] @ grasp.T_object_gripper[:3, :3].T
        weight = scene.object.mass * down @ scene.T_world_object[:3, :3].T @ GRAVITY
        wrench = np.concatenate([-weight, np.zeros(3)])  # -w: what the contacts must apply
        lam = wrench_set(contacts, self.torque_length)
        resists = self._inside(lam, wrench)
        margin = linearized_margin(lam, wrench, self.margin_cap)
        return Verdict(resists, margin, self._reason(lam, wrench, resists), missing, described)

    def _inside(self, lam: WrenchSet, wrench: FloatArray) -> bool:
        distance = distance_to(lam, wrench, solver=self.solver)
        return distance <= TOLERANCE * float(np.linalg.norm(wrench))

    def _reason(self, lam: WrenchSet, wrench: FloatArray, resists: bool) -> Reason:
        if resists:
            return Reason.HOLDS
        forces = WrenchSet(
            np.vstack([lam.G[:3], np.zeros_like(lam.G[3:])]), lam.A, lam.b, lam.lower, lam.upper
        )
        return Reason.TORQUE if self._inside(forces, wrench) else Reason.SLIPS

    def evaluate_batch(
        self,
        scene: Scene,
        T_object_gripper: ArrayLike,
        *,
        force: ArrayLike = DEFAULT_CLOSING_FORCE,
        friction: ArrayLike | None = None,
        mass: ArrayLike | None = None,
        com: ArrayLike | None = None,
        opening: float | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> VerdictBatch:
        """Judge many grasps one by one; arguments as for the compiled models."""
        from dataclasses import replace

        batch = check_batch(
            scene,
            T_object_gripper,
            force=force,
            friction=self.friction if friction is None else friction,
            mass=mass,
            com=com,
        )
        masses = np.linalg.norm(batch.gravity_object, axis=1) / np.linalg.norm(GRAVITY)
        verdicts = []
        for i in range(len(batch)):
            part = replace(scene.object, mass=float(masses[i]), center_of_mass=batch.com_object[i])
            model = replace(self, friction=float(batch.friction[i]))
            grasp = Grasp(batch.T_object_gripper[i], opening, float(batch.force[i]))
            verdicts.append(model.evaluate(replace(scene, object=part), grasp))
            if progress:
                progress(i + 1)
        return _batch(verdicts, len(scene.gripper.jaws))


def _batch(verdicts: list[Verdict], jaws: int) -> VerdictBatch:
    areas = np.zeros((len(verdicts), jaws))
    for i, verdict in enumerate(verdicts):
        for patch in verdict.patches:
            areas[i, patch.jaw] = patch.area
    return VerdictBatch(
        np.array([verdict.resists for verdict in verdicts], bool),
        np.array([verdict.margin for verdict in verdicts]),
        np.array([tuple(Reason).index(verdict.reason) for verdict in verdicts], np.int64),
        np.array([sum(1 << jaw for jaw in verdict.missing_jaws) for verdict in verdicts], np.int64),
        areas,
    )


def _com_frame(scene: Scene, grasp: Grasp) -> FloatArray:
    """T_frame_gripper: the frame has the gripper's axes, and its origin at the center of mass."""
    com_gripper = inverse(grasp.T_object_gripper) @ np.append(scene.object.com, 1.0)
    T = np.eye(4)
    T[:3, 3] = -com_gripper[:3]
    return T


def _describe(scene: Scene, grasp: Grasp, found: dict[int, Patch]) -> tuple[ContactPatch, ...]:
    described = [
        describe_patch(
            jaw,
            patch.triangles_pad,
            patch.normals_pad,
            patch.contact_depth + patch.deformation,
            patch.deformation,
            grasp.force,
            grasp.T_object_gripper @ scene.gripper.T_gripper_pad(jaw),
            scene.object.com,
        )
        for jaw, patch in found.items()
    ]
    return tuple(patch for patch in described if patch is not None)
