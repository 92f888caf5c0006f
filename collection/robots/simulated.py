"""The simulated YuMi, as the station file names it."""

from __future__ import annotations

from collection.cell.shared import simulated_cell
from collection.robots.planner import ArmPlanner
from collection.robots.simulated_arm import SimulatedArm
from collection.robots.simulated_config import SimulatedRobotConfig
from collection.robots.simulated_controller import SimulatedController
from collection.robots.simulated_gripper import SimulatedGripper
from collection.robots.yumi_arm import yumi_arm
from collection.station.drivers import BuildContext
from reach.transforms import make_transform


def build(
    config: SimulatedRobotConfig, context: BuildContext
) -> tuple[SimulatedArm, SimulatedGripper]:
    """Build arm and hand in the station's simulated cell; nothing moves before connect()."""
    simulation = simulated_cell(context)
    planner = ArmPlanner(
        yumi_arm(config.side),
        simulation.gripper,
        make_transform(None, config.base),
        simulation.workspace.table_height,
    )
    context.shared["arm_model"] = planner.model
    controller = SimulatedController(simulation)
    hand = SimulatedGripper(controller, context.station.motion.closing_force)
    return SimulatedArm(planner, controller), hand
