"""What a contact model answers: a verdict with its margin, its reason, and the contact patches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np

from reach.arrays import BoolArray, FloatArray, IntArray, frozen


class Reason(StrEnum):
    """Why a grasp resists gravity or does not."""

    HOLDS = "holds"
    NO_CONTACT = "no contact"
    SLIPS = "slips"
    TORQUE = "torque"


REASONS = (Reason.HOLDS, Reason.NO_CONTACT, Reason.SLIPS, Reason.TORQUE)
"""Reasons in the order of the kernels' codes."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactPatch:
    """Where one pad presses on the part, and how hard; object frame.

    Attributes:
        jaw: index of the jaw.
        triangles_object: the patch, shape (M, 3, 3) [m].
        pressures: at the triangles' corners, shape (M, 3) [Pa].
        area: of the patch [m^2].
        center_object: center of pressure, shape (3,) [m].
        normal_object: mean inward normal, unit, shape (3,).
        force_object: resultant of the pressure on the part, shape (3,) [N].
        torque_object: its torque about the center of mass, shape (3,) [N m].
        T_object_pad: pose of the pad's frame at first contact, shape (4, 4).
    """

    jaw: int
    triangles_object: FloatArray
    pressures: FloatArray
    area: float
    center_object: FloatArray
    normal_object: FloatArray
    force_object: FloatArray
    torque_object: FloatArray
    T_object_pad: FloatArray


def _no_patches() -> tuple[ContactPatch, ...]:
    return ()


@dataclass(frozen=True, eq=False)
class Verdict:
    """Whether a grasp resists gravity on the lifted part.

    Attributes:
        resists: the answer.
        margin: how many times gravity the grasp can hold, capped by the model; 0 without contact.
        reason: why.
        missing_jaws: jaws that have no contact.
    """

    resists: bool
    margin: float
    reason: Reason
    missing_jaws: tuple[int, ...] = ()
    find_patches: Callable[[], tuple[ContactPatch, ...]] = field(default=_no_patches, repr=False)

    @cached_property
    def patches(self) -> tuple[ContactPatch, ...]:
        """The contact patches of the jaws that touch, found when first asked for."""
        return self.find_patches()

    @property
    def explanation(self) -> str:
        """One sentence for a person."""
        if self.reason is Reason.HOLDS:
            return f"holds {self.margin:.3g} times gravity"
        if self.reason is Reason.NO_CONTACT:
            return f"no contact on {_listed(self.missing_jaws)}"
        what = "slips: friction carries" if self.reason is Reason.SLIPS else "turns: carries"
        return f"{what} {self.margin:.3g} of the part's weight"


def _listed(jaws: tuple[int, ...]) -> str:
    return ("jaw " if len(jaws) == 1 else "jaws ") + " and ".join(map(str, jaws))


@dataclass(frozen=True, slots=True, eq=False)
class VerdictBatch:
    """Verdicts on N grasps.

    Attributes:
        resists: shape (N,).
        margin: shape (N,).
        reason: codes, indices of REASONS, shape (N,).
        missing: bit j is set if jaw j has no contact, shape (N,).
        area: of each jaw's patch, shape (N, J) [m^2]; zero for models without patches.
    """

    resists: BoolArray
    margin: FloatArray
    reason: IntArray
    missing: IntArray
    area: FloatArray

    def __len__(self) -> int:
        return len(self.resists)

    def reasons(self) -> tuple[Reason, ...]:
        """The reason of every grasp."""
        return tuple(REASONS[code] for code in self.reason)

    def counts(self) -> dict[str, int]:
        """How many grasps have each reason."""
        counted = np.bincount(self.reason, minlength=len(REASONS))
        return {str(reason): int(n) for reason, n in zip(REASONS, counted, strict=True)}

    def verdict(
        self, index: int, find_patches: Callable[[], tuple[ContactPatch, ...]] = _no_patches
    ) -> Verdict:
        """The verdict on one grasp."""
        missing = int(self.missing[index])
        jaws = tuple(jaw for jaw in range(missing.bit_length()) if missing >> jaw & 1)
        return Verdict(
            bool(self.resists[index]),
            float(self.margin[index]),
            REASONS[int(self.reason[index])],
            jaws,
            find_patches,
        )


def batch_of(
    margin: FloatArray, reason: IntArray, missing: IntArray, area: FloatArray
) -> VerdictBatch:
    """Build a batch from what the kernels wrote."""
    return VerdictBatch(
        frozen(margin >= 1.0, bool),
        frozen(margin),
        frozen(reason, np.int64),
        frozen(missing, np.int64),
        frozen(area),
    )
