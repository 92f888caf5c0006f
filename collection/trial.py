"""One trial, from the placed object to the closed record: [Danielczuk2019] Sect. 5.

    place -> capture -> register -> execute -> record

Label and scores come later, as events that point at the record. A fault in seeing or moving
raises, and the session voids the take; it is never a failed grasp.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from collection import record_mapping as mapping
from collection.errors import PlacementError, UnreachableError, UnsafeMotionError
from collection.placement import well_placed
from collection.robots.execution import Execution
from collection.robots.half_turn import held_alike
from collection.robots.motion import execute_grasp
from collection.trial_watch import TrialWatch
from collection.truth import registration_error, true_outcome
from logs.journal.events import Phase, SensorVerdict
from logs.record.descriptions import STATION_FILE, gripper_attachment, robot_attachment
from logs.record.mesh_attachment import mesh_attachment
from logs.record.recorder import TrialRecorder
from logs.record.records import AttachmentRecord, ExitStatus
from reach.arrays import FloatArray
from registration import register
from registration.result import Registration

if TYPE_CHECKING:
    from collection.plan.records import Plan, PlannedGrasp, PlannedPose, PlannedTrial
    from collection.robots.protocol import Arm
    from collection.station.station import Station
    from labeling.control.take import Take
    from reach.objects import GraspObject
    from registration.frame import DepthFrame


class OverlayListener(Protocol):
    """Is shown where the object was found; must not take the trial's time."""

    def __call__(
        self, trial_id: str, take: int, obj: GraspObject, frame: DepthFrame, found: Registration
    ) -> None:
        """Keep what is needed to draw it."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class TrialContext:
    """What all trials of a session share.

    Args:
        session_id: of the session.
        session_path: its folder.
        seed: of the session.
        station: connected devices.
        plan: of the session.
        objects: by name.
        versions: of the software.
        offer_overlay: given each registration, for the operator's eyes.
    """

    session_id: str
    session_path: Path
    seed: int
    station: Station
    plan: Plan
    objects: Mapping[str, GraspObject]
    versions: Mapping[str, str]
    offer_overlay: OverlayListener | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Attempt:
    """One take: what is tried, on what, and everything random in it."""

    context: TrialContext
    take: Take
    trial: PlannedTrial
    grasp: PlannedGrasp
    pose: PlannedPose
    obj: GraspObject
    seed: int

    @property
    def station(self) -> Station:
        return self.context.station

    def grasps_held_alike(self, T_world_object: FloatArray) -> FloatArray:
        """The planned grasp on the object, and as half a turn of the hand gives it (K, 4, 4)."""
        T_world_gripper = T_world_object @ self.grasp.T_object_gripper
        return held_alike(self.station.gripper.geometry, T_world_gripper)


def run_take(context: TrialContext, take: Take, folder: Path) -> None:
    """Run one take of a trial up to its closed record; afterwards a label is due.

    Args:
        context: of the session.
        take: the take, just begun.
        folder: where its record goes.

    Raises:
        RegistrationError: the image does not tell where the object is.
        PlacementError: the object lies otherwise than planned, or out of reach.
        DeviceError: a camera or the robot did not do what it was told.
        TakeEndedError: the operator ended the take.
        SessionEndingError: the session is to end.
    """
    attempt = _attempt(context, take)
    _place(attempt)
    with TrialRecorder(folder, now=context.station.clock.now_ns) as recorder:
        try:
            _start(attempt, recorder)
            frame = _capture(attempt, recorder)
            T_world_object = _register(attempt, frame, recorder)
            execution = _execute(attempt, T_world_object, recorder)
        except Exception as error:
            recorder.stop(ExitStatus.FAIL, f"{type(error).__name__}: {error}")
            raise
        record = recorder.stop(ExitStatus.SUCCESS)
    take.record_executed(
        str(record.relative_to(context.session_path)), _sensor_verdict(attempt, execution)
    )


def take_seed(session_seed: int, trial_id: str, take: int) -> int:
    """Seed of everything random in a take."""
    digest = hashlib.sha256(f"{session_seed}/{trial_id}/{take}".encode()).digest()
    return int.from_bytes(digest[:6], "big")


def _attempt(context: TrialContext, take: Take) -> _Attempt:
    trial = next(t for t in context.plan.trials if t.trial_id == take.trial_id)
    grasp = context.plan.grasp(trial.grasp_id)
    return _Attempt(
        context,
        take,
        trial,
        grasp,
        context.plan.pose_of(grasp),
        context.objects[trial.object_name],
        take_seed(context.seed, trial.trial_id, take.number),
    )


def _place(attempt: _Attempt) -> None:
    """Wait for the operator; where the table is simulated, the object appears on it now."""
    attempt.take.wait_placed()
    simulation = attempt.station.simulation
    if simulation is None:
        return

    def accept(T_world_object: FloatArray) -> bool:
        return well_placed(attempt.station, attempt.grasps_held_alike, T_world_object)

    rng = np.random.default_rng(attempt.seed)
    simulation.place(attempt.obj, attempt.pose, rng, accept=accept)


def _wake(arm: Arm) -> None:
    """Let an arm follow again that was stopped, and released, before this take moved anything.

    Nothing had moved, so there is nothing to recover from. Motors that are off stay off.
    """
    state = arm.state()
    if state.connected and state.motors_on and state.automatic and not state.ready:
        arm.clear_error()


def _start(attempt: _Attempt, recorder: TrialRecorder) -> None:
    context, station = attempt.context, attempt.station
    gripper = station.gripper.geometry
    descriptor = mapping.trial_descriptor(
        attempt.trial,
        attempt.grasp,
        attempt.pose,
        attempt.obj,
        gripper_name=gripper.name,
        session_id=context.session_id,
        take=attempt.take.number,
        seed=attempt.seed,
        simulated=station.simulation is not None,
        time_ns=station.clock.now_ns(),
        versions=context.versions,
    )
    recorder.start(
        descriptor,
        [
            mesh_attachment(attempt.obj),
            gripper_attachment(gripper),
            robot_attachment(mapping.robot_description(station.arm.description)),
            AttachmentRecord(STATION_FILE, "application/toml", station.text.encode()),
        ],
    )


def _capture(attempt: _Attempt, recorder: TrialRecorder) -> DepthFrame:
    attempt.take.advance(Phase.CAPTURE)
    recorder.phase("capture")
    frame = attempt.station.camera.capture()
    recorder.camera(mapping.camera_record(frame), frame.time_ns)
    recorder.depth(mapping.depth_image(frame))
    if frame.color is not None:
        recorder.color(frame.time_ns, frame.color, camera=mapping.DEPTH_CAMERA)
    return frame


def _register(attempt: _Attempt, frame: DepthFrame, recorder: TrialRecorder) -> FloatArray:
    """Find the object; ask the operator where the image leaves a doubt that matters."""
    attempt.take.advance(Phase.REGISTER)
    recorder.phase("register")
    found = register(attempt.obj, frame, stable_pose=attempt.pose.index, seed=attempt.seed)
    offer = attempt.context.offer_overlay
    if offer is not None:
        offer(attempt.take.trial_id, attempt.take.number, attempt.obj, frame, found)
    if found.contradicts_declared:
        recorder.registration(mapping.registration_record(found, frame.time_ns))
        raise PlacementError(
            f"{attempt.obj.name} lies in stable pose {found.stable_pose},"
            f" planned is pose {attempt.pose.index}: put it down again"
        )
    T_world_object = found.T_world_object
    planned = attempt.grasp.T_object_gripper
    if found.ambiguous and not found.same_grasp_outcome(attempt.obj, planned):
        T_world_object = _ask(attempt, found, recorder)
    recorder.registration(mapping.registration_record(found, frame.time_ns, T_world_object))
    attempt.take.show({"registration": _quality(found)})
    return T_world_object


def _quality(found: Registration) -> dict[str, Any]:
    """What the operator's page tells about a registration."""
    return {
        "render_cost": found.render_cost,
        "margin": found.margin,
        "fitness": found.fitness,
        "rmse_mm": found.rmse * 1e3,
        "ambiguous": found.ambiguous,
        "not_seen": list(found.unobservable),
    }


def _ask(attempt: _Attempt, found: Registration, recorder: TrialRecorder) -> FloatArray:
    recorder.registration(mapping.registration_record(found, attempt.station.clock.now_ns()))
    rivals = [rival for rival in found.rivals if not rival.ruled_out]
    poses = [found.T_world_object, *(rival.T_world_object for rival in rivals)]
    chosen = attempt.take.confirm_pose(
        {
            "registration": _quality(found),
            "poses": [pose.tolist() for pose in poses],
            "rivals": [
                {"render_cost": rival.render_cost, "stable_pose": rival.stable_pose}
                for rival in rivals
            ],
        }
    )
    if chosen is None:
        raise PlacementError("the operator refused every pose: put the object down again")
    return poses[chosen]


def _execute(attempt: _Attempt, T_world_object: FloatArray, recorder: TrialRecorder) -> Execution:
    """Carry the planned grasp over to the registered pose, and try it as the arm reaches it."""
    station = attempt.station
    true_errors = _true_errors(attempt, T_world_object)
    attempt.take.advance(Phase.EXECUTE)
    _wake(station.arm)
    watch = TrialWatch(station, recorder)
    try:
        execution = execute_grasp(
            station.arm,
            station.gripper,
            attempt.grasps_held_alike(T_world_object),
            station.clock,
            settings=station.config.motion,
            on_event=watch.phase,
            on_sample=watch.sample,
        )
    except (UnreachableError, UnsafeMotionError) as error:
        raise PlacementError(f"out of reach where it lies: put it down again ({error})") from error
    recorder.execution(
        mapping.execution_record(execution, T_world_object, attempt.grasp, true_errors)
    )
    return execution


def _true_errors(attempt: _Attempt, T_world_object: FloatArray) -> dict[str, float]:
    """How far registration was off; for statistics, no step of the trial sees it."""
    simulation = attempt.station.simulation
    if simulation is None:
        return {}
    return registration_error(attempt.obj, simulation.true_T_world_object(), T_world_object)


def _sensor_verdict(attempt: _Attempt, execution: Execution) -> SensorVerdict:
    simulation, seen = attempt.station.simulation, execution.sensor_verdict
    truth = None if simulation is None else true_outcome(simulation.verdict())
    return SensorVerdict(lifted=seen.lifted, jaw_width=seen.width_held, truth=truth)
