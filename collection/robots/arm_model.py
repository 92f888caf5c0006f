"""The arm as a MuJoCo model: for inverse kinematics, collision checks, pictures and records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from collection.robots.description import Shape
from collection.robots.yumi_arm import JOINT_NAMES, YumiArm, gripper_shapes, link_name
from reach.arrays import FloatArray, frozen
from reach.gripper import ParallelJawGripper
from reach.transforms import quat_wxyz_from_rotation

LINK_CLEARANCE = 0.010
"""Links keep this distance from table and torso; the hand may touch neither [m]."""
_GEOM_TYPE = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
}
_LINKS, _TABLE, _BASE = 1, 2, 4


@dataclass(frozen=True, slots=True, eq=False)
class ArmModel:
    """The compiled model; bodies are named as links, the hand's body is `gripper`.

    Args:
        model: the MuJoCo model; its configuration is the joints in kinematic order.
        mjcf: its text.
        shapes: every primitive, the hand's included.
        link_geoms: names of the links' geoms.
        hand_geoms: names of the hand's geoms.
    """

    model: Any
    mjcf: str
    shapes: tuple[Shape, ...]
    link_geoms: tuple[str, ...]
    hand_geoms: tuple[str, ...]


def arm_model(
    arm: YumiArm, gripper: ParallelJawGripper, T_world_base: FloatArray, table_height: float
) -> ArmModel:
    """Build the arm with its hand, jaws fully open, above the table."""
    spec = mujoco.MjSpec()
    spec.modelname = f"yumi_{arm.side}"
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[1, 1, 0.1],
        pos=[0, 0, table_height],
        contype=_TABLE,
        conaffinity=0,
        rgba=[0.55, 0.47, 0.4, 1],
    )
    shapes = (*arm.shapes, *gripper_shapes(gripper))
    bodies = _add_links(spec, arm, T_world_base)
    names = [_add_shape(bodies[shape.link], shape, n) for n, shape in enumerate(shapes)]
    _exclude_neighbors(spec)
    model = spec.compile()
    return ArmModel(
        model,
        spec.to_xml(),
        shapes,
        tuple(n for n, s in zip(names, shapes, strict=True) if s.link.startswith("link_")),
        tuple(n for n, s in zip(names, shapes, strict=True) if s.link == "gripper"),
    )


def _add_links(spec: Any, arm: YumiArm, T_world_base: FloatArray) -> dict[str, Any]:
    body = spec.worldbody.add_body(name="base", **_pose(T_world_base))
    bodies = {"base": body}
    chain = arm.chain
    for number, joint in enumerate(JOINT_NAMES):
        body = body.add_body(name=link_name(number), **_pose(chain.T_parent_joint[number]))
        body.explicitinertial = True  # kinematics only: any mass serves
        body.mass, body.inertia = 1.0, np.full(3, 1e-2)
        body.add_joint(
            name=joint,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, 1],
            limited=True,
            range=[np.degrees(chain.lower[number]), np.degrees(chain.upper[number])],
        )
        bodies[body.name] = body
    tip = body.add_body(name="gripper", **_pose(chain.T_last_tip))
    tip.explicitinertial = True
    tip.mass, tip.inertia = 0.3, np.full(3, 1e-3)
    bodies["gripper"] = tip
    return bodies


def _add_shape(body: Any, shape: Shape, number: int) -> str:
    name = f"{shape.link}_{number}"
    is_link = shape.link.startswith("link_")
    size = np.zeros(3)
    size[: len(shape.size)] = shape.size
    body.add_geom(
        name=name,
        type=_GEOM_TYPE[shape.kind],
        size=size,
        rgba=shape.rgba,
        margin=LINK_CLEARANCE if is_link else 0.0,
        contype=_BASE if shape.link == "base" else _LINKS,
        conaffinity=0 if shape.link == "base" else _LINKS | _TABLE | _BASE,
        **_pose(shape.T_link_shape),
    )
    return name


def _exclude_neighbors(spec: Any) -> None:
    """Links that meet at a joint, or one further on, always touch."""
    order = ["base", *(link_name(n) for n in range(len(JOINT_NAMES))), "gripper"]
    for first in range(len(order)):
        for second in range(first + 1, min(first + 4, len(order))):
            spec.add_exclude(
                name=f"{order[first]}-{order[second]}",
                bodyname1=order[first],
                bodyname2=order[second],
            )


def _pose(T: FloatArray) -> dict[str, FloatArray]:
    return {"pos": frozen(T[:3, 3]), "quat": frozen(quat_wxyz_from_rotation(T[:3, :3]))}
