"""The pin world's MuJoCo model: table, object, and a hand whose pads are sprung pins.

Findings behind the numbers: a pad must be a discretized area (one box or mesh contact ranks
grasps badly); contacts need a stiff reference of their own, because MuJoCo's default softness
scales with the effective mass and lets pads sink millimeters into a part of 3 g; the springs
need the implicit `discrete` integrator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from reach.arrays import FloatArray, IntArray, frozen
from reach.gripper import Box, Jaw, ParallelJawGripper
from reach.objects import GraspObject
from reach.scene import GRAVITY
from reach.transforms import quat_wxyz_from_rotation
from reach.world.decomposition import convex_parts
from reach.world.pads import pin_bed
from reach.world.parameters import WorldParameters

CONTACT_SOLREF = (0.004, 1.0)
CONTACT_SOLIMP = (0.9, 0.95, 0.001, 0.5, 2.0)
WRIST_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
"""A softer weld lets the hand swing about its target for a second after each motion."""
PIN_MASS = 2e-3
PIN_DAMPING_TIME = 5e-3  # damping = this times stiffness [s]

# Bits of the collision masks: a geom collides where its type meets another's affinity.
_OBJECT, _TABLE = 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class GraspModel:
    """The compiled model, and where its parts are.

    Args:
        model: the MuJoCo model; copy it before changing it.
        gripper: the hand.
        parameters: of the world.
        object_geoms: geom numbers.
        table_geom: geom number.
        hand_geoms: geom numbers of palm and finger solids.
        pin_geoms: geom numbers of each jaw's pins.
        pin_qpos: positions in qpos of each jaw's pins.
        pin_stiffness: of each jaw's pins [N/m].
        pads_stiffness: force of each jaw by how far two pads have pressed into one another [N/m];
            zero for a hand without two facing pads.
        finger_qpos: positions in qpos of the jaws' travels.
        finger_dof: positions in qvel of the jaws' travels.
    """

    model: Any
    gripper: ParallelJawGripper
    parameters: WorldParameters
    object_geoms: IntArray
    table_geom: int
    hand_geoms: IntArray
    pin_geoms: tuple[IntArray, ...]
    pin_qpos: tuple[IntArray, ...]
    pin_stiffness: tuple[FloatArray, ...]
    pads_stiffness: float
    finger_qpos: IntArray
    finger_dof: IntArray


OBJECT_QPOS = slice(0, 7)
OBJECT_DOF = slice(0, 6)
HAND_QPOS = slice(7, 14)
HAND_DOF = slice(6, 12)


def grasp_model(
    obj: GraspObject,
    gripper: ParallelJawGripper,
    parameters: WorldParameters,
    table_height: float = 0.0,
) -> GraspModel:
    """Build and compile the world of one object and one gripper."""
    spec = mujoco.MjSpec()
    spec.compiler.autolimits = True
    _set_options(spec, parameters)
    _add_table(spec, table_height, parameters)
    _add_object(spec, obj, parameters)
    _add_hand(spec, gripper, parameters)
    model = spec.compile()
    return _indexed(model, gripper, parameters)


def _set_options(spec: Any, parameters: WorldParameters) -> None:
    option = spec.option
    option.timestep = parameters.timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 100.0
    option.gravity = GRAVITY


def _add_table(spec: Any, height: float, parameters: WorldParameters) -> None:
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.5, 0.5, 0.1],
        pos=[0, 0, height],
        contype=_TABLE,
        conaffinity=_OBJECT,
        friction=[parameters.table_friction, 5e-3, 1e-4],
        solref=CONTACT_SOLREF,
        rgba=[0.55, 0.47, 0.4, 1],
    )


def _add_object(spec: Any, obj: GraspObject, parameters: WorldParameters) -> None:
    body = spec.worldbody.add_body(name="object", explicitinertial=True)
    body.mass = obj.mass
    body.ipos = obj.com
    inertia = np.asarray(obj.mesh.moment_inertia) * (obj.mass / obj.volume)
    body.fullinertia = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    body.add_freejoint(name="object")
    for number, (vertices, faces) in enumerate(convex_parts(obj)):
        mesh = spec.add_mesh(name=f"part{number}")
        mesh.uservert = vertices.ravel()
        mesh.userface = faces.ravel().astype(np.int32)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        body.add_geom(
            name=f"part{number}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"part{number}",
            contype=_OBJECT,
            conaffinity=0,
            friction=[parameters.table_friction, 5e-3, 1e-4],
            solref=CONTACT_SOLREF,
            rgba=[0.93, 0.45, 0.18, 1],
        )


def _add_hand(spec: Any, gripper: ParallelJawGripper, parameters: WorldParameters) -> None:
    spec.worldbody.add_body(name="target", mocap=True)
    hand = spec.worldbody.add_body(name="hand", gravcomp=1.0, explicitinertial=True)
    hand.mass = parameters.hand_mass
    hand.inertia = np.full(3, 2e-3 * parameters.hand_mass)
    hand.add_freejoint(name="hand")
    _add_boxes(hand, gripper.palm, "palm", np.zeros(3))
    weld = spec.add_equality(
        name="wrist",
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1="hand",
        name2="target",
        solref=CONTACT_SOLREF,
        solimp=WRIST_SOLIMP,
    )
    weld.data[10] = 1.0  # torque scale: weigh rotations as they are
    for number, jaw in enumerate(gripper.jaws):
        _add_jaw(spec, hand, number, jaw, gripper, parameters)
    _let_pads_meet(spec, gripper, parameters)
    for number in range(1, len(gripper.jaws)):
        equal = spec.add_equality(
            name=f"travel{number}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1="finger0",
            name2=f"finger{number}",
            solref=CONTACT_SOLREF,
        )
        equal.data[:5] = (0.0, 1.0, 0.0, 0.0, 0.0)


def _add_jaw(
    spec: Any,
    hand: Any,
    number: int,
    jaw: Jaw,
    gripper: ParallelJawGripper,
    parameters: WorldParameters,
) -> None:
    closing = jaw.T_gripper_pad_open[:3, 2]
    finger = hand.add_body(name=f"finger{number}", gravcomp=1.0, explicitinertial=True)
    finger.mass = parameters.finger_mass
    finger.inertia = np.full(3, 1e-4)
    finger.add_joint(
        name=f"finger{number}",
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=closing,
        # Pads stop each other, and softly: beside a thin part they press on one another.
        range=[0.0, gripper.stroke + jaw.pad.max_deformation],
        solref_limit=CONTACT_SOLREF,
        damping=[gripper.max_force / parameters.closing_speed, 0, 0],
    )
    # The solids stand back by the pad's deformable depth, so that pins take up a contact first.
    _add_boxes(finger, jaw.boxes, f"finger{number}", -closing * jaw.pad.max_deformation)
    actuator = spec.add_actuator(
        name=f"finger{number}", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=f"finger{number}"
    )
    actuator.set_to_motor()
    _add_pins(finger, number, jaw, parameters)


def _add_boxes(body: Any, boxes: tuple[Box, ...], name: str, offset: FloatArray) -> None:
    for number, box in enumerate(boxes):
        body.add_geom(
            name=f"{name}_box{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=box.half_extents,
            pos=box.T_gripper_box[:3, 3] + offset,
            quat=quat_wxyz_from_rotation(box.T_gripper_box[:3, :3]),
            contype=0,
            conaffinity=_OBJECT | _TABLE,
            friction=[0.3, 5e-3, 1e-4],
            solref=CONTACT_SOLREF,
            rgba=[0.35, 0.36, 0.4, 1],
        )


def _add_pins(finger: Any, number: int, jaw: Jaw, parameters: WorldParameters) -> None:
    bed = pin_bed(jaw.pad)
    T = jaw.T_gripper_pad_open
    for pin, (center, area) in enumerate(zip(bed.centers, bed.areas, strict=True)):
        stiffness = parameters.foundation_modulus * area  # Winkler: K = E A / t
        point_pad = np.array([center[0], center[1], -bed.radius, 1.0])
        body = finger.add_body(
            name=f"pin{number}_{pin}", pos=(T @ point_pad)[:3], gravcomp=1.0, explicitinertial=True
        )
        body.mass = PIN_MASS
        body.inertia = np.full(3, 1e-8)
        body.add_joint(
            name=f"pin{number}_{pin}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=-T[:3, 2],
            stiffness=[stiffness, 0, 0],
            damping=[PIN_DAMPING_TIME * stiffness, 0, 0],
            range=[-1e-3, jaw.pad.max_deformation],
            solref_limit=CONTACT_SOLREF,
        )
        body.add_geom(
            name=f"pin{number}_{pin}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[bed.radius, 0, 0],
            contype=0,
            conaffinity=_OBJECT,
            condim=3,
            priority=1,
            friction=[parameters.friction, 5e-3, 1e-4],
            solref=CONTACT_SOLREF,
            solimp=CONTACT_SOLIMP,
            rgba=[0.2, 0.2, 0.22, 1],
        )


def _let_pads_meet(spec: Any, gripper: ParallelJawGripper, parameters: WorldParameters) -> None:
    """Let two pads press on one another, as softly as on a part, where no part is between them.

    The spring acts only beyond the meeting of the pads' faces. It counts the whole pad, though pins
    that a part has pushed in do not meet: a part that lets the pads meet is small beside them.
    """
    stiffness = _pads_stiffness(gripper, parameters)
    if stiffness == 0.0:
        return
    travels = spec.add_tendon(
        name="pads", stiffness=[stiffness, 0, 0], springlength=[0.0, 2.0 * gripper.stroke]
    )
    for number in range(len(gripper.jaws)):
        travels.wrap_joint(f"finger{number}", 1.0)


def _pads_stiffness(gripper: ParallelJawGripper, parameters: WorldParameters) -> float:
    """Of two pads in series [N/m]."""
    if len(gripper.jaws) != 2:
        return 0.0
    area = min(jaw.pad.area for jaw in gripper.jaws)
    return 0.5 * parameters.foundation_modulus * area


def _indexed(model: Any, gripper: ParallelJawGripper, parameters: WorldParameters) -> GraspModel:
    names = [model.geom(i).name for i in range(model.ngeom)]

    def geoms(prefix: str) -> IntArray:
        return frozen([i for i, name in enumerate(names) if name.startswith(prefix)], np.int64)

    jaws = range(len(gripper.jaws))
    pins = [
        [j for j in range(model.njnt) if model.joint(j).name.startswith(f"pin{k}_")] for k in jaws
    ]
    fingers = [model.joint(f"finger{k}") for k in jaws]
    hand = [i for i, name in enumerate(names) if "_box" in name]
    return GraspModel(
        model=model,
        gripper=gripper,
        parameters=parameters,
        object_geoms=geoms("part"),
        table_geom=names.index("table"),
        hand_geoms=frozen(hand, np.int64),
        pin_geoms=tuple(geoms(f"pin{k}_") for k in jaws),
        pin_qpos=tuple(frozen(model.jnt_qposadr[p], np.int64) for p in pins),
        pin_stiffness=tuple(frozen(model.jnt_stiffness[p].ravel()) for p in pins),
        pads_stiffness=_pads_stiffness(gripper, parameters),
        finger_qpos=frozen([int(f.qposadr[0]) for f in fingers], np.int64),
        finger_dof=frozen([int(f.dofadr[0]) for f in fingers], np.int64),
    )
