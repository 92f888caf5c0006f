"""Elliptical area contacts after [Ciocarlie2007]: one limit surface a patch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reach.arrays import positive
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.pads import Pads
from reach.kernels.rivals import judge_ellipse_contacts
from reach.kernels.tree import MeshTree
from reach.models.base import (
    MARGIN_CAP,
    TORQUE_LENGTH,
    BatchInput,
    BatchOutput,
    CompiledModel,
    depths,
)
from reach.models.defaults import COMPLIANCE, FRICTION
from reach.models.patches import compiled_patches
from reach.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class EllipseContact(CompiledModel):
    """An ellipse fitted to each patch, under Hertzian pressure.

    The ellipse has the patch's second moments of area in the plane perpendicular to its mean
    normal. One limit surface acts at its center, with f_t,max = mu f_C and
    tau_max = (3 pi / 16) mu f_C sqrt(a b).

    Args:
        friction: coefficient mu between pad and part.
        compliance: kappa, how deep a pad is pressed in by the closing force [m/N].
        saturate: whether the depth ends at the pad's `max_deformation`.
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    friction: float = FRICTION
    compliance: float = COMPLIANCE
    saturate: bool = True
    margin_cap: float = MARGIN_CAP
    name: ClassVar[str] = "ellipse"
    version: ClassVar[str] = "1"

    def __post_init__(self) -> None:
        positive(self.friction, "friction", zero_allowed=True)
        positive(self.compliance, "compliance [m/N]")
        positive(self.margin_cap, "margin_cap")

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""
        return {
            "friction": self.friction,
            "compliance": self.compliance,
            "saturate": self.saturate,
            "margin_cap": self.margin_cap,
        }

    def _judge(
        self, tree: MeshTree, pads: Pads, batch: BatchInput, part: slice, out: BatchOutput
    ) -> None:
        judge_ellipse_contacts(
            tree,
            pads,
            batch.T_object_gripper[part],
            batch.gravity_object[part],
            batch.com_object[part],
            depths(pads, batch.force[part], self.compliance, self.saturate),
            batch.force[part],
            batch.friction[part],
            self.margin_cap,
            TORQUE_LENGTH,
            out.margin[part],
            out.reason[part],
            out.missing[part],
            out.area[part],
        )

    def _patches(self, scene: Scene, grasp: Grasp) -> tuple[ContactPatch, ...]:
        return compiled_patches(scene, grasp, self.compliance, self.saturate)
