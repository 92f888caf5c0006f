"""Elliptical area contacts after [Ciocarlie2007]: one limit surface a patch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reach.kernels.ellipse_contact import judge_ellipse_contacts
from reach.models.wrench_set_model import PatchModel


@dataclass(frozen=True, slots=True, kw_only=True)
class EllipseContact(PatchModel):
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

    name: ClassVar[str] = "ellipse"
    version: ClassVar[str] = "1"
    kernel = staticmethod(judge_ellipse_contacts)
