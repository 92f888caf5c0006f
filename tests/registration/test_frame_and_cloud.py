import numpy as np
import pytest

import registration
from reach.errors import InvalidInputError
from reach.transforms import make_transform
from registration import DepthFrame, Intrinsics
from registration.cloud import frame_from_cloud

CAMERA = Intrinsics(80, 60, 100.0, 110.0, 41.5, 28.25)


def ramp() -> np.ndarray:
    """Depths that differ in both directions, with a hole."""
    v, u = np.indices((60, 80))
    depth = (0.5 + 1e-3 * u + 2e-3 * v).astype(np.float32)
    depth[10:20, 30:35] = np.nan
    return depth


def test_every_public_name_is_there():
    for name in registration.__all__:
        assert getattr(registration, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = registration.nothing


def test_a_frame_refuses_what_is_not_a_depth_image():
    T = make_transform()
    with pytest.raises(InvalidInputError, match="shape"):
        DepthFrame(np.ones((3, 4), np.float32), CAMERA, T)
    with pytest.raises(InvalidInputError, match="use NaN"):
        DepthFrame(np.zeros((60, 80), np.float32), CAMERA, T)
    with pytest.raises(InvalidInputError, match="unknown sensor 'sonar'"):
        DepthFrame(ramp(), CAMERA, T, sensor="sonar")


def test_points_project_back_to_their_pixels():
    frame = DepthFrame(ramp(), CAMERA, make_transform())
    points = frame.points_camera()
    v, u = 33, 12
    x, y, z = points[v, u]
    assert u == pytest.approx(CAMERA.fx * x / z + CAMERA.cx)
    assert v == pytest.approx(CAMERA.fy * y / z + CAMERA.cy)
    assert np.isnan(points[15, 32]).all()


def test_a_cloud_in_any_order_gives_its_image_back():
    depth = ramp()
    points = DepthFrame(depth, CAMERA, make_transform()).points_camera().reshape(-1, 3)
    shuffled = np.random.default_rng(0).permutation(points)
    frame = frame_from_cloud(shuffled, CAMERA, make_transform(), sensor="stereo")
    np.testing.assert_allclose(frame.depth, depth, atol=1e-6)
    assert frame.sensor == "stereo"


def test_the_nearest_point_wins_a_pixel():
    points = DepthFrame(ramp(), CAMERA, make_transform()).points_camera().reshape(-1, 3)
    both = np.concatenate([points, 1.2 * points])
    frame = frame_from_cloud(both, CAMERA, make_transform())
    np.testing.assert_allclose(frame.depth, ramp(), atol=1e-6)


def test_a_thinned_cloud_becomes_a_coarser_image_of_the_same_scene():
    points = DepthFrame(ramp(), CAMERA, make_transform()).points_camera().reshape(-1, 3)
    thinned = points[np.random.default_rng(1).random(len(points)) < 0.1]
    frame = frame_from_cloud(thinned, CAMERA, make_transform())
    assert frame.intrinsics.width < CAMERA.width / 2
    seen = frame.points_camera()
    v, u = np.argwhere(np.isfinite(seen[..., 2]))[40]
    # The scene is z = 0.5 + 1e-3 u + 2e-3 v of the original camera.
    x, y, z = seen[v, u]
    fine_u, fine_v = CAMERA.fx * x / z + CAMERA.cx, CAMERA.fy * y / z + CAMERA.cy
    assert z == pytest.approx(0.5 + 1e-3 * fine_u + 2e-3 * fine_v, abs=5e-3)


def test_a_cloud_beside_the_image_is_refused():
    with pytest.raises(InvalidInputError, match="lies in its 80 x 60 image"):
        frame_from_cloud(np.array([[5.0, 0.0, 1.0]]), CAMERA, make_transform())
