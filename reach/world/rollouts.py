"""Many simulated trials at once: close, lift and hold under perturbed poses and parameters.

The samples are independent and stepped by `mujoco.rollout` on several threads, so that the
outcomes are the same to the last bit whatever the number of threads. After each slice of time
the decided samples leave.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from reach.arrays import BoolArray, FloatArray, IntArray, frozen
from reach.scene import Scene
from reach.transforms import quat_wxyz_from_rotation
from reach.world.grasp_model import HAND_QPOS, OBJECT_DOF, OBJECT_QPOS, GraspModel, grasp_model
from reach.world.parameters import WorldParameters
from reach.world.trajectory import LiftSchedule

SLICE = 0.1
"""Time between two looks at which samples are decided [s]."""
CLEARANCE = 0.050
"""Lowest point above the table that counts as lifted [m]."""
STARTS_INSIDE = 1e-3
"""A hand that starts deeper than this in part or table would have stopped on its way [m]."""
LOST_DISTANCE = 0.03
"""A part that lags this far behind the rising hand has been left behind [m]."""
HELD_SPEED = 1e-3
"""A part that moves slower than this against the hand, high up, is held [m/s]."""
EMPTY_OPENING = 3e-4
"""Jaws that come this close have closed on nothing [m]."""

_SPEC = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL = (
    mujoco.mjtState.mjSTATE_CTRL
    | mujoco.mjtState.mjSTATE_MOCAP_POS
    | mujoco.mjtState.mjSTATE_MOCAP_QUAT
)


class Outcome(IntEnum):
    """How a simulated trial ended."""

    HELD = 0
    DROPPED = 1
    EMPTY = 2
    COLLISION = 3
    DIVERGED = 4


@dataclass(frozen=True, slots=True, eq=False)
class LiftOutcomes:
    """What happened in N trials.

    Args:
        outcome: codes of [Outcome][], shape (N,).
        clearance: of the part's lowest vertex above the table at the end, shape (N,) [m].
        opening: distance of the pads' faces at the end, shape (N,) [m].
        turned: rotation of the part from its pose on the table to the end, shape (N,) [rad].
        simulated: simulated time until the outcome was decided, shape (N,) [s].
    """

    outcome: IntArray
    clearance: FloatArray
    opening: FloatArray
    turned: FloatArray
    simulated: FloatArray

    @property
    def lifted(self) -> BoolArray:
        """Which trials lifted the part, shape (N,)."""
        result: BoolArray = self.outcome == Outcome.HELD
        return result


def simulate_grasps(
    scene: Scene,
    T_object_gripper: FloatArray,
    parameters: WorldParameters | None = None,
    *,
    force: float = 20.0,
    opening: float | None = None,
    friction: FloatArray | None = None,
    mass: FloatArray | None = None,
    schedule: LiftSchedule | None = None,
    threads: int = 2,
) -> LiftOutcomes:
    """Close, lift and hold from each of N hand poses.

    Args:
        scene: part, hand, and the pose the part rests in.
        T_object_gripper: poses of the hand, shape (N, 4, 4).
        parameters: of the world.
        force: closing force of each jaw [N].
        opening: distance of the pads before closing [m]; fully open if None.
        friction: between pads and part of each trial, shape (N,); the parameters' if None.
        mass: of the part in each trial, shape (N,) [kg]; the part's if None.
        schedule: times and distances.
        threads: that share the work; the outcomes do not depend on it.
    """
    parameters = parameters or WorldParameters()
    built = grasp_model(scene.object, scene.gripper, parameters, scene.table_height)
    travel = scene.gripper.travel(opening)
    batch = _Batch(scene, built, (force, travel), schedule or LiftSchedule(), max(1, threads))
    T_world_gripper = scene.T_world_object @ np.asarray(T_object_gripper).reshape(-1, 4, 4)
    return batch.run(T_world_gripper, friction, mass)


class _Batch:
    """One call of `simulate_grasps`."""

    def __init__(
        self,
        scene: Scene,
        built: GraspModel,
        jaws: tuple[float, float],
        schedule: LiftSchedule,
        threads: int,
    ) -> None:
        self._scene = scene
        self._built = built
        self._force, self._travel = jaws
        self._schedule = schedule
        self._model: Any = built.model
        self._data = [mujoco.MjData(self._model) for _ in range(threads)]

    def run(
        self, T_world_gripper: FloatArray, friction: FloatArray | None, mass: FloatArray | None
    ) -> LiftOutcomes:
        n = len(T_world_gripper)
        self._targets = np.array([_as_qpos(T) for T in T_world_gripper])
        states = np.array([self._start(target) for target in self._targets])
        outcome = np.full(n, -1)
        outcome[self._colliding(states)] = Outcome.COLLISION
        simulated = np.zeros(n)
        models = self._models(n, friction, mass)
        steps = round(SLICE / self._model.opt.timestep)
        time = 0.0
        while time < self._schedule.end - 1e-9 and (active := np.flatnonzero(outcome < 0)).size:
            states[active] = self._roll(
                states[active], [models[k] for k in active], active, time, steps
            )
            time += steps * self._model.opt.timestep
            simulated[active] = time
            outcome[active] = self._judged(states[active], active, time)
        return LiftOutcomes(
            frozen(outcome, np.int64),
            frozen([self._clearance(self._qpos(state)) for state in states]),
            frozen([self._opening(self._qpos(state)) for state in states]),
            frozen([self._turned(self._qpos(state)) for state in states]),
            frozen(simulated),
        )

    def _start(self, target: FloatArray) -> FloatArray:
        """Full physics state with the hand at its grasp pose, before closing, all at rest."""
        data = self._data[0]
        mujoco.mj_resetData(self._model, data)
        data.qpos[OBJECT_QPOS] = _as_qpos(self._scene.T_world_object)
        data.qpos[HAND_QPOS] = target
        data.qpos[self._built.finger_qpos] = self._travel
        state = np.empty(mujoco.mj_stateSize(self._model, _SPEC))
        mujoco.mj_getState(self._model, data, state, _SPEC)
        return state

    def _colliding(self, states: FloatArray) -> list[int]:
        """Samples whose hand starts inside the part or the table."""
        hand = set(self._built.hand_geoms) | {g for pins in self._built.pin_geoms for g in pins}
        data, found = self._data[0], []
        for number, state in enumerate(states):
            mujoco.mj_setState(self._model, data, state, _SPEC)
            mujoco.mj_kinematics(self._model, data)
            mujoco.mj_collision(self._model, data)
            contact = data.contact
            touches_hand = [a in hand or b in hand for a, b in contact.geom]
            if np.any(
                np.asarray(contact.dist)[np.array(touches_hand, dtype=bool)] < -STARTS_INSIDE
            ):
                found.append(number)
        return found

    def _models(self, n: int, friction: FloatArray | None, mass: FloatArray | None) -> list[Any]:
        if friction is None and mass is None:
            return [self._model] * n
        models = []
        body = self._model.body("object").id
        for k in range(n):
            model = copy.copy(self._model)
            if friction is not None:
                for pins in self._built.pin_geoms:
                    model.geom_friction[pins, 0] = friction[k]
            if mass is not None:
                factor = mass[k] / model.body_mass[body]
                model.body_mass[body] *= factor
                model.body_inertia[body] *= factor
                mujoco.mj_setConst(model, self._data[0])
            models.append(model)
        return models

    def _roll(
        self, states: FloatArray, models: list[Any], active: IntArray, time: float, steps: int
    ) -> FloatArray:
        """Advance some samples by one slice; returns their states after it."""
        times = time + self._model.opt.timestep * np.arange(1, steps + 1)
        control = np.empty((len(active), steps, self._model.nu + 7))
        control[:, :, : self._model.nu] = self._force
        control[:, :, self._model.nu :] = self._targets[active, None, :]
        control[:, :, self._model.nu + 2] += self._schedule.rise(times)
        after, _ = rollout.rollout(
            models, self._data, states, control, control_spec=int(_CONTROL), nstep=steps
        )
        final: FloatArray = after[:, -1]
        return final

    def _judged(self, states: FloatArray, active: IntArray, time: float) -> IntArray:
        """Outcome codes of samples that are decided, -1 of those that are not."""
        codes = np.full(len(active), -1)
        over = time >= self._schedule.end - 1e-9
        for row, state in enumerate(states):
            codes[row] = self._judge(state, self._targets[active[row]], time, over=over)
        return codes

    def _judge(self, state: FloatArray, target: FloatArray, time: float, *, over: bool) -> int:
        qpos = self._qpos(state)
        if not np.all(np.isfinite(qpos)) or abs(state[0] - time) > 0.5 * SLICE:
            return Outcome.DIVERGED  # the engine resets time and state of what diverges
        if self._closed_on_nothing(qpos):
            return Outcome.EMPTY
        if time <= self._schedule.close_time + 1e-9:
            return -1
        clearance = self._clearance(qpos)
        rise = float(qpos[HAND_QPOS][2] - target[2])
        if clearance < rise - LOST_DISTANCE and clearance < 1e-3:
            return Outcome.DROPPED
        lifted = clearance >= CLEARANCE
        at_top = time >= self._schedule.close_time + self._schedule.lift_time + SLICE - 1e-9
        if at_top and lifted and self._speed(state) < HELD_SPEED:
            return Outcome.HELD
        if over:
            return Outcome.HELD if lifted else Outcome.DROPPED
        return -1

    def _qpos(self, state: FloatArray) -> FloatArray:
        return state[1 : 1 + self._model.nq]

    def _speed(self, state: FloatArray) -> float:
        qvel = state[1 + self._model.nq : 1 + self._model.nq + self._model.nv]
        return float(np.linalg.norm(qvel[OBJECT_DOF][:3]))

    def _clearance(self, qpos: FloatArray) -> float:
        z_axis = _rotation(qpos[OBJECT_QPOS][3:])[2]
        lowest = float((self._scene.object.vertices @ z_axis).min())
        return lowest + float(qpos[OBJECT_QPOS][2]) - self._scene.table_height

    def _opening(self, qpos: FloatArray) -> float:
        travel = float(qpos[self._built.finger_qpos].mean())
        return max(0.0, self._built.gripper.max_opening - 2.0 * travel)

    def _closed_on_nothing(self, qpos: FloatArray) -> bool:
        pressed = max(float(np.abs(qpos[pins]).max()) for pins in self._built.pin_qpos)
        return self._opening(qpos) < EMPTY_OPENING and pressed < EMPTY_OPENING

    def _turned(self, qpos: FloatArray) -> float:
        now, before = _rotation(qpos[OBJECT_QPOS][3:]), self._scene.T_world_object[:3, :3]
        cosine = 0.5 * (float(np.sum(now * before)) - 1.0)
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _as_qpos(T: FloatArray) -> FloatArray:
    return np.concatenate([T[:3, 3], quat_wxyz_from_rotation(T[:3, :3])])


def _rotation(quat_wxyz: FloatArray) -> FloatArray:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quat_wxyz, dtype=float))
    return matrix.reshape(3, 3)
