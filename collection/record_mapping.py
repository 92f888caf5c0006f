"""What registration and the robot return, as the record's own types.

Records know neither registration nor robots; this is the one place that knows both.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collection.plan.records import PlannedGrasp, PlannedPose, PlannedTrial
from collection.robots.description import RobotDescription, Shape
from collection.robots.execution import Execution, Phase
from logs.record import descriptions
from logs.record.records import ExecutionRecord, RegistrationRecord, RivalRecord, TrialDescriptor
from logs.record.streams import CameraRecord, DepthImage
from reach.arrays import FloatArray
from reach.grasp import Grasp
from reach.objects import GraspObject
from reach.transforms import inverse
from registration.frame import DepthFrame
from registration.result import Registration

DEPTH_CAMERA = "depth"


def trial_descriptor(
    trial: PlannedTrial,
    grasp: PlannedGrasp,
    pose: PlannedPose,
    obj: GraspObject,
    *,
    gripper_name: str,
    session_id: str,
    take: int,
    seed: int,
    simulated: bool,
    time_ns: int,
    versions: Mapping[str, str],
) -> TrialDescriptor:
    """Which trial a record is of, and what is tried."""
    return TrialDescriptor(
        trial_id=trial.trial_id,
        session_id=session_id,
        number=trial.number,
        object_name=obj.name,
        object_hash=obj.content_hash,
        object_mass=obj.mass,
        center_of_mass=obj.com,
        stable_pose=pose.index,
        T_world_object=pose.T_world_object,
        planned=Grasp(grasp.T_object_gripper),
        gripper_name=gripper_name,
        grasp_id=grasp.grasp_id,
        repeat=trial.repeat,
        take=take,
        seed=seed,
        simulated=simulated,
        time_ns=time_ns,
        versions=versions,
    )


def camera_record(frame: DepthFrame) -> CameraRecord:
    """The depth camera's calibration."""
    camera = frame.intrinsics
    return CameraRecord(
        DEPTH_CAMERA,
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        frame.T_world_camera,
        frame.sensor,
    )


def depth_image(frame: DepthFrame) -> DepthImage:
    """The depth image, bit for bit."""
    return DepthImage(frame.time_ns, frame.depth, DEPTH_CAMERA)


def registration_record(
    found: Registration, time_ns: int, T_world_object: FloatArray | None = None
) -> RegistrationRecord:
    """Where the object was found.

    Args:
        found: what registration returned.
        time_ns: of the image [ns].
        T_world_object: the rival that the operator chose instead, shape (4, 4).
    """
    T_world_camera = found.T_world_object @ inverse(found.T_camera_object)
    chosen = found.T_world_object if T_world_object is None else T_world_object
    return RegistrationRecord(
        time_ns=time_ns,
        T_world_object=chosen,
        T_camera_object=inverse(T_world_camera) @ chosen,
        covariance=found.covariance,
        stable_pose=found.stable_pose,
        ambiguous=found.ambiguous,
        contradicts_declared=found.contradicts_declared,
        quality={
            "fitness": found.fitness,
            "rmse": found.rmse,
            "observed_overlap": found.observed_overlap,
            "model_overlap": found.model_overlap,
            "free_space_violation": found.free_space_violation,
            "unexplained": found.unexplained,
            "render_cost": found.render_cost,
            "margin": found.margin,
            "tilt": found.tilt,
            "table_tilt": found.table.tilt,
            "table_rms": found.table.rms,
        },
        rivals=tuple(
            RivalRecord(rival.T_world_object, rival.stable_pose, rival.render_cost)
            for rival in found.rivals
        ),
        unobservable=found.unobservable,
        seed=found.seed,
        seconds=found.timings,
    )


def execution_record(
    execution: Execution,
    T_world_object: FloatArray,
    planned: PlannedGrasp,
    measured: Mapping[str, float],
) -> ExecutionRecord:
    """What the robot really did.

    Args:
        execution: as the motion returned it.
        T_world_object: the registered pose the grasp was planned upon, shape (4, 4).
        planned: the grasp that was asked for.
        measured: further numbers by name.
    """
    verdict = execution.sensor_verdict
    as_planned = np.allclose(
        execution.T_world_gripper_planned, T_world_object @ planned.T_object_gripper
    )
    return ExecutionRecord(
        time_ns=next(s.start_ns for s in execution.phases if s.phase is Phase.CLOSE),
        T_world_gripper_commanded=execution.T_world_gripper_planned,
        T_world_gripper=execution.T_world_gripper,
        executed=Grasp(inverse(T_world_object) @ execution.T_world_gripper),
        sensor_verdict="held" if verdict.lifted else "empty",
        measurements={
            "width": verdict.width_held,
            "width_closed": verdict.width_closed,
            "force": verdict.force_held,
            **measured,
        },
        details={
            "put_down_early": str(execution.put_down_early).lower(),
            "half_turn": str(not as_planned).lower(),
        },
    )


def robot_description(robot: RobotDescription) -> descriptions.RobotDescription:
    """The robot's shapes, by link."""
    links: dict[str, list[descriptions.Shape]] = {}
    for shape in robot.shapes:
        links.setdefault(shape.link, []).append(_shape(shape))
    return descriptions.RobotDescription(
        links=tuple(
            descriptions.Link(name=name, shapes=tuple(shapes)) for name, shapes in links.items()
        )
    )


def _shape(shape: Shape) -> descriptions.Shape:
    # The arm gives half lengths, the record full ones.
    if shape.kind == "box":
        size = tuple(2 * half for half in shape.size)
    else:
        size = (shape.size[0], *(2 * half for half in shape.size[1:]))
    rows = tuple(tuple(row) for row in shape.T_link_shape.tolist())
    return descriptions.Shape.model_validate(
        {"type": shape.kind, "size": size, "T_link_shape": rows, "rgba": shape.rgba}
    )
