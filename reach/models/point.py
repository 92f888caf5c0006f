"""Soft point contacts: the rival that knows no area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reach.arrays import positive
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.pads import Pads
from reach.kernels.rivals import judge_point_contacts
from reach.kernels.tree import MeshTree
from reach.models.base import MARGIN_CAP, TORQUE_LENGTH, BatchInput, BatchOutput, CompiledModel
from reach.models.defaults import FRICTION, TORSION
from reach.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class PointContact(CompiledModel):
    """Soft point contact: where the ray from each pad's origin first meets the part.

    The contact carries the four-dimensional wrench |f_t| <= mu f_z, |tau_z| <= gamma f_z, with an
    exact friction cone; f_z is at most the closing force. Both jaws must touch.

    Args:
        friction: coefficient mu between pad and part.
        torsion: gamma, torsional limit over normal force [m].
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    friction: float = FRICTION
    torsion: float = TORSION
    margin_cap: float = MARGIN_CAP
    name: ClassVar[str] = "point"
    version: ClassVar[str] = "1"

    def __post_init__(self) -> None:
        positive(self.friction, "friction", zero_allowed=True)
        positive(self.torsion, "torsion [m]", zero_allowed=True)
        positive(self.margin_cap, "margin_cap")

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""
        return {
            "friction": self.friction,
            "torsion": self.torsion,
            "margin_cap": self.margin_cap,
        }

    def _judge(
        self, tree: MeshTree, pads: Pads, batch: BatchInput, part: slice, out: BatchOutput
    ) -> None:
        judge_point_contacts(
            tree,
            pads,
            batch.T_object_gripper[part],
            batch.gravity_object[part],
            batch.com_object[part],
            self.torsion,
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
        return ()
