"""The packaged RAPID module: parsed by the grammar, held against the driver, run by itself."""

from __future__ import annotations

import re
from dataclasses import fields
from importlib.resources import files

import numpy as np
import pytest
from yumi_emulator import Arm, Controller
from yumi_emulator.interpreter import INSTRUCTIONS
from yumi_emulator.kinematics import HOME, Vector
from yumi_emulator.language import Module, parse_expression
from yumi_emulator.runtime import Arguments, RapidError, Run
from yumi_emulator.values import ATOMIC, RECORDS, to_text

from collection.robots.yumi.link import module_text, module_version
from collection.robots.yumi.messages import Command, Failure, Reply, Request
from collection.robots.yumi.rapid_text import to_rapid


def constants(module: Module, controller: Controller) -> dict[str, float]:
    task = controller.arms["T_ROB_R"].task
    return {
        data.name.upper(): task.constant(data.initial)
        for data in module.data.values()
        if data.storage == "const" and data.type_name == "num"
    }


def ask(controller: Controller, request: Request, sequence: int, task: str = "T_ROB_R") -> None:
    controller.write(task, "reach_request", request.to_rapid(sequence))


def answer(controller: Controller, task: str = "T_ROB_R") -> Reply:
    return Reply.from_rapid(controller.read(task, "reach_reply"))


def test_the_module_is_packaged_and_plain_ascii() -> None:
    assert (files("collection.robots.yumi") / "reach_trials.mod").is_file()
    assert module_text().isascii()
    assert max(len(line) for line in module_text().splitlines()) < 160


def test_commands_and_failures_have_the_modules_numbers(
    rapid_module: Module, controller: Controller
) -> None:
    known = constants(rapid_module, controller)
    spoken = {member.name: float(member) for member in (*Command, *Failure)}
    assert {name: known.get(name) for name in spoken} == spoken
    assert set(known) - set(spoken) == {"RETREAT_HEIGHT", "OBSERVATION_PERIOD"}


def test_a_request_fills_the_modules_record_field_by_field(
    controller: Controller, rapid_module: Module
) -> None:
    request = Request(
        Command.MOVE_POSE_LINEAR,
        joints_deg=(1, 2, 3, 4, 5, 6, 7),
        position_mm=(8, 9, 10),
        quat_wxyz=(0.5, -0.5, 0.5, -0.5),
        speed_mm=11,
        turn_deg=12,
        zone_mm=13,
        supervision_percent=14,
        jaw_mm=15,
        force=16,
    )
    controller.arms["T_ROB_R"].task.write("reach_request", _typed(controller, request, 17))
    record = controller.arms["T_ROB_R"].task.read("reach_request")
    assert list(record.fields) == list(rapid_module.records["reachrequest"])
    held = {name: to_text(value) for name, value in record.fields.items()}
    assert held == {
        "seq": "17",
        "command": "4",
        "joints": "[[1,2,3,4,5,6],[7,9E+09,9E+09,9E+09,9E+09,9E+09]]",
        "goal": "[[8,9,10],[0.5,-0.5,0.5,-0.5]]",
        "speed": "11",
        "turn": "12",
        "zone": "13",
        "supervision": "14",
        "jaw": "15",
        "force": "16",
        "seal": "17",
    }


def _typed(controller: Controller, request: Request, sequence: int) -> object:
    task = controller.arms["T_ROB_R"].task
    return task.constant(parse_expression(request.to_rapid(sequence)))


def test_a_reply_reads_the_modules_record(rapid_module: Module) -> None:
    names = list(rapid_module.records["reachreply"])
    assert names == ["seq", "busy", "done", "error", "jaw", "calibrated"]
    reply = Reply.from_rapid(to_rapid([5, False, True, 3, 12.5, True]))
    assert len(fields(Reply)) == len(names)
    assert reply == Reply(5, False, True, Failure.COLLISION, 12.5, True)


def test_nothing_is_shared_between_the_arms_tasks(rapid_module: Module) -> None:
    # A plain PERS of one name is one variable in all tasks: both arms would follow a request.
    assert {d.storage for d in rapid_module.data.values()} == {"const", "var", "task_pers"}


def test_types_are_built_in_or_the_modules_own(rapid_module: Module) -> None:
    known = {*ATOMIC, *RECORDS, *rapid_module.records}
    used = {data.type_name for data in rapid_module.data.values()}
    used |= {t for routine in rapid_module.routines.values() for _, t in routine.parameters}
    used |= {t for record in rapid_module.records.values() for t in record.values()}
    assert used <= known


def test_every_routine_called_is_the_modules_or_the_controllers(
    rapid_module: Module, right: Arm
) -> None:
    known = {*INSTRUCTIONS, *rapid_module.routines, *right.procedures, *right.functions}
    called = {
        node.children[0].lower()
        for routine in rapid_module.routines.values()
        for tree in (routine.statements, routine.handler)
        if tree is not None
        for kind in ("call", "function")
        for node in tree.find_data(kind)
    }
    assert called <= known
    assert {"hand_gripinward", "hand_initialize", "calcjointt", "movel", "moveabsj"} <= called


def test_the_modules_version_is_found() -> None:
    assert re.fullmatch(r"\d+", module_version())


def test_a_request_is_busy_then_done(controller: Controller) -> None:
    ask(controller, Request(Command.JAW_CALIBRATE, speed_mm=10, force=10), 1)
    controller.advance(0.05)
    assert (answer(controller).sequence, answer(controller).busy) == (1, True)
    assert not answer(controller).done
    controller.advance(2.0)
    reply = answer(controller)
    assert (reply.busy, reply.done, reply.failure) == (False, True, Failure.OK)
    assert reply.calibrated and reply.jaw_mm == 0.0


def test_a_torn_request_is_not_started(controller: Controller, right: Arm) -> None:
    whole = Request(Command.JAW_CALIBRATE, speed_mm=10).to_rapid(1)
    torn = whole[: whole.rindex(",")] + ",0]"  # the seal has not arrived
    controller.write("T_ROB_R", "reach_request", torn)
    controller.advance(1.0)
    assert answer(controller).sequence == 0 and right.hand.calibrations == 0
    controller.write("T_ROB_R", "reach_request", whole)
    controller.advance(2.0)
    assert right.hand.calibrations == 1


def test_a_request_sent_twice_is_served_once(controller: Controller, right: Arm) -> None:
    for _ in range(2):
        ask(controller, Request(Command.JAW_CALIBRATE, speed_mm=10), 1)
        controller.advance(2.0)
    assert right.hand.calibrations == 1


def test_a_request_moves_its_own_arm_only(controller: Controller) -> None:
    ask(controller, Request(Command.JAW_CALIBRATE, speed_mm=10), 1, task="T_ROB_L")
    controller.advance(2.0)
    assert controller.arms["T_ROB_L"].hand.calibrations == 1
    assert controller.arms["T_ROB_R"].hand.calibrations == 0


def test_a_restart_does_not_carry_out_what_was_asked_before(
    controller: Controller, right: Arm
) -> None:
    controller.stop()
    ask(controller, Request(Command.JAW_CALIBRATE, speed_mm=10), 7)
    controller.reset_pointers()
    controller.start()
    controller.advance(1.0)
    reply = answer(controller)
    assert (reply.sequence, reply.failure) == (7, Failure.RESTARTED)
    assert right.hand.calibrations == 0


def test_an_interrupted_request_is_reported_after_the_restart(controller: Controller) -> None:
    ask(controller, Request(Command.JAW_CALIBRATE, speed_mm=10), 1)
    controller.advance(0.1)
    controller.stop()
    controller.reset_pointers()
    controller.start()
    controller.advance(0.1)
    assert answer(controller).failure is Failure.RESTARTED and answer(controller).done


def test_a_restart_at_rest_reports_nothing(controller: Controller) -> None:
    ask(controller, Request(Command.PING), 1)
    controller.advance(0.1)
    controller.stop()
    controller.reset_pointers()
    controller.start()
    controller.advance(0.1)
    assert answer(controller).failure is Failure.OK


def test_an_unknown_command_is_refused(controller: Controller) -> None:
    text = Request(Command.PING).to_rapid(1).replace("[1,1,", "[1,99,", 1)
    controller.write("T_ROB_R", "reach_request", text)
    controller.advance(0.1)
    assert answer(controller).failure is Failure.UNKNOWN_COMMAND


def test_a_collision_stops_clears_the_path_and_lifts(controller: Controller, right: Arm) -> None:
    controller.faults.collide_at = 0.5
    ask(controller, _joint_request(10.0), 1)
    controller.advance(20.0)
    assert answer(controller).failure is Failure.COLLISION
    assert right.motion.log == ["StopMove", "ClearPath", "StartMove"]
    here = right.motion.chain.forward(right.motion.joints)
    half = right.motion.chain.forward(_turned(5.0))
    assert here[2, 3] - half[2, 3] == pytest.approx(50.0, abs=0.5)


def test_a_collision_while_lifting_is_still_a_collision(controller: Controller, right: Arm) -> None:
    controller.faults.collide_at, controller.faults.collisions = 0.5, 2
    ask(controller, _joint_request(10.0), 1)
    controller.advance(20.0)
    assert answer(controller).failure is Failure.COLLISION
    assert not right.motion.stopped
    ask(controller, Request(Command.PING), 2)
    controller.advance(0.1)
    assert answer(controller).sequence == 2  # the program goes on


def test_a_lift_out_of_reach_does_not_hide_the_collision(
    controller: Controller, right: Arm
) -> None:
    def out_of_reach(_: Arguments) -> Run:
        raise RapidError("ERR_OUTSIDE_REACH")

    right.procedures["movel"] = out_of_reach
    controller.faults.collide_at = 0.5
    ask(controller, _joint_request(10.0), 1)
    controller.advance(20.0)
    assert answer(controller).failure is Failure.COLLISION


def _joint_request(turn_deg: float) -> Request:
    joints = tuple(np.degrees(_turned(turn_deg)))
    return Request(Command.MOVE_JOINTS, joints_deg=joints, speed_mm=50, turn_deg=30)


def _turned(turn_deg: float) -> Vector:
    """Home with axis 1 turned [rad], in the controller's order."""
    joints = HOME["R"].copy()
    joints[0] += np.radians(turn_deg)
    return joints
