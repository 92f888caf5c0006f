"""The unmodified client library talks to the emulator: its paths, its digest, its errors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import requests
from abb_robot_client.rws import RWS, ABBException
from yumi_emulator import Controller, WebServices
from yumi_emulator.kinematics import HOME, Chain


@pytest.fixture
def client(services: WebServices) -> Iterator[RWS]:
    client = RWS(services.url)
    yield client
    client.close()


def test_state_of_the_controller(client: RWS, controller: Controller) -> None:
    assert client.get_controller_state() == "motoron"
    assert client.get_operation_mode() == "AUTO"
    assert client.get_execution_state().ctrlexecstate == "running"
    assert set(client.get_tasks()) == {"T_ROB_R", "T_ROB_L"}
    client.set_controller_state("motoroff")
    assert controller.state == "motoroff"


def test_jointtarget_has_joint_7_as_its_external_axis(client: RWS) -> None:
    target = client.get_jointtarget("ROB_L")
    assert target.robax == pytest.approx([0, -130, 30, 0, 40, 0])
    assert target.extax[0] == pytest.approx(135)


def test_robtarget_at_home_is_the_known_one(client: RWS) -> None:
    # The left arm's home in programs made with ABB's own tool: position [mm], orientation
    # (w, x, y, z); its eax_a is an arm angle, not joint 7.
    target = client.get_robtarget("ROB_L")
    assert target.trans == pytest.approx([-9.578368507, 182.609892723, 198.627808149], abs=0.01)
    known = np.array([0.066010741, 0.842421005, -0.11121506, 0.523068488])
    assert abs(target.rot @ known) == pytest.approx(1.0, abs=1e-5)
    assert target.extax[0] != pytest.approx(135, abs=1)


def test_variables_are_read_and_written(client: RWS, controller: Controller) -> None:
    assert client.get_rapid_variable("reach_version", "T_ROB_R") == '"1"'
    assert client.get_rapid_variable("ReachTrials/reach_version", "T_ROB_R") == '"1"'
    client.set_rapid_variable("reach_version", '"2"', "T_ROB_R")
    assert controller.read("T_ROB_R", "reach_version") == '"2"'
    with pytest.raises(ABBException, match="no symbol"):
        client.get_rapid_variable("nothing", "T_ROB_R")
    with pytest.raises(ABBException):
        client.set_rapid_variable("reach_version", "5", "T_ROB_R")


def test_programs_start_and_stop(client: RWS, controller: Controller) -> None:
    client.stop()
    assert not controller.running
    client.resetpp()
    client.start("forever", ["T_ROB_R", "T_ROB_L"])
    assert controller.running
    with pytest.raises(ABBException, match="runs"):
        client.resetpp()


def test_manual_mode_refuses_commands(client: RWS, controller: Controller) -> None:
    controller.mode = "MANR"
    with pytest.raises(ABBException, match="automatic"):
        client.set_rapid_variable("reach_version", '"2"', "T_ROB_R")
    assert client.get_operation_mode() == "MANR"


def test_signals_and_the_event_log(client: RWS, controller: Controller) -> None:
    client.set_digital_io("custom_DO_0", 1)
    assert client.get_digital_io("custom_DO_0") == 1
    controller.log(10011, 1, "Motors ON state")
    (event,) = client.read_event_log()
    assert (event.seqnum, event.code, event.title) == (1, 10011, "Motors ON state")


def test_a_wrong_password_is_refused(services: WebServices) -> None:
    client = RWS(services.url, "Default User", "guess")
    with pytest.raises(Exception, match="401"):
        client.get_controller_state()
    client.close()


def test_no_answer_without_digest(services: WebServices) -> None:
    answer = requests.get(f"{services.url}/rw/panel/ctrlstate?json=1", timeout=5)
    assert answer.status_code == 401
    assert answer.headers["WWW-Authenticate"].startswith("Digest ")


def test_sessions_are_limited_as_on_the_controller(services: WebServices) -> None:
    services.sessions.update(f"taken{n}" for n in range(70))
    client = RWS(services.url)
    with pytest.raises(Exception, match="503|500"):
        client.get_controller_state()
    client.close()


def test_the_emulated_inverse_kinematics_is_the_inverse() -> None:
    chain, rng = Chain("R"), np.random.default_rng(3)
    for _ in range(5):
        joints = HOME["R"] + rng.uniform(-0.3, 0.3, 7)
        joints[1] = max(joints[1], -2.4)
        T, angle = chain.forward(joints), chain.arm_angle(joints)
        assert chain.inverse(T, angle, HOME["R"]) == pytest.approx(joints, abs=1e-6)
