"""The real hand's driver against the emulated controller."""

from __future__ import annotations

import pytest
from yumi_emulator import Arm, Controller

from collection.errors import GripperNotCalibratedError, Recovery, RobotError, StoppedError
from collection.robots.readings import GripperSample
from collection.robots.yumi.hand import SmartGripper
from reach.errors import InvalidInputError


def test_opening_calibrates_an_uncalibrated_hand_once(hand: SmartGripper, right: Arm) -> None:
    assert not hand.state().calibrated
    assert hand.open().width == pytest.approx(0.050)
    assert right.hand.calibrations == 1
    assert hand.state().calibrated
    hand.open(0.02)
    assert right.hand.calibrations == 1


def test_a_hand_that_keeps_no_calibration_is_an_error(
    hand: SmartGripper, controller: Controller, right: Arm
) -> None:
    controller.faults.calibration_fails = True
    with pytest.raises(GripperNotCalibratedError):
        hand.open()
    assert right.hand.calibrations == 1  # tried once, not for ever


def test_closing_never_calibrates_around_an_object(hand: SmartGripper, right: Arm) -> None:
    right.hand.object_width = 30.0
    with pytest.raises(GripperNotCalibratedError) as caught:
        hand.close(20.0)
    assert right.hand.calibrations == 0
    assert caught.value.recovery is Recovery.RETRY  # the retried trial opens first


def test_closing_reads_the_objects_width_and_the_force_held(hand: SmartGripper, right: Arm) -> None:
    hand.open()
    right.hand.object_width = 31.0
    samples: list[GripperSample] = []
    motion = hand.close(15.0, on_sample=samples.append)
    assert motion.width == pytest.approx(0.031)
    assert motion.force == 15.0 and right.hand.force == 15.0
    assert motion.end_ns > motion.start_ns
    widths = [sample.width for sample in samples]
    assert len(widths) > 3 and widths == sorted(widths, reverse=True)
    assert widths[-1] == pytest.approx(0.031)
    assert hand.read().force == 15.0
    hand.open()
    assert hand.read().force == 0.0


def test_closing_on_nothing_reads_zero(hand: SmartGripper) -> None:
    hand.open()
    assert hand.close(20.0).width == 0.0


def test_the_whole_stroke_takes_the_hands_own_speed(hand: SmartGripper) -> None:
    hand.calibrate()
    motion = hand.open()
    assert (motion.end_ns - motion.start_ns) * 1e-9 == pytest.approx(25 / 20, abs=0.1)


@pytest.mark.parametrize("width", [-0.001, 0.051])
def test_a_width_outside_the_stroke_is_refused(hand: SmartGripper, width: float) -> None:
    with pytest.raises(InvalidInputError, match="opening"):
        hand.open(width)


@pytest.mark.parametrize("force", [0.0, -1.0, 20.1, float("nan")])
def test_a_force_the_hand_does_not_have_is_refused(hand: SmartGripper, force: float) -> None:
    with pytest.raises(InvalidInputError, match="force"):
        hand.close(force)


def test_a_hand_fault_is_said(hand: SmartGripper, controller: Controller) -> None:
    hand.calibrate()
    controller.faults.hand_faults = 1
    with pytest.raises(RobotError, match="hand is in a wrong state"):
        hand.open()
    assert hand.open().width == pytest.approx(0.05)


def test_stopping_the_hand_stops_the_program(hand: SmartGripper, controller: Controller) -> None:
    hand.stop()
    assert not controller.running


def test_a_disconnected_hand_has_a_shape_and_a_state(hand: SmartGripper) -> None:
    hand.disconnect()
    assert not hand.state().connected
    assert hand.geometry.max_opening == pytest.approx(0.05)
    hand.disconnect()
    hand.stop()


def test_a_hand_without_power_is_said(hand: SmartGripper, controller: Controller) -> None:
    hand.calibrate()
    controller.faults.hand_unpowered = True
    assert hand.state().error == "the jaws' position cannot be read"
    with pytest.raises(RobotError, match="powered"):
        hand.read()


def test_reading_a_hand_whose_program_is_stopped_is_an_error(
    hand: SmartGripper, controller: Controller
) -> None:
    hand.calibrate()
    controller.stop()  # the last reading stays in the controller, and gets old
    with pytest.raises(StoppedError):
        hand.read()
