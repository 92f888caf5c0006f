"""What the models share that ask whether the contacts can apply the wrench that gravity demands."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import ClassVar

from reach.arrays import FloatArray, positive
from reach.contact import ContactPatch
from reach.grasp import Grasp
from reach.kernels.compiling import announce_compilation
from reach.kernels.pads import Pads
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
class WrenchSetModel(CompiledModel):
    """A model whose verdict is whether -w lies in Lambda ([Danielczuk2019] Sect. 4.2).

    Args:
        friction: coefficient mu between pad and part.
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    friction: float = FRICTION
    margin_cap: float = MARGIN_CAP
    kernel: ClassVar[Callable[..., None]]

    def __post_init__(self) -> None:
        positive(self.friction, "friction", zero_allowed=True)
        positive(self.margin_cap, "margin_cap")

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @abstractmethod
    def _contact_size(self, pads: Pads, force: FloatArray) -> FloatArray | float:
        """What the kernel is told of a contact's size: depths (N, J) [m], or a length [m]."""

    def _judge(
        self, tree: MeshTree, pads: Pads, batch: BatchInput, part: slice, out: BatchOutput
    ) -> None:
        announce_compilation(self.kernel)
        self.kernel(
            tree,
            pads,
            batch.T_object_gripper[part],
            batch.gravity_object[part],
            batch.com_object[part],
            self._contact_size(pads, batch.force[part]),
            batch.force[part],
            batch.friction[part],
            float(self.margin_cap),
            TORQUE_LENGTH,
            out.margin[part],
            out.reason[part],
            out.missing[part],
            out.area[part],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchModel(WrenchSetModel):
    """A model of pads that the closing force presses in, so that they touch on areas (Sect. 4.1).

    Args:
        friction: coefficient mu between pad and part.
        compliance: kappa, how deep a pad is pressed in by the closing force [m/N].
        saturate: whether the depth ends at the pad's `max_deformation`.
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    compliance: float = COMPLIANCE
    saturate: bool = True

    def __post_init__(self) -> None:
        WrenchSetModel.__post_init__(self)
        positive(self.compliance, "compliance [m/N]")

    def _contact_size(self, pads: Pads, force: FloatArray) -> FloatArray:
        return depths(pads, force, self.compliance, self.saturate)

    def _patches(self, scene: Scene, grasp: Grasp) -> tuple[ContactPatch, ...]:
        return compiled_patches(scene, grasp, self.compliance, self.saturate)
