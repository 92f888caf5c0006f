"""Ways around the robot's own body."""

from __future__ import annotations

import numpy as np
import pytest

from collection.errors import UnsafeMotionError
from collection.robots.detour import detour
from collection.robots.planner import ArmPlanner
from collection.robots.yumi_arm import yumi_arm
from reach.gripper import ParallelJawGripper
from reach.transforms import make_transform

OVER_THE_TABLE = np.array([1.213, -0.512, -1.569, 0.683, -2.050, 0.804, -2.009])
"""Reached at the end of a lift; on the straight way home the hand meets the torso."""


@pytest.fixture(scope="module")
def planner() -> ArmPlanner:
    return ArmPlanner(yumi_arm("right"), ParallelJawGripper.yumi(), make_transform(), 0.0)


def test_a_free_way_is_taken_straight(planner: ArmPlanner) -> None:
    home = planner.arm.home
    (path,) = detour(planner, home, home + 0.05)
    assert np.array_equal(path.joints[0], home) and np.allclose(path.joints[-1], home + 0.05)


def test_a_way_around_is_found_and_touches_nothing(planner: ArmPlanner) -> None:
    home = planner.arm.home
    with pytest.raises(UnsafeMotionError):
        planner.joint_path(OVER_THE_TABLE, home)
    first, second = detour(planner, OVER_THE_TABLE, home)
    assert np.array_equal(first.joints[0], OVER_THE_TABLE)
    assert np.allclose(first.joints[-1], second.joints[0])
    assert np.allclose(second.joints[-1], home)
    for path in (first, second):
        planner.joint_path(path.joints[0], path.joints[-1])
        assert np.all(path.joints >= planner.arm.chain.lower)


def test_no_way_is_an_error_that_says_what_is_in_the_way(planner: ArmPlanner) -> None:
    folded = planner.arm.home.copy()
    folded[0] = 2.9  # the arm inside the torso: no way leads there
    with pytest.raises(UnsafeMotionError, match="no way around"):
        detour(planner, planner.arm.home, folded)
