"""Soft point contacts: the rival that knows no area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reach.arrays import FloatArray, positive
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.pads import Pads
from reach.kernels.point_contact import judge_point_contacts
from reach.models.defaults import TORSION
from reach.models.wrench_set_model import WrenchSetModel
from reach.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class PointContact(WrenchSetModel):
    """Soft point contact: where the ray from each pad's center first meets the part.

    The center is the pad frame's origin. Where the ray passes the part by although the pad touches
    it, the contact is the point nearest to the ray of what the pad is pressed on, with the normal
    there (decision 0016); the published model has no answer then.

    The contact carries the four-dimensional wrench |f_t| <= mu f_z, |tau_z| <= gamma f_z, with an
    exact friction cone; f_z is at most the closing force. Both jaws must touch.

    Args:
        friction: coefficient mu between pad and part.
        torsion: gamma, torsional limit over normal force [m].
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    torsion: float = TORSION
    name: ClassVar[str] = "point"
    version: ClassVar[str] = "2"
    kernel = staticmethod(judge_point_contacts)

    def __post_init__(self) -> None:
        WrenchSetModel.__post_init__(self)
        positive(self.torsion, "torsion [m]", zero_allowed=True)

    def _contact_size(self, pads: Pads, force: FloatArray) -> float:
        return float(self.torsion)

    def _patches(self, scene: Scene, grasp: Grasp) -> tuple[ContactPatch, ...]:
        return ()
