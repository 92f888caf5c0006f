"""REACH: the area contact model, compiled ([Danielczuk2019] Sect. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reach.kernels.verdict import judge_area_contacts
from reach.models.wrench_set_model import PatchModel


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaContact(PatchModel):
    """REACH: each pad presses on an area, and every part of that area rubs.

    Args:
        friction: coefficient mu between pad and part.
        compliance: kappa, how deep a pad is pressed in by the closing force [m/N].
        saturate: whether the depth ends at the pad's `max_deformation`.
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    name: ClassVar[str] = "reach"
    version: ClassVar[str] = "1"
    kernel = staticmethod(judge_area_contacts)
