"""Dialogues with the program on the controller: lost lines, time-outs, stops, restarts."""

from __future__ import annotations

import socket
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from yumi_emulator import Arm, Controller, WebServices
from yumi_emulator.language import parse_module

from collection.clock import SimulatedClock
from collection.errors import (
    ConnectionLostError,
    MissingExtraError,
    MotorsOffError,
    NotConnectedError,
    NotInAutoError,
    Recovery,
    RobotError,
    RobotTimeoutError,
    StoppedError,
)
from collection.robots.yumi.arm import YumiRobotArm
from collection.robots.yumi.config import YumiConfig
from collection.robots.yumi.hand import SmartGripper
from collection.robots.yumi.link import ControllerLink
from collection.robots.yumi.messages import LAST_SEQUENCE, next_sequence


@pytest.mark.parametrize("fault", ["drop_before", "drop_after"])
@pytest.mark.parametrize("nth", [0, 1, 2, 6])
def test_a_line_lost_once_costs_nothing_and_repeats_nothing(
    hand: SmartGripper,
    controller: Controller,
    services: WebServices,
    right: Arm,
    fault: str,
    nth: int,
) -> None:
    """The n-th exchange of a command is cut, before or after it took effect."""
    services.after_exchanges(nth, lambda: setattr(controller.faults, fault, 1))
    assert hand.calibrate().width == 0.0
    assert right.hand.calibrations == 1
    assert getattr(controller.faults, fault) == 0  # the line was cut indeed


def test_a_line_lost_twice_is_an_error_that_asks_for_a_retry(
    hand: SmartGripper, controller: Controller
) -> None:
    controller.faults.deaf = 1000
    with pytest.raises(ConnectionLostError) as caught:
        hand.calibrate()
    assert caught.value.recovery is Recovery.RETRY


def test_after_a_lost_line_connecting_again_mends_everything(
    robot: tuple[YumiRobotArm, SmartGripper], controller: Controller
) -> None:
    arm, hand = robot
    controller.faults.deaf = 1000
    with pytest.raises(ConnectionLostError):
        arm.connect()
    controller.faults.deaf = 0
    arm.connect()
    assert hand.calibrate().width == 0.0


def test_reconnecting_uses_up_no_session(
    services: WebServices, config: YumiConfig, clock: SimulatedClock
) -> None:
    link = ControllerLink(config, clock)
    for _ in range(10):
        link.connect("test")
        link.disconnect("test")
    assert len(services.sessions) == 0


def test_a_program_that_does_not_answer_is_stopped(
    hand: SmartGripper, controller: Controller
) -> None:
    controller.faults.hang = True
    with pytest.raises(RobotTimeoutError, match="15"):
        hand.open()
    assert not controller.running


def test_a_slow_program_is_waited_for(hand: SmartGripper, controller: Controller) -> None:
    controller.faults.task_delay = 3.0
    before = controller.time
    hand.calibrate()
    assert controller.time - before > 3.0


@pytest.mark.parametrize(
    ("mode", "state", "error"),
    [
        ("MANR", "motoron", NotInAutoError),
        ("AUTO", "motoroff", MotorsOffError),
        ("AUTO", "guardstop", MotorsOffError),
    ],
)
def test_a_controller_that_is_not_ready_is_not_connected(
    config: YumiConfig,
    clock: SimulatedClock,
    controller: Controller,
    services: WebServices,
    mode: str,
    state: str,
    error: type[RobotError],
) -> None:
    controller.mode, controller.state = mode, state
    link = ControllerLink(config, clock)
    with pytest.raises(error):
        link.connect("test")
    assert not link.held_by("test") and not services.sessions


def test_connecting_starts_a_program_that_rests(
    config: YumiConfig, clock: SimulatedClock, controller: Controller
) -> None:
    controller.stop()
    link = ControllerLink(config, clock)
    link.connect("test")
    assert controller.running
    link.disconnect("test")


def test_a_module_of_another_version_is_refused(
    config: YumiConfig, clock: SimulatedClock, controller: Controller
) -> None:
    controller.write("T_ROB_R", "reach_version", '"0"')
    with pytest.raises(RobotError, match="version 0.*load the new one"):
        ControllerLink(config, clock).connect("test")


def test_a_task_without_our_module_is_named(clock: SimulatedClock) -> None:
    other = "MODULE Other PROC main() WHILE TRUE DO WaitTime 1; ENDWHILE ENDPROC ENDMODULE"
    with WebServices(Controller(parse_module(other))) as services:
        config = YumiConfig(driver="yumi", address=services.address)
        with pytest.raises(RobotError, match=r"reach_trials\.mod is not loaded in T_ROB_R"):
            ControllerLink(config, clock).connect("test")


def test_an_arm_the_controller_does_not_have_is_named(
    clock: SimulatedClock, services: WebServices, controller: Controller
) -> None:
    del controller.arms["T_ROB_L"]
    config = YumiConfig(driver="yumi", address=services.address, side="left")
    with pytest.raises(RobotError, match="no motion task T_ROB_L; it has: T_ROB_R"):
        ControllerLink(config, clock).connect("test")


def test_a_wrong_password_is_said(clock: SimulatedClock, services: WebServices) -> None:
    config = YumiConfig(driver="yumi", address=services.address, password="guess")
    with pytest.raises(RobotError, match="401"):
        ControllerLink(config, clock).connect("test")


def test_nobody_there_is_a_lost_connection(clock: SimulatedClock) -> None:
    config = YumiConfig(driver="yumi", address="127.0.0.1:9", request_timeout=0.5)
    with pytest.raises(ConnectionLostError, match="127.0.0.1:9"):
        ControllerLink(config, clock).connect("test")


def test_what_is_no_controller_is_said(clock: SimulatedClock) -> None:
    class Plain(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Length", "2")
            self.end_headers()
            self.wfile.write(b"hi")

        def log_message(self, *arguments: object) -> None:
            """Say nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Plain) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        config = YumiConfig(driver="yumi", address=f"127.0.0.1:{server.server_port}")
        link = ControllerLink(config, clock)
        with pytest.raises(RobotError, match="does not speak Robot Web Services"):
            link.connect("test")
        server.shutdown()
        thread.join()


def test_no_proxy_stands_between_robot_and_computer(
    config: YumiConfig, clock: SimulatedClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")
    monkeypatch.delenv("no_proxy", raising=False)
    monkeypatch.delenv("NO_PROXY", raising=False)
    link = ControllerLink(config, clock)
    link.connect("test")
    assert link.state().running
    link.disconnect("test")


def test_commands_before_connecting_are_refused(config: YumiConfig, clock: SimulatedClock) -> None:
    with pytest.raises(NotConnectedError):
        SmartGripper(ControllerLink(config, clock), None, 20.0).read()  # type: ignore[arg-type]


def test_a_program_stopped_at_the_pendant_is_said(
    hand: SmartGripper, controller: Controller
) -> None:
    controller.stop()
    with pytest.raises(StoppedError, match="was stopped"):
        hand.read()


def test_sequence_numbers_stay_exact_in_single_precision() -> None:
    assert next_sequence(0) == 1
    assert next_sequence(LAST_SEQUENCE) == 1
    assert LAST_SEQUENCE < 2**23


def test_a_controller_that_accepts_but_never_answers_is_a_lost_connection(
    clock: SimulatedClock,
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = "{}:{}".format(*silent.getsockname())
        config = YumiConfig(driver="yumi", address=address, request_timeout=0.2)
        with pytest.raises(ConnectionLostError, match="does not answer"):
            ControllerLink(config, clock).connect("test")


def test_without_the_extra_the_error_names_it(
    config: YumiConfig, clock: SimulatedClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "abb_robot_client.rws", None)
    with pytest.raises(MissingExtraError, match=r"reach-trials\[yumi\]"):
        ControllerLink(config, clock).connect("test")
