"""A simulated part is put where its grasp is reached also a little beside: registration errs."""

from __future__ import annotations

import numpy as np
import pytest

from collection.placement import SHIFT, TURN, well_placed
from collection.robots.motion import can_execute
from collection.station.station import load_station
from reach.transforms import inverse, make_transform, rotation_angle

T_OBJECT_GRIPPER = make_transform(np.diag([1.0, -1.0, -1.0]), (0, 0, 0.160098))


def grasps_of(T_world_object: np.ndarray) -> np.ndarray:
    return (T_world_object @ T_OBJECT_GRIPPER)[None]


def test_every_neighbor_within_the_margin_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    station = load_station("simulated")
    T = make_transform(None, (0.38, -0.10, 0.015))
    asked: list[np.ndarray] = []

    def grasps(T_world_object: np.ndarray) -> np.ndarray:
        asked.append(T_world_object)
        return grasps_of(T_world_object)

    with station:
        assert well_placed(station, grasps, T)
    *beside, itself = asked
    assert np.array_equal(itself, T)
    assert len(beside) == 4
    for each in beside:
        assert np.linalg.norm(each[:3, 3] - T[:3, 3]) == pytest.approx(SHIFT)
        assert rotation_angle((inverse(T) @ each)[:3, :3]) == pytest.approx(TURN)


def test_a_grasp_at_the_limit_of_reach_is_not_accepted() -> None:
    """Going out from the robot: the last place that it reaches is no place for a part."""
    with load_station("simulated") as station:
        near, far = 0.40, 1.00
        while far - near > 1e-4:
            middle = 0.5 * (near + far)
            if can_execute(station.arm, grasps_of(place(middle))):
                near = middle
            else:
                far = middle
        assert can_execute(station.arm, grasps_of(place(near)))
        assert not well_placed(station, grasps_of, place(near))


def place(x: float) -> np.ndarray:
    return np.array(make_transform(None, (x, -0.10, 0.015)))
