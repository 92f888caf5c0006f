"""The simulated depth cameras: geometry, noise, shadows, calibration, video."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest
import trimesh

from collection.cameras.cell_view import CellView
from collection.cameras.sensor_noise import SENSOR_MODELS, depth_edges, spoil
from collection.cameras.simulated import looking_at
from collection.cell.faults import Fault, FaultKind
from collection.errors import CameraNotConnectedError, CameraTimeoutError
from collection.station.station import PACKAGED, Station, build_station, load_station, parse_station
from reach.objects import GraspObject
from reach.stable_poses import StablePose
from reach.transforms import apply, inverse, make_transform, rotation_angle
from registration.frame import DepthFrame, Intrinsics

MESH = trimesh.creation.box((0.04, 0.03, 0.05))
BLOCK = GraspObject("block", MESH.vertices, MESH.faces, 0.02)
RESTING = StablePose(0, 1.0, make_transform(None, (0, 0, 0.025)))


def station_with(text: str, seed: int = 0) -> Station:
    return build_station(parse_station(text, "test.toml"), text, PACKAGED, seed)


SIMULATED = (PACKAGED / "simulated.toml").read_text()
STEREO = SIMULATED.replace('sensor = "structured-light"', 'sensor = "stereo"')
CALIBRATED = re.sub(r"(calibration_(offset|tilt)) = [0-9.]+", r"\1 = 0.0", SIMULATED)


@pytest.fixture
def station() -> Iterator[Station]:
    with load_station("simulated", seed=1) as each:
        yield each


def captured(station: Station, seed: int = 0) -> DepthFrame:
    assert station.simulation is not None
    station.simulation.place(BLOCK, RESTING, np.random.default_rng(seed))
    return station.camera.capture()


def surface_distance(station: Station, frame: DepthFrame) -> np.ndarray:
    """Signed height of each measured point above table and block, whichever is nearer [m]."""
    assert station.simulation is not None
    points = frame.points_camera().reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])]
    world = apply(frame.T_world_camera, points)
    block = apply(inverse(station.simulation.true_T_world_object()), world)
    outside = np.linalg.norm(np.maximum(np.abs(block) - (0.02, 0.015, 0.025), 0), axis=1)
    inside = np.minimum(np.max(np.abs(block) - (0.02, 0.015, 0.025), axis=1), 0)
    return np.minimum(np.abs(world[:, 2]), np.abs(outside + inside))


def test_points_lie_on_table_and_object() -> None:
    with station_with(CALIBRATED) as station:
        distance = surface_distance(station, captured(station))
    assert len(distance) > 200_000
    assert np.median(distance) < 0.3e-3
    assert np.percentile(distance, 99) < 1.5e-3


def test_stereo_is_coarser_and_noisier() -> None:
    with (
        station_with(CALIBRATED) as fine,
        station_with(CALIBRATED.replace('"structured-light"', '"stereo"')) as coarse,
    ):
        first, second = captured(fine), captured(coarse)
        errors = [np.median(surface_distance(s, f)) for s, f in ((fine, first), (coarse, second))]
    assert second.sensor == "stereo"
    assert errors[1] > 3 * errors[0]
    pitches = [np.median(f.depth[np.isfinite(f.depth)]) / f.intrinsics.fx for f in (first, second)]
    np.testing.assert_allclose(pitches, (0.35e-3, 0.7e-3), rtol=0.1)


def test_the_calibration_errs_once_for_a_station() -> None:
    truth = looking_at((0.80, -0.10, 0.55), (0.38, -0.10, 0.02))
    with load_station("simulated", seed=1) as one, load_station("simulated", seed=2) as two:
        first, again, other = captured(one), captured(one, 1), captured(two)
    np.testing.assert_array_equal(first.T_world_camera, again.T_world_camera)
    assert np.any(first.T_world_camera != other.T_world_camera)
    error = inverse(truth) @ first.T_world_camera
    assert 0 < np.linalg.norm(error[:3, 3]) < 3e-3
    assert 0 < rotation_angle(error[:3, :3]) < 6e-3
    with station_with(CALIBRATED) as exact:
        np.testing.assert_allclose(captured(exact).T_world_camera, truth, atol=1e-12)


def test_frames_of_one_placement_differ_by_noise_only_and_are_seeded() -> None:
    frames = []
    for _ in range(2):
        with load_station("simulated", seed=1) as station:
            frames.append((captured(station, 3), station.camera.capture()))
    (first, next_one), (same, _) = frames
    np.testing.assert_array_equal(first.depth, same.depth)
    both = np.isfinite(first.depth) & np.isfinite(next_one.depth)
    assert 0 < np.abs(first.depth - next_one.depth)[both].mean() < 5e-4
    assert next_one.time_ns > first.time_ns


def test_the_projector_casts_a_shadow_and_the_color_shows_the_object(station: Station) -> None:
    frame = captured(station)
    lost = np.isnan(frame.depth).mean()
    assert 0.006 < lost < 0.10  # more than the scattered dropouts
    assert frame.color is not None
    orange = (frame.color[..., 0] > 1.5 * frame.color[..., 2]) & (frame.color[..., 0] > 60)
    assert 0.005 < orange.mean() < 0.2


def test_an_empty_table_is_seen_as_a_plane(station: Station) -> None:
    frame = station.camera.capture()
    assert np.isfinite(frame.depth).mean() > 0.99


def test_a_camera_must_be_connected() -> None:
    station = load_station("simulated")
    assert station.camera.intrinsics is not None
    assert not station.camera.state().connected
    with pytest.raises(CameraNotConnectedError):
        station.camera.capture()


def test_a_scripted_time_out_happens_once(station: Station) -> None:
    captured(station)
    assert station.simulation is not None
    station.simulation.faults.add(Fault(FaultKind.CAMERA_TIMEOUT, 1))
    before = station.clock.now_ns()
    with pytest.raises(CameraTimeoutError, match="5"):
        station.camera.capture()
    assert station.clock.now_ns() - before >= 5_000_000_000
    station.camera.capture()


def test_a_perfect_view_is_the_plane_and_the_box() -> None:
    camera = Intrinsics(64, 48, 100.0, 100.0, 31.5, 23.5)
    T_world_camera = looking_at((0.0, 0.0, 0.5), (0.0, 0.0, 0.0))
    view = CellView(camera, T_world_camera, np.array([0.1, 0.0, 0.5]), 0.0)
    empty = view.render(None, None)
    np.testing.assert_allclose(empty.depth, 0.5, atol=1e-9)
    seen = view.render(BLOCK, RESTING.T_world_object)
    np.testing.assert_allclose(seen.depth[20:28, 29:35], 0.45, atol=1e-6)
    assert not seen.shadow[20:28, 29:35].any()
    assert seen.shadow.any()
    np.testing.assert_allclose(seen.depth[0], 0.5, atol=1e-9)


def test_correlated_noise_has_the_promised_size() -> None:
    model = SENSOR_MODELS["stereo"]
    flat = np.full((300, 300), 0.7)
    facing = np.ones_like(flat)
    none = np.zeros(flat.shape, dtype=bool)
    noisy = spoil(flat, facing, none, model, 0.7, np.random.default_rng(0))
    error = (noisy - flat)[np.isfinite(noisy)]
    assert np.std(error) == pytest.approx(model.noise, rel=0.1)
    rows = noisy - flat
    pairs = rows[:, :-1] * rows[:, 1:]
    assert np.nanmean(pairs) > 0.8 * model.noise**2  # neighbors err alike


def test_edges_are_where_depth_jumps() -> None:
    depth = np.full((9, 9), 0.5)
    depth[:, 5:] = 0.4
    edges = depth_edges(depth, 2e-3)
    assert edges[:, 4:6].all() and not edges[:, :4].any() and not edges[:, 6:].any()


def test_video_frames_show_the_cell_or_say_why_not(station: Station) -> None:
    camera = station.color_camera
    assert camera is not None
    captured(station)
    frame = camera.frame()
    if frame is None:
        assert "no off-screen renderer" in camera.state().detail
        pytest.skip(camera.state().detail)
    assert frame.image.shape == (240, 320, 3)
    red, blue = frame.image[..., 0].astype(int), frame.image[..., 2].astype(int)
    assert ((red > 2 * blue) & (red > 80)).sum() > 20  # the orange block
    assert station.simulation is not None
    station.arm.move_to_joints(station.arm.description.home + 0.3, speed=_speed())
    moved = camera.frame()
    assert moved is not None and np.any(moved.image != frame.image)


def _speed() -> object:
    from collection.robots.protocol import Speed

    return Speed(0.3)


def test_video_can_be_switched_off() -> None:
    text = SIMULATED.replace(
        'driver = "simulated"      # or "folder"', 'driver = "simulated"\nvideo = false #'
    )
    station = station_with(text)
    assert station.color_camera is None
