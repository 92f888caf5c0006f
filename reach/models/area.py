"""REACH: the area contact model, compiled ([Danielczuk2019] Sect. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reach.arrays import positive
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.pads import Pads
from reach.kernels.tree import MeshTree
from reach.kernels.verdict import judge_area_contacts
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
class AreaContact(CompiledModel):
    """REACH: each pad presses on an area, and every part of that area rubs.

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
    name: ClassVar[str] = "reach"
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
        judge_area_contacts(
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
