"""Contact with preload and settling: close, press, balance, settle, lift.

1. *Close.* The jaw that touches first pushes the part over the table until the other touches too.
2. *Press.* Each pad is an elastic foundation, a bed of columns that push with k_w delta along the
   closing axis, pressed on until their sum is the closing force f_C. The jaws travel together and
   the part follows along the closing axis, so that each pad can be pressed on its own.
3. *Balance.* The normal forces are those of the closed jaws, not free. What they leave unbalanced
   must be balanced by friction, an ellipsoidal limit surface for each element of surface.
4. *Settle.* While the part lies on the table it slides and yaws along what friction cannot
   balance, as long as that releases more energy than friction consumes.
5. *Lift.* The weight is added, and the part may still tilt and slide between the pads.

The equations, and what was tried and dropped, are in docs/decisions/0090.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from reach.arrays import FloatArray, IntArray, positive
from reach.contact import REASONS, ContactPatch
from reach.grasp import Grasp
from reach.kernels.compiling import announce_compilation
from reach.kernels.pads import Pads, pads_of
from reach.kernels.settle import FEATURES, MOST_POSES, judge_settling
from reach.kernels.tree import MeshTree, mesh_tree
from reach.models.base import (
    MARGIN_CAP,
    TORQUE_LENGTH,
    BatchInput,
    BatchOutput,
    CompiledModel,
    check_batch,
)
from reach.models.defaults import FRICTION
from reach.models.registry import Scorer
from reach.models.settled_patches import settled_patches
from reach.models.settled_verdict import FATES, REASON_OF, SettledVerdict, Settlement
from reach.scene import Scene
from reach.transforms import inverse

FOUNDATION_STIFFNESS = 0.6e6 / 4e-3
"""k_w [N/m^3]: a silicone layer of Young's modulus 0.6 MPa, 4 mm thick, E / t, as in the pin
world (`reach.world.parameters`)."""
_REASON_CODES = np.array([REASONS.index(reason) for reason in REASON_OF])


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """What the kernel tells of N grasps.

    Attributes:
        margin: shape (N,).
        fate: codes, indices of FATES, shape (N,).
        missing: bit j is set if jaw j has no contact in the end, shape (N,).
        area: of each jaw's patch, shape (N, J) [m^2].
        features: see [FEATURES][reach.kernels.settle.FEATURES], shape (N, FEATURES + J).
        path: T_object_gripper of the last grasp at every step, shape (P, 4, 4), if asked for.
        rest: index in the path of the pose in which the part rests on the table.
    """

    margin: FloatArray
    fate: IntArray
    missing: IntArray
    area: FloatArray
    features: FloatArray
    path: FloatArray
    rest: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SettledContact(CompiledModel):
    """The pads press with full force, and the part may move before it is held.

    Args:
        friction: coefficient mu between pad and part.
        stiffness: k_w of the pads, pressure per depth [N/m^3].
        margin_cap: margins are not sought beyond this many times gravity.

    Raises:
        InvalidInputError: a parameter is negative or not finite.
    """

    friction: float = FRICTION
    stiffness: float = FOUNDATION_STIFFNESS
    margin_cap: float = MARGIN_CAP
    name: ClassVar[str] = "settled"
    version: ClassVar[str] = "5"

    def __post_init__(self) -> None:
        positive(self.friction, "friction", zero_allowed=True)
        positive(self.stiffness, "stiffness [N/m^3]")
        positive(self.margin_cap, "margin_cap")

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""
        return {
            "friction": self.friction,
            "stiffness": self.stiffness,
            "margin_cap": self.margin_cap,
        }

    def evaluate(self, scene: Scene, grasp: Grasp) -> SettledVerdict:
        """Judge one grasp, and tell what the part does."""
        batch = check_batch(
            scene, grasp.T_object_gripper, force=grasp.force, friction=self.friction
        )
        told = self.settle(
            mesh_tree(scene.object), pads_of(scene.gripper, grasp.opening), batch, path=True
        )
        settlement = _settlement(scene, grasp, told)
        missing = int(told.missing[0])
        depths = told.features[0, FEATURES:]
        settled = Grasp(told.path[told.rest], grasp.opening, grasp.force)
        return SettledVerdict(
            bool(told.margin[0] >= 1.0),
            float(told.margin[0]),
            REASON_OF[int(told.fate[0])],
            tuple(jaw for jaw in range(missing.bit_length()) if missing >> jaw & 1),
            lambda: settled_patches(scene, settled, depths),
            settlement,
        )

    def settle(
        self,
        tree: MeshTree,
        pads: Pads,
        batch: BatchInput,
        part: slice = slice(None),
        *,
        path: bool = False,
    ) -> Settled:
        """Run the compiled procedure on a range of a batch.

        Args:
            tree: the part.
            pads: the gripper.
            batch: checked grasps.
            part: which of them.
            path: whether to keep the poses of the last one.
        """
        # The kernel is compiled for writable arrays; grasps carry read-only ones.
        T = np.array(batch.T_object_gripper[part])
        count, jaws = len(T), len(pads.edges)
        poses = np.empty((MOST_POSES if path else 0, 4, 4))
        margin, area = np.zeros(count), np.zeros((count, jaws))
        fate, missing = np.zeros(count, np.int64), np.zeros(count, np.int64)
        features = np.zeros((count, FEATURES + jaws))
        lengths = np.zeros(2, np.int64)
        announce_compilation(judge_settling)
        judge_settling(
            tree,
            pads,
            T,
            np.array(batch.gravity_object[part]),
            np.array(batch.com_object[part]),
            np.array(batch.force[part]),
            np.array(batch.friction[part]),
            float(self.stiffness),
            float(self.margin_cap),
            TORQUE_LENGTH,
            margin,
            fate,
            missing,
            area,
            features,
            poses,
            lengths,
        )
        return Settled(
            margin, fate, missing, area, features, poses[: lengths[1]], int(lengths[0]) - 1
        )

    def _judge(
        self, tree: MeshTree, pads: Pads, batch: BatchInput, part: slice, out: BatchOutput
    ) -> None:
        told = self.settle(tree, pads, batch, part)
        out.margin[part], out.missing[part] = told.margin, told.missing
        out.reason[part], out.area[part] = _REASON_CODES[told.fate], told.area

    def _patches(self, scene: Scene, grasp: Grasp) -> tuple[ContactPatch, ...]:
        return self.evaluate(scene, grasp).patches


def _settlement(scene: Scene, grasp: Grasp, told: Settled) -> Settlement:
    T_world_gripper = scene.T_world_object @ grasp.T_object_gripper
    residual, translation, yaw, preload, area, inside, lift, pushed = told.features[0, :FEATURES]
    return Settlement(
        FATES[int(told.fate[0])],
        float(translation),
        float(yaw),
        T_world_gripper @ inverse(told.path),
        told.rest,
        float(preload),
        float(area),
        float(inside),
        float(lift),
        float(pushed),
        float(residual),
    )


def make_settled(**overrides: Any) -> Scorer:
    """Preload and settling at the planned pose."""
    from reach.models.settled_score import SettledScorer

    return SettledScorer(SettledContact(**overrides))


def make_settled_robust(**overrides: Any) -> Scorer:
    """Preload and settling, graded over perturbed poses."""
    from reach.models.settled_score import settled_robust

    return settled_robust(**overrides)
