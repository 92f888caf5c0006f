"""What all contact models share: the protocol, the checks of their input, and both cores."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from reach.arrays import FloatArray, IntArray, positive
from reach.contact import ContactPatch, Verdict, VerdictBatch, batch_of
from reach.errors import InvalidInputError, InvalidTransformError
from reach.grasp import DEFAULT_CLOSING_FORCE, Grasp
from reach.kernels.pads import Pads, pads_of
from reach.kernels.tree import MeshTree, mesh_tree
from reach.scene import GRAVITY, Scene
from reach.transforms import ORTHONORMAL_TOLERANCE

MARGIN_CAP = 10.0
"""Margins are not sought beyond this many times gravity: what holds ten times the weight holds."""
TORQUE_LENGTH = 0.03
"""Torques are divided by this length [m] to be compared with forces; the verdict does not depend
on it."""
CHUNK = 256
"""Grasps that one thread judges at a time, and between two reports of progress."""


@runtime_checkable
class ContactModel(Protocol):
    """A rule that says whether a grasp resists gravity."""

    @property
    def name(self) -> str:
        """How tables call the model."""
        ...

    @property
    def version(self) -> str:
        """Changes whenever the model's answers may change."""
        ...

    @property
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""
        ...

    def evaluate(self, scene: Scene, grasp: Grasp) -> Verdict:
        """Judge one grasp."""
        ...

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
        """Judge many grasps on the same part."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class BatchInput:
    """Checked input of a batch of N grasps.

    Attributes:
        T_object_gripper: shape (N, 4, 4).
        gravity_object: weights in the object's frame, shape (N, 3) [N].
        com_object: centers of mass, shape (N, 3) [m].
        force: closing forces, shape (N,) [N].
        friction: coefficients, shape (N,).
    """

    T_object_gripper: FloatArray
    gravity_object: FloatArray
    com_object: FloatArray
    force: FloatArray
    friction: FloatArray

    def __len__(self) -> int:
        return len(self.force)


def check_batch(
    scene: Scene,
    T_object_gripper: ArrayLike,
    *,
    force: ArrayLike,
    friction: ArrayLike,
    mass: ArrayLike | None = None,
    com: ArrayLike | None = None,
) -> BatchInput:
    """Check and broadcast a batch's input.

    Raises:
        InvalidTransformError: a grasp pose is not rigid.
        InvalidInputError: a force, friction or mass is negative, zero where it must not be, or
            not finite; or an array has the wrong length.
    """
    T = as_transforms(T_object_gripper)
    count = len(T)
    masses = _per_grasp(scene.object.mass if mass is None else mass, "mass [kg]", count)
    center = _numbers(scene.object.com if com is None else com, "center of mass [m]")
    if center.shape not in ((3,), (1, 3), (count, 3)):
        raise InvalidInputError(
            f"center of mass has shape {center.shape}, expected (3,) or ({count}, 3)"
        )
    if not np.all(np.isfinite(center)):
        raise InvalidInputError(f"center of mass is not finite: {com!r}")
    down_object = scene.T_world_object[:3, :3].T @ GRAVITY
    return BatchInput(
        _writable(T),
        masses[:, None] * down_object,
        _writable(np.broadcast_to(center, (count, 3))),
        _per_grasp(force, "closing force [N]", count),
        _per_grasp(friction, "friction", count, zero_allowed=True),
    )


def _checked_already(scene: Scene, grasp: Grasp, friction: float) -> BatchInput:
    """Return the batch of one grasp: its values were checked when they were made."""
    return BatchInput(
        _writable(grasp.T_object_gripper[None]),
        (scene.object.mass * (scene.T_world_object[:3, :3].T @ GRAVITY))[None],
        _writable(scene.object.com[None]),
        np.array([grasp.force]),
        np.array([friction]),
    )


def _numbers(value: ArrayLike, name: str) -> FloatArray:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} is not numeric: {value!r}") from error


def _writable(array: FloatArray) -> FloatArray:
    """Copy a read-only array: to numba it is of another type, and all would be compiled twice."""
    return np.require(array, requirements=["C", "W"])


def as_transforms(value: ArrayLike) -> FloatArray:
    """Check a stack of rigid transforms (N, 4, 4).

    Raises:
        InvalidTransformError: naming the first that is not rigid.
    """
    T = np.ascontiguousarray(_numbers(value, "T_object_gripper"))
    if T.ndim == 2:
        T = T[None]
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise InvalidTransformError(f"T_object_gripper has shape {T.shape}, expected (N, 4, 4)")
    rotation = T[:, :3, :3]
    off = np.abs(np.swapaxes(rotation, 1, 2) @ rotation - np.eye(3)).max(axis=(1, 2), initial=0.0)
    proper = (off <= ORTHONORMAL_TOLERANCE) & (np.linalg.det(rotation) > 0)
    proper &= np.isfinite(T).all(axis=(1, 2)) & (T[:, 3] == (0, 0, 0, 1)).all(axis=1)
    if not proper.all():
        first = int(np.argmin(proper))
        raise InvalidTransformError(
            f"T_object_gripper[{first}] is not a rigid transform: {T[first].tolist()}"
        )
    return T


def _per_grasp(
    value: ArrayLike, name: str, count: int, *, zero_allowed: bool = False
) -> FloatArray:
    array = _numbers(value, name)
    if array.ndim > 1 or (array.ndim == 1 and len(array) not in (1, count)):
        raise InvalidInputError(f"{name} has shape {array.shape}, expected a number or ({count},)")
    bad = ~np.isfinite(array) | (array < 0) | ((array == 0) & (not zero_allowed))
    if np.any(bad):
        positive(
            float(np.atleast_1d(array)[np.atleast_1d(bad)][0]), name, zero_allowed=zero_allowed
        )
    return _writable(np.broadcast_to(array, (count,)))


@dataclass(frozen=True, slots=True, eq=False)
class BatchOutput:
    """Arrays that a kernel writes: see VerdictBatch."""

    margin: FloatArray
    reason: IntArray
    missing: IntArray
    area: FloatArray


class CompiledModel(ABC):
    """A contact model whose verdicts come from a compiled kernel."""

    name: ClassVar[str]
    version: ClassVar[str]
    friction: float

    @property
    @abstractmethod
    def parameters(self) -> dict[str, float | bool | str]:
        """All that the answers depend on, for the record."""

    @abstractmethod
    def _judge(
        self, tree: MeshTree, pads: Pads, batch: BatchInput, part: slice, out: BatchOutput
    ) -> None:
        """Judge a range of a batch, writing into the output."""

    @abstractmethod
    def _patches(self, scene: Scene, grasp: Grasp) -> tuple[ContactPatch, ...]:
        """Find the patches of one grasp."""

    def evaluate(self, scene: Scene, grasp: Grasp) -> Verdict:
        """Judge one grasp."""
        batch = _checked_already(scene, grasp, self.friction)
        verdicts = self._run(scene, batch, pads_of(scene.gripper, grasp.opening), None)
        return verdicts.verdict(0, lambda: self._patches(scene, grasp))

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
        """Judge many grasps on the same part, on all cores; the result does not depend on them.

        Args:
            scene: part, gripper, and pose of the part, which sets the direction of gravity.
            T_object_gripper: shape (N, 4, 4).
            force: closing force, a number or (N,) [N].
            friction: coefficient, a number or (N,); the model's own if None.
            mass: a number or (N,) [kg]; the part's own if None.
            com: center of mass, (3,) or (N, 3), object frame [m]; the part's own if None.
            opening: distance of the pads before closing, the same for all [m]; fully open if None.
            progress: called with the number of grasps judged so far.

        Raises:
            InvalidTransformError: a pose is not rigid.
            InvalidInputError: an entry is not finite, negative, or of the wrong shape; the opening
                is beyond the gripper's.
        """
        batch = check_batch(
            scene,
            T_object_gripper,
            force=force,
            friction=self.friction if friction is None else friction,
            mass=mass,
            com=com,
        )
        return self._run(scene, batch, pads_of(scene.gripper, opening), progress)

    def _run(
        self,
        scene: Scene,
        batch: BatchInput,
        pads: Pads,
        progress: Callable[[int], None] | None,
    ) -> VerdictBatch:
        count, jaws = len(batch), len(scene.gripper.jaws)
        out = BatchOutput(
            np.zeros(count),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.zeros((count, jaws)),
        )
        tree = mesh_tree(scene.object)
        parts = [slice(i, min(i + CHUNK, count)) for i in range(0, count, CHUNK)]
        self._run_parts(tree, pads, batch, parts, out, progress)
        return batch_of(out.margin, out.reason, out.missing, out.area)

    def _run_parts(
        self,
        tree: MeshTree,
        pads: Pads,
        batch: BatchInput,
        parts: list[slice],
        out: BatchOutput,
        progress: Callable[[int], None] | None,
    ) -> None:
        # The first part runs alone: a kernel is compiled once, by one thread.
        for part in parts[:1]:
            self._judge(tree, pads, batch, part, out)
            if progress:
                progress(part.stop)
        if len(parts) < 2:
            return
        with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
            futures = [pool.submit(self._judge, tree, pads, batch, part, out) for part in parts[1:]]
            for part, future in zip(parts[1:], futures, strict=True):
                future.result()
                if progress:
                    progress(part.stop)


def depths(pads: Pads, force: FloatArray, compliance: float, saturate: bool) -> FloatArray:
    """How deep each pad is pressed in, d_def = kappa f_C, shape (N, J) [m] ([Danielczuk2019] 4.1)."""
    depth = np.repeat(compliance * force[:, None], len(pads.max_deformation), axis=1)
    return np.minimum(depth, pads.max_deformation) if saturate else depth
