from dataclasses import replace

import numpy as np
import pytest

from reach.transforms import make_transform, rotation_about
from registration.errors import NoTableError
from registration.table import fit_table

BOUNDS = {"structured-light": (1e-4, 6e-4), "stereo": (4e-4, 3e-3)}


def fitted(case, seed=0, max_tilt=0.26):
    bounds = BOUNDS[case.frame.sensor]
    rng = np.random.default_rng(seed)
    return fit_table(case.frame, rng, noise_bounds=bounds, max_tilt=max_tilt)


@pytest.mark.parametrize("sensor", ["structured-light", "stereo"])
def test_a_tilted_table_is_found_where_it_is(parts, scenes, sensor):
    settings = scenes.SceneSettings(sensor, table_tilt=np.radians(4))
    case = scenes.make_case(parts["bracket"], np.random.default_rng(2), settings)
    table = fitted(case)
    assert np.degrees(table.tilt) == pytest.approx(4, abs=0.15)
    # The world's origin lies on the table in these scenes.
    assert abs(table.offset_world) < 3e-4
    assert np.linalg.norm(table.normal_camera) == pytest.approx(1)


def test_noise_and_its_correlation_are_measured(scenes):
    fine, coarse = (
        fitted(scenes.make_case(None, np.random.default_rng(4), scenes.SceneSettings(sensor)))
        for sensor in ("structured-light", "stereo")
    )
    assert 1e-4 <= fine.noise < 2e-4
    assert 0.6e-3 < coarse.noise < 2e-3
    # Stereo noise is shared by patches of pixels, which therefore count for less.
    assert coarse.correlation_area > 5 * fine.correlation_area


def test_a_steep_plane_is_no_table(scenes):
    case = scenes.make_case(None, np.random.default_rng(5), scenes.SceneSettings())
    T = case.frame.T_world_camera
    turned = replace(case.frame, T_world_camera=make_transform(rotation_about((1, 0, 0), 0.6)) @ T)
    with pytest.raises(NoTableError):
        fitted(replace(case, frame=turned))


def test_an_image_without_returns_has_no_table(scenes):
    case = scenes.make_case(None, np.random.default_rng(6), scenes.SceneSettings())
    empty = replace(case.frame, depth=np.full_like(case.frame.depth, np.nan))
    with pytest.raises(NoTableError, match="only 0 returns"):
        fitted(replace(case, frame=empty))


def test_the_table_frame_stands_on_the_table(scenes):
    case = scenes.make_case(None, np.random.default_rng(7), scenes.SceneSettings())
    table = fitted(case)
    T = table.T_camera_table(np.array([0.02, -0.03, 0.55]))
    np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-12)
    assert table.heights(T[:3, 3]) == pytest.approx(0, abs=1e-9)
    T_world_table = case.frame.T_world_camera @ T
    assert T_world_table[0, 0] == pytest.approx(1, abs=1e-3)
