"""The pin world, stepped by whoever moves the hand: a physical experiment in software."""

from __future__ import annotations

import copy
from typing import Any

import mujoco
import numpy as np

from reach.arrays import FloatArray
from reach.gripper import ParallelJawGripper
from reach.objects import GraspObject
from reach.transforms import quat_wxyz_from_rotation
from reach.world.grasp_model import (
    HAND_DOF,
    HAND_QPOS,
    OBJECT_DOF,
    OBJECT_QPOS,
    GraspModel,
    grasp_model,
)
from reach.world.parameters import WorldParameters

_WRIST_FORCE_ROWS = slice(0, 3)  # the weld is the first equality, its translation comes first


class GraspWorld:
    """One object on a table and one hand, whose wrist follows a target.

    The hand is driven by `T_world_target` (a stiff spring holds the wrist there) and by the jaws'
    force; everything else follows from contact.

    Args:
        obj: the object.
        gripper: the hand.
        T_world_object: where it lies, shape (4, 4).
        T_world_gripper: where the hand starts, jaws open, shape (4, 4).
        parameters: of contact and actuation.
        table_height: world z of the table [m].
    """

    def __init__(
        self,
        obj: GraspObject,
        gripper: ParallelJawGripper,
        T_world_object: FloatArray,
        T_world_gripper: FloatArray,
        parameters: WorldParameters,
        table_height: float = 0.0,
    ) -> None:
        self.object = obj
        self.table_height = table_height
        self._built: GraspModel = grasp_model(obj, gripper, parameters, table_height)
        self._model: Any = copy.copy(self._built.model)
        self._data: Any = mujoco.MjData(self._model)
        self._jaw_force = 0.0
        self._remainder = 0.0
        _put(self._data.qpos[OBJECT_QPOS], T_world_object)
        self.teleport(T_world_gripper)
        mujoco.mj_forward(self._model, self._data)

    @property
    def gripper(self) -> ParallelJawGripper:
        """The hand."""
        return self._built.gripper

    @property
    def T_world_object(self) -> FloatArray:
        """True pose of the object, shape (4, 4)."""
        return _pose(self._data.qpos[OBJECT_QPOS])

    @property
    def T_world_gripper(self) -> FloatArray:
        """True pose of the hand, shape (4, 4)."""
        return _pose(self._data.qpos[HAND_QPOS])

    @property
    def opening(self) -> float:
        """Distance of the pads' undeformed faces [m]; below zero while pad presses on pad."""
        travel = float(self._data.qpos[self._built.finger_qpos].mean())
        return min(self.gripper.max_opening - 2.0 * travel, self.gripper.max_opening)

    def empty_opening(self, force: float) -> float:
        """The opening at which jaws rest that close on nothing with a force [N], [m]."""
        stiffness = self._built.pads_stiffness
        return -force / stiffness if stiffness else 0.0

    @property
    def jaw_speed(self) -> float:
        """Mean speed of the jaws, closing positive [m/s]."""
        return float(self._data.qvel[self._built.finger_dof].mean())

    @property
    def pad_forces(self) -> FloatArray:
        """Normal force on each pad, by the part and by the other pad, shape (J,) [N]."""
        met = self._built.pads_stiffness * max(0.0, -self.opening)
        return np.array([forces.sum() + met for forces in self.pin_forces])

    @property
    def pin_forces(self) -> tuple[FloatArray, ...]:
        """Force of each pin's spring, shape (P,) a jaw [N]; see `reach.world.pads.pin_bed`."""
        springs = zip(self._built.pin_qpos, self._built.pin_stiffness, strict=True)
        return tuple(self._data.qpos[at] * stiffness for at, stiffness in springs)

    @property
    def wrist_force(self) -> float:
        """Magnitude of the force between wrist and arm [N]."""
        return float(np.linalg.norm(self._data.efc_force[_WRIST_FORCE_ROWS]))

    @property
    def clearance(self) -> float:
        """Height of the object's lowest vertex above the table [m]."""
        T = self.T_world_object
        return float((self.object.vertices @ T[2, :3]).min() + T[2, 3] - self.table_height)

    @property
    def energy(self) -> float:
        """Kinetic energy of everything that moves [J]."""
        # mj_energyVel, computed here because the flag that enables it also costs the potential.
        product = np.zeros(self._model.nv)
        mujoco.mj_mulM(self._model, self._data, product, self._data.qvel)
        return 0.5 * float(product @ self._data.qvel)

    @property
    def finite(self) -> bool:
        """Whether the state holds numbers only; the engine resets a world that diverges."""
        diverged = any(warning.number for warning in self._data.warning)
        return bool(np.all(np.isfinite(self._data.qpos))) and not diverged

    def set_pad_friction(self, friction: float) -> None:
        """Change the friction of pads and object from now on (a wet part, a worn pad)."""
        for geoms in self._built.pin_geoms:
            self._model.geom_friction[geoms, 0] = friction

    def set_jaw_force(self, force: float) -> None:
        """Drive each jaw with a force [N], positive closing."""
        self._jaw_force = force

    def lock_jaws_at(self, opening: float) -> None:
        """Put the jaws at an opening [m] at once, where nothing is near them."""
        travel = self.gripper.travel(opening)
        self._data.qpos[self._built.finger_qpos] = travel
        self._data.qvel[self._built.finger_dof] = 0.0

    def teleport(self, T_world_gripper: FloatArray) -> None:
        """Put the hand somewhere at once, at rest, where nothing is near it."""
        _put(self._data.qpos[HAND_QPOS], T_world_gripper)
        self._data.qvel[HAND_DOF] = 0.0
        self.set_target(T_world_gripper)

    def set_target(self, T_world_gripper: FloatArray) -> None:
        """Where the wrist shall go."""
        self._data.mocap_pos[0] = T_world_gripper[:3, 3]
        self._data.mocap_quat[0] = quat_wxyz_from_rotation(T_world_gripper[:3, :3])

    def advance(self, seconds: float) -> None:
        """Let time pass; what is left of a time step is kept for the next call."""
        self._remainder += seconds
        steps = int(self._remainder / self._model.opt.timestep + 1e-9)
        self._remainder -= steps * self._model.opt.timestep
        self._data.ctrl[:] = self._jaw_force
        if steps:
            mujoco.mj_step(self._model, self._data, nstep=steps)

    def at_rest(self, speed: float = 1e-3) -> bool:
        """Whether the object moves slower than a speed [m/s] (and 20 times that in [rad/s])."""
        velocity = self._data.qvel[OBJECT_DOF]
        linear, angular = np.linalg.norm(velocity[:3]), np.linalg.norm(velocity[3:])
        return bool(linear < speed and angular < 20.0 * speed)


def _put(qpos: FloatArray, T: FloatArray) -> None:
    qpos[:3] = T[:3, 3]
    qpos[3:] = quat_wxyz_from_rotation(T[:3, :3])


def _pose(qpos: FloatArray) -> FloatArray:
    rotation, T = np.empty(9), np.eye(4)
    mujoco.mju_quat2Mat(rotation, qpos[3:])
    T[:3, :3] = rotation.reshape(3, 3)
    T[:3, 3] = qpos[:3]
    return T
