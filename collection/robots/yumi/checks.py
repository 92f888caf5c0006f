"""What `reach doctor` asks a YuMi's controller."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from collection.errors import RobotError
from collection.robots.yumi.diagnosis import not_ready
from collection.robots.yumi.feedback import MODEL_POSITION, MODEL_ROTATION, Feedback
from collection.robots.yumi.link import MODULE_FILE, ControllerLink, module_version
from collection.robots.yumi.program import TOOL, VERSION
from collection.robots.yumi.rapid_text import from_rapid
from collection.robots.yumi.web_services import WebServices
from collection.station.checkup import Check, Status, passed
from reach.arrays import FloatArray
from reach.transforms import inverse, rotation_angle


def controller_checks(
    link: ControllerLink, feedback: Feedback, forward: Callable[[FloatArray], FloatArray]
) -> Iterator[Check]:
    """Mode, motors, program, module, tool, and whether our kinematics agrees; moves nothing.

    Args:
        link: to the controller, connected or not.
        feedback: readings of the arm.
        forward: our kinematics, joints (7,) to T_world_gripper (4, 4).
    """
    with link.session() as services:
        state = services.state()
        yield Check("controller", Status.OK, f"answers at {link.config.url}")
        yield passed("mode", state.mode == "AUTO", state.mode)
        yield passed("motors", state.motors == "motoron", state.motors)
        reason = not_ready(state)
        resting = "rests; it is started when a session connects"
        yield passed("program", state.running, "runs" if state.running else resting, Status.WARN)
        if reason is not None:
            yield Check("ready", Status.FAIL, str(reason))
        yield _module(services, link)
        yield _tool(services, link)
        yield _kinematics(services, feedback, forward)


def _module(services: WebServices, link: ControllerLink) -> Check:
    try:
        loaded = str(from_rapid(services.read(link.task, VERSION)))
    except RobotError as error:
        return Check("module", Status.FAIL, f"{MODULE_FILE} is not loaded in {link.task}: {error}")
    same = loaded == module_version()
    detail = f"{MODULE_FILE} version {loaded} in {link.task}"
    return passed("module", same, detail if same else f"{detail}, this is {module_version()}")


def _tool(services: WebServices, link: ControllerLink) -> Check:
    try:
        value = from_rapid(services.read(link.task, TOOL))
    except RobotError as error:
        return Check("tool", Status.FAIL, str(error))
    match value:
        case [True, [[float(x), float(y), float(z)], [*rotation]], [float(mass), *_]]:
            is_flange = (x, y, z) == (0, 0, 0) and rotation == [1, 0, 0, 0]
            detail = f"{TOOL}: mass {mass:.3f} kg"
            moved = f"{detail}, but it must be tool0: poses are of the gripper's frame"
            return passed("tool", is_flange, detail if is_flange else moved)
    return Check("tool", Status.FAIL, f"{TOOL} is not a tool that the robot holds: {value}")


def _kinematics(
    services: WebServices, feedback: Feedback, forward: Callable[[FloatArray], FloatArray]
) -> Check:
    ours, theirs = forward(feedback.joints(services)), feedback.T_world_gripper(services)
    delta = inverse(ours) @ theirs
    way, angle = float(np.linalg.norm(delta[:3, 3])), rotation_angle(delta[:3, :3])
    detail = f"ours and the controller's differ by {1000 * way:.1f} mm, {np.degrees(angle):.2f} deg"
    return passed("kinematics", way < MODEL_POSITION and angle < MODEL_ROTATION, detail)
