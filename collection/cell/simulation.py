"""The simulated cell that simulated arm, hand and camera share: table, object, physics.

It knows what no trial may know: the object's true pose and the hidden draws. Time passes only
when somebody waits on the clock; then the physics moves along with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from collection.cell.faults import Fault, FaultKind, FaultSchedule
from collection.cell.hidden import HiddenDraws, draw_hidden
from collection.cell.operator import SimulatedVerdict, Watcher
from collection.cell.settings import SimulationSettings
from collection.clock import SimulatedClock
from collection.errors import CollectionError
from reach.arrays import FloatArray, frozen
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import apply, make_transform, rotation_about
from reach.world.grasp_world import GraspWorld

PLACEMENTS_TRIED = 60
SETTLING_TIME = 0.4
PARKED = make_transform(None, (0.0, 0.0, 10.0))
NEAR = 0.01
"""Physics is stepped while the hand's bounding box is this near the object's sphere [m]."""
LOOK_PERIOD = 0.02
"""Between two looks at a held object [s]."""
SLIPPERY = 1e-5
"""Friction of a scripted slip: at 20 N even 0.001 would still carry a part of 4 g."""


class RestingPose(Protocol):
    """A way to rest on a table at z = 0: T_world_object (4, 4), its turn about z arbitrary."""

    @property
    def T_world_object(self) -> FloatArray:
        """Shape (4, 4)."""
        ...


class NothingPlacedError(CollectionError):
    """The simulated table is empty."""


@dataclass(frozen=True, slots=True)
class Workspace:
    """Where objects are placed.

    Args:
        center: world x, y [m].
        size: extents along x and y [m].
        table_height: world z of the table [m].
    """

    center: tuple[float, float]
    size: tuple[float, float]
    table_height: float = 0.0


class Simulation:
    """The physical world of the simulated station.

    Args:
        settings: ranges of the hidden draws, noises, faults.
        gripper: the hand.
        clock: whose time the physics follows.
        workspace: where objects are placed.
        seed: of the hidden draws.
    """

    def __init__(
        self,
        settings: SimulationSettings,
        gripper: ParallelJawGripper,
        clock: SimulatedClock,
        workspace: Workspace,
        seed: int,
    ) -> None:
        self.settings = settings
        self.gripper = gripper
        self.clock = clock
        self.workspace = workspace
        self.seed = seed
        self.attempt = 0
        self.joints: FloatArray | None = None
        self.faults = FaultSchedule(Fault(each.kind, each.attempt) for each in settings.faults)
        self.noise = np.random.default_rng([seed, 0])
        self._draws: dict[str, HiddenDraws] = {}
        self._world: GraspWorld | None = None
        self._watcher: Watcher | None = None
        self._T_world_hand = PARKED
        self._opening = gripper.max_opening
        self._jaw_force = 0.0
        self._empty_jaw_speed = 0.0
        self._T_motion_error = make_transform()
        self._hand_center, self._hand_half = _bounding_box(gripper)
        self._next_look_ns = 0
        self._sphere: tuple[GraspObject, FloatArray, float] | None = None
        clock.follow(self._advance)

    # -- what a person does at the table ------------------------------------------------------

    def place(
        self,
        obj: GraspObject,
        stable_pose: RestingPose,
        rng: np.random.Generator,
        *,
        accept: Callable[[FloatArray], bool] | None = None,
    ) -> None:
        """Put an object down somewhere in the workspace, in a stable pose, turned at random.

        Args:
            obj: the object.
            stable_pose: how it shall rest.
            rng: decides where, and every noise of this attempt.
            accept: asked about T_world_object; a person would not place a part where the
                planned grasp is out of reach. The last placement is taken if none is accepted.
                This draws about one placement in seven anew, docs/decisions/0036.
        """
        self.attempt += 1
        self.noise = np.random.default_rng(rng.integers(2**63))
        T = self._drawn_placement(stable_pose, rng)
        for _ in range(PLACEMENTS_TRIED if accept is not None else 0):
            if accept is None or accept(T):
                break
            T = self._drawn_placement(stable_pose, rng)
        self._world = GraspWorld(
            obj,
            self.gripper,
            T,
            PARKED,
            self.hidden(obj).world,
            self.workspace.table_height,
        )
        self._world.lock_jaws_at(max(0.0, self._opening))
        self._world.advance(SETTLING_TIME)
        self._world.teleport(self._T_world_hand)
        self._watcher = Watcher(self._world)
        self.new_motion_error()

    def remove(self) -> None:
        """Take the object away."""
        self._world = self._watcher = None

    # -- what only the simulation knows --------------------------------------------------------

    @property
    def object(self) -> GraspObject | None:
        """What lies on the table."""
        return self._world.object if self._world else None

    def true_T_world_object(self) -> FloatArray:
        """True pose of the object now, shape (4, 4).

        Raises:
            NothingPlacedError: the table is empty.
        """
        return frozen(self._placed().T_world_object)

    def true_T_world_gripper(self) -> FloatArray:
        """True pose of the hand now, shape (4, 4)."""
        return frozen(self._T_world_hand)

    def verdict(self) -> SimulatedVerdict:
        """What a person would have seen of the present attempt.

        Raises:
            NothingPlacedError: the table is empty.
        """
        self._placed()
        assert self._watcher is not None
        return self._watcher.verdict()

    def hidden(self, obj: GraspObject) -> HiddenDraws:
        """The hidden draws of an object, the same in every session with this seed."""
        if obj.content_hash not in self._draws:
            self._draws[obj.content_hash] = draw_hidden(self.settings, obj, self.gripper, self.seed)
        return self._draws[obj.content_hash]

    # -- what the simulated devices do -----------------------------------------------------------

    def fault_due(self, kind: FaultKind) -> bool:
        """Whether a scripted fault happens now."""
        return self.faults.due(kind, self.attempt)

    def move_hand(self, T_world_gripper: FloatArray) -> None:
        """Send the wrist to where the arm believes the gripper to be."""
        hidden = self.hidden(self._world.object) if self._world else None
        error = hidden.T_gripper_error @ self._T_motion_error if hidden else np.eye(4)
        self._T_world_hand = T_world_gripper @ error
        if self._world is None:
            return
        if self.dynamic:
            self._world.set_target(self._T_world_hand)
        else:
            self._world.teleport(self._T_world_hand)

    def new_motion_error(self) -> None:
        """Draw the arm's repeatability error anew; a lift keeps its approach's."""
        offset = self.noise.normal(0.0, self.settings.repeatability, 3)
        self._T_motion_error = make_transform(None, offset)

    def drive_jaws(self, force: float) -> None:
        """Drive the jaws with a force [N], positive closing, zero to stay."""
        self._jaw_force = force
        if self._world is not None:
            factor = self.hidden(self._world.object).force_factor
            self._world.set_jaw_force(force * factor)

    def make_pads_slip(self) -> None:
        """Take the pads' friction away until the next placement."""
        self._placed().set_pad_friction(SLIPPERY)

    @property
    def dynamic(self) -> bool:
        """Whether the hand is so near the object that physics must be stepped."""
        if self._world is None:
            return False
        if self._jaw_force > 0 or not self._world.at_rest():
            return True
        center, radius = self._bounding_sphere
        in_hand = self._T_world_hand[:3, :3].T @ (center - self._T_world_hand[:3, 3])
        outside = np.maximum(np.abs(in_hand - self._hand_center) - self._hand_half, 0.0)
        return float(outside @ outside) < (radius + NEAR) ** 2

    @property
    def carrying(self) -> bool:
        """Whether the jaws are being pressed together."""
        return self._jaw_force > 0

    @property
    def opening(self) -> float:
        """True distance of the pads' undeformed faces [m]; below zero while pad presses on pad."""
        return self._world.opening if self._world else self._opening

    def empty_opening(self, force: float) -> float:
        """The true opening at which the jaws rest that close on nothing with a force [N], [m]."""
        if self._world is None:
            return 0.0
        return self._world.empty_opening(force * self.hidden(self._world.object).force_factor)

    @property
    def jaw_speed(self) -> float:
        """True speed of a jaw, closing positive [m/s]."""
        return self._world.jaw_speed if self._world else self._empty_jaw_speed

    @property
    def grip_force(self) -> float:
        """True mean force on the pads [N], also where they press on one another."""
        return max(0.0, float(self._world.pad_forces.mean())) if self._world else 0.0

    @property
    def wrist_force(self) -> float:
        """True force between arm and hand [N]."""
        return self._world.wrist_force if self._world and self.dynamic else 0.0

    # -- inside --------------------------------------------------------------------------------

    def _advance(self, seconds: float) -> None:
        if self._world is None:
            self._drift_empty_jaws(seconds)
            return
        if self.dynamic or self._jaw_force != 0.0:
            self._world.advance(seconds)
        if self._watcher is not None and self.clock.now_ns() >= self._next_look_ns:
            self._watcher.look(self.clock.now_ns(), holding=self.carrying)
            self._next_look_ns = self.clock.now_ns() + round(LOOK_PERIOD * 1e9)
        self._opening = self._world.opening

    def _drift_empty_jaws(self, seconds: float) -> None:
        direction = float(np.sign(self._jaw_force))
        moved = self._opening - 2.0 * direction * self.settings.closing_speed * seconds
        before, self._opening = self._opening, float(np.clip(moved, 0.0, self.gripper.max_opening))
        self._empty_jaw_speed = 0.5 * (before - self._opening) / seconds

    @property
    def _bounding_sphere(self) -> tuple[FloatArray, float]:
        """Center, world frame (3,), and radius of a sphere around the object [m]."""
        world = self._placed()
        obj, T = world.object, world.T_world_object
        if self._sphere is None or self._sphere[0] is not obj:
            middle = 0.5 * (obj.vertices.min(axis=0) + obj.vertices.max(axis=0))
            radius = float(np.linalg.norm(obj.vertices - middle, axis=1).max())
            self._sphere = (obj, middle, radius)
        return T[:3, :3] @ self._sphere[1] + T[:3, 3], self._sphere[2]

    def _placed(self) -> GraspWorld:
        if self._world is None:
            raise NothingPlacedError("no object has been placed on the simulated table")
        return self._world

    def _drawn_placement(self, stable_pose: RestingPose, rng: np.random.Generator) -> FloatArray:
        half = 0.5 * np.array(self.workspace.size)
        x, y = np.array(self.workspace.center) + rng.uniform(-half, half)
        turn = rotation_about((0.0, 0.0, 1.0), rng.uniform(-np.pi, np.pi))
        return (
            make_transform(turn, (x, y, self.workspace.table_height)) @ stable_pose.T_world_object
        )


def _bounding_box(gripper: ParallelJawGripper) -> tuple[FloatArray, FloatArray]:
    """Center and half extents (3,) of the open hand's box, gripper frame [m]."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    points = np.concatenate(
        [apply(box.T_gripper_box, corners * box.half_extents) for box in gripper.boxes()]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    return 0.5 * (low + high), 0.5 * (high - low)
