"""The trial motion: the laboratory's recipe, for any arm and hand."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from collection.clock import Clock
from collection.errors import (
    CollisionStopError,
    GripperNotCalibratedError,
    JointLimitError,
    RobotError,
    UnreachableError,
    UnsafeMotionError,
)
from collection.robots.execution import (
    Execution,
    Phase,
    SensorVerdict,
)
from collection.robots.motion_recorder import EventListener, MotionRecorder, SampleListener
from collection.robots.motion_settings import MotionSettings
from collection.robots.protocol import Arm, GripperDevice, Path, Speed, Waypoint
from collection.robots.waypoints import (
    approach_pose,
    avoidance_pose,
    lift_pose,
    put_down_pose,
    shake_poses,
    trial_waypoints,
)
from reach.arrays import BoolArray, FloatArray, frozen
from reach.transforms import make_transform

RECOVERY_LIFT = 0.050
"""After a collision the arm first clears its path upward [m]."""
NO_WAY_UP = (UnreachableError, JointLimitError, UnsafeMotionError)
"""Before anything moves, the arm finds that it cannot go straight up from where it is."""


def reachable_grasps(
    arm: Arm, T_world_gripper: FloatArray, settings: MotionSettings | None = None
) -> BoolArray:
    """Which grasps (N, 4, 4) the arm reaches, with their approach and lift, shape (N,)."""
    settings = settings or MotionSettings()
    T = np.asarray(T_world_gripper).reshape(-1, 4, 4)
    result = np.ones(len(T), dtype=bool)
    for pose_of in (_grasp_itself, approach_pose, lift_pose):
        open_ = np.flatnonzero(result)
        if len(open_):
            poses = np.array([pose_of(T[n], settings) for n in open_])
            result[open_] = arm.reachable(poses)
    return result


def _grasp_itself(T_world_gripper: FloatArray, settings: MotionSettings) -> FloatArray:
    return T_world_gripper


def can_execute(
    arm: Arm, T_world_gripper: FloatArray, settings: MotionSettings | None = None
) -> bool:
    """Whether a trial's dry run would pass from where the arm is: what an operator wants to know.

    Arguments as for `dry_run`.
    """
    poses = np.asarray(T_world_gripper).reshape(-1, 4, 4)
    within_reach = poses[reachable_grasps(arm, poses, settings)]
    if not len(within_reach):
        return False
    try:
        dry_run(arm, within_reach, settings)
    except RobotError:
        return False
    return True


def dry_run(
    arm: Arm, T_world_gripper: FloatArray, settings: MotionSettings | None = None
) -> FloatArray:
    """Check the whole way of a trial from where the arm is, before anything moves.

    Args:
        arm: connected.
        T_world_gripper: the grasp, shape (4, 4), or grasps that hold alike, shape (K, 4, 4), those
            preferred first.
        settings: distances.

    Returns:
        The first grasp whose way is free, shape (4, 4).

    Raises:
        UnreachableError: some of the way is out of reach.
        UnsafeMotionError: some of it would touch the table or the robot itself.
    """
    failure: RobotError | None = None
    for T in np.asarray(T_world_gripper).reshape(-1, 4, 4):
        try:
            arm.check(trial_waypoints(T, settings or MotionSettings()))
            return frozen(T)
        except (UnreachableError, UnsafeMotionError) as error:
            failure = failure or error
    assert failure is not None, "there is at least one grasp"
    raise failure


def execute_grasp(
    arm: Arm,
    gripper: GripperDevice,
    T_world_gripper: FloatArray,
    clock: Clock,
    *,
    settings: MotionSettings | None = None,
    on_event: EventListener | None = None,
    on_sample: SampleListener | None = None,
) -> Execution:
    """Grasp, lift, hold, put back; dry-run first, and leave the robot stopped if it fails.

    Args:
        arm: connected and ready.
        gripper: connected.
        T_world_gripper: the grasp, shape (4, 4), or grasps that hold alike, shape (K, 4, 4): the
            first one in reach is executed.
        clock: of the station.
        settings: distances, speeds, force.
        on_event: called when a phase begins.
        on_sample: called with every reading.

    Raises:
        RobotError: whatever stopped the motion; arm and hand are then stopped, a held part
            still held.
    """
    recorder = MotionRecorder(clock, gripper, on_event, on_sample)
    finished = False
    try:
        execution = _run(arm, gripper, T_world_gripper, settings or MotionSettings(), recorder)
        finished = True
    finally:
        if not finished:
            make_safe(arm, gripper)
    return execution


def make_safe(arm: Arm, gripper: GripperDevice) -> None:
    """Halt arm and hand, whatever state they are in."""
    for halt in (arm.halt, gripper.halt):
        with suppress(RobotError):  # a lost controller has stopped already, and cannot be told
            halt()


def recover(arm: Arm, gripper: GripperDevice, settings: MotionSettings | None = None) -> None:
    """After a failed motion: clear the error, clear the path upward, open, and go home.

    Raises:
        StoppedError: the operator's stop stands, or was pressed meanwhile; nothing moves on.
        RobotError: if only a person can help (emergency stop, manual mode, lost connection, an
            arm that meets something on its way up).
    """
    settings = settings or MotionSettings()
    arm.clear_error()
    up = make_transform(None, (0, 0, RECOVERY_LIFT)) @ arm.pose()
    with suppress(*NO_WAY_UP):  # at the end of its reach it goes home from where it is
        arm.move_to_pose(up, path=Path.LINEAR, speed=settings.careful())
    arm.clear_error()  # a controller that refused the way stops its program
    _open_calibrated(gripper)
    arm.home(speed=settings.transit())


def _open_calibrated(gripper: GripperDevice) -> None:
    """Open the hand; one that lost its zero is calibrated first, which needs free jaws."""
    if gripper.state().calibrated:
        try:
            gripper.open()
            return
        except GripperNotCalibratedError:
            pass  # it noticed only now
    gripper.calibrate()
    gripper.open()


def _run(
    arm: Arm,
    gripper: GripperDevice,
    T_world_gripper: FloatArray,
    settings: MotionSettings,
    recorder: MotionRecorder,
) -> Execution:
    start_ns = recorder.clock.now_ns()
    with recorder.phase(Phase.CHECK):
        T_world_gripper = dry_run(arm, T_world_gripper, settings)
    waypoints = {each.name: each for each in trial_waypoints(T_world_gripper, settings)}

    def move(name: str, speed: Speed, *, guarded: bool = False) -> None:
        waypoint: Waypoint = waypoints[name]
        arm.move_to_pose(
            waypoint.T_world_gripper,
            path=waypoint.path,
            speed=speed,
            guarded=guarded,
            on_sample=recorder.arm_sample,
        )

    with recorder.phase(Phase.OPEN):
        gripper.open()
    with recorder.phase(Phase.AVOIDANCE):
        move("avoidance", settings.transit())
    with recorder.phase(Phase.APPROACH):
        move("approach", settings.transit())
    with recorder.phase(Phase.DESCEND):
        try:
            move("grasp", settings.careful(), guarded=True)
        except CollisionStopError:
            _accept_touch(arm, T_world_gripper, settings)
    with recorder.phase(Phase.CLOSE):
        T_closed, joints = arm.pose(), arm.joints()
        recorder.arm_rests(joints, T_closed)
        closed = gripper.close(settings.closing_force, on_sample=recorder.gripper_sample)
    with recorder.phase(Phase.LIFT):
        move("lift", settings.lifting())
    with recorder.phase(Phase.HOLD):
        recorder.arm_rests(arm.joints(), arm.pose())
        recorder.watch_hand(settings.hold_time)
    if settings.shake:
        with recorder.phase(Phase.SHAKE):
            _shake(arm, gripper, waypoints["lift"].T_world_gripper, settings, recorder)
    held = gripper.read()
    lifted = held.width > settings.held_width and held.force > settings.held_force
    verdict = SensorVerdict(lifted, closed.width, held.width, held.force)
    put_down_early = _return(arm, gripper, T_world_gripper, settings, recorder, lifted=lifted)
    return Execution(
        T_world_gripper_planned=T_world_gripper,
        T_world_gripper=frozen(T_closed),
        phases=tuple(recorder.phases),
        samples=tuple(recorder.samples),
        sensor_verdict=verdict,
        start_ns=start_ns,
        end_ns=recorder.clock.now_ns(),
        put_down_early=put_down_early,
    )


def _accept_touch(arm: Arm, T_world_gripper: FloatArray, settings: MotionSettings) -> None:
    """A touch at the very end of the approach ends it there: fingertips met the table.

    Raises:
        CollisionStopError: further up, the way was blocked.
    """
    state = arm.state()
    arm.clear_error()
    missing = float(np.linalg.norm(arm.pose()[:3, 3] - T_world_gripper[:3, 3]))
    if missing > settings.touch_distance:
        raise CollisionStopError(
            f"{state.error or 'a contact stopped the approach'}, {missing * 1e3:.1f} mm before"
            " the grasp"
        )


def _shake(
    arm: Arm,
    gripper: GripperDevice,
    T_world_lift: FloatArray,
    settings: MotionSettings,
    recorder: MotionRecorder,
) -> None:
    for T in shake_poses(T_world_lift, gripper.geometry, settings):
        arm.move_to_pose(
            T, path=Path.LINEAR, speed=settings.transit(), on_sample=recorder.arm_sample
        )


def _return(
    arm: Arm,
    gripper: GripperDevice,
    T_world_gripper: FloatArray,
    settings: MotionSettings,
    recorder: MotionRecorder,
    *,
    lifted: bool,
) -> bool:
    """Put a held part down where it was and let go; returns whether it met the table early."""
    met_table = False
    retreat = lift_pose(T_world_gripper, settings)
    with recorder.phase(Phase.RETURN):
        if lifted:
            met_table = _put_down(arm, put_down_pose(T_world_gripper), settings, recorder)
    with recorder.phase(Phase.RELEASE):
        gripper.open(on_sample=recorder.gripper_sample)
    with recorder.phase(Phase.RETREAT):
        if lifted and not met_table:
            retreat = approach_pose(T_world_gripper, settings)
            _rise(arm, retreat, settings.careful(), recorder)
        _rise(arm, avoidance_pose(retreat, settings), settings.transit(), recorder)
    return met_table


def _put_down(arm: Arm, T: FloatArray, settings: MotionSettings, recorder: MotionRecorder) -> bool:
    try:
        arm.move_to_pose(
            T,
            path=Path.LINEAR,
            speed=settings.lifting(),
            guarded=True,
            on_sample=recorder.arm_sample,
        )
    except CollisionStopError:
        arm.clear_error()  # a part that turned or slipped stands on the table: let go here
        return True
    return False


def _rise(arm: Arm, T: FloatArray, speed: Speed, recorder: MotionRecorder) -> None:
    arm.move_to_pose(T, path=Path.LINEAR, speed=speed, on_sample=recorder.arm_sample)
