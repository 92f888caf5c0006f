"""The driver of a real ABB YuMi with an IRC5 controller.

`reach_trials.mod` runs on the controller and serves requests; `program` sends them, `arm` and
`hand` are the devices a trial sees. `docs/hardware.md` says how to set a controller up.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from collection.robots.yumi.config import YumiConfig

if TYPE_CHECKING:
    from collection.robots.planner import ArmPlanner
    from collection.robots.yumi.arm import YumiRobotArm
    from collection.robots.yumi.hand import SmartGripper
    from collection.station.drivers import BuildContext

__all__ = ["YumiConfig", "build"]

LIMIT_MARGIN = 0.03
"""Plans stay so far inside the joints' limits [rad]: the controller's kinematics differs from ours by
a millimeter or two, and a plan that ends at a limit is beyond it there."""


def build(config: YumiConfig, context: BuildContext) -> tuple[YumiRobotArm, SmartGripper]:
    """Arm and hand of a station; inert until they are connected."""
    from collection.robots.yumi.arm import YumiRobotArm
    from collection.robots.yumi.hand import SmartGripper
    from collection.robots.yumi.link import ControllerLink
    from reach.transforms import make_transform, rotation_about

    link = ControllerLink(config, context.clock)
    gripper = context.station.gripper_geometry()
    table_height = context.station.workspace.table_height
    T_world_base = make_transform(rotation_about((0, 0, 1), config.base_yaw), config.base)

    def make_planner() -> ArmPlanner:
        from collection.robots.planner import ArmPlanner
        from collection.robots.yumi_arm import yumi_arm

        arm = yumi_arm(config.side)
        within = replace(arm, chain=arm.chain.inside_limits(LIMIT_MARGIN))
        return ArmPlanner(within, gripper, T_world_base, table_height)

    hand = SmartGripper(link, gripper, context.station.motion.closing_force)
    return YumiRobotArm(link, make_planner, T_world_base), hand
