import numpy as np
import pytest

from reach.symmetry import symmetry
from reach.transforms import exp, inverse, make_transform, rotation_about
from registration.alignment import align_planar, align_rigid
from registration.hypotheses import free_starts, planar_starts
from registration.mesh_model import mesh_model
from registration.polish import _residuals
from registration.resting import nearest_stable_pose, stood_up
from registration.unobservable import unobservable_directions

SCALES = np.geomspace(10e-3, 1e-3, 14)


def grid_of(model):
    return model.sdf.values, model.sdf.origin, 1 / model.sdf.spacing


def test_the_planar_fit_finds_the_turn_and_place(parts):
    model = mesh_model(parts["bar_clamp"])
    truth = make_transform(rotation_about((0, 0, 1), 0.4), (0.02, -0.01, 0.0))
    points = model.samples[::4] @ truth[:3, :3].T + truth[:3, 3]
    start = make_transform(rotation_about((0, 0, 1), 0.3), (0.026, -0.004, 0.0))
    found, loss = align_planar(*grid_of(model), points, np.array(start)[None], SCALES)
    difference = inverse(truth) @ found[0]
    assert np.linalg.norm(difference[:3, 3]) < 2e-4
    assert np.arccos((np.trace(difference[:3, :3]) - 1) / 2) < 2e-3
    assert found[0, 2, 3] == 0.0 and found[0, 2, 2] == pytest.approx(1.0)
    assert loss[0] < 0.02


def test_the_rigid_fit_finds_all_six(parts):
    model = mesh_model(parts["chiral_stair"])
    truth = exp([0.5, -0.3, 0.8, 0.03, 0.02, -0.05])
    points = model.samples[::4] @ truth[:3, :3].T + truth[:3, 3]
    start = truth @ exp([0.08, -0.05, 0.06, 3e-3, -2e-3, 4e-3])
    found, _ = align_rigid(*grid_of(model), points, start[None], SCALES, np.full(6, 1e-9))
    difference = inverse(truth) @ found[0]
    assert np.linalg.norm(difference[:3, 3]) < 3e-4
    assert np.abs(found[0, :3, :3].T @ found[0, :3, :3] - np.eye(3)).max() < 1e-9


def test_exact_residuals_have_the_right_jacobian(parts):
    model = mesh_model(parts["bracket"])
    T = exp([0.2, 0.1, -0.4, 0.01, 0.02, 0.5])
    rng = np.random.default_rng(3)
    offset = rng.normal(scale=4e-4, size=model.samples[::20].shape)
    points = (model.samples[::20] + offset) @ T[:3, :3].T + T[:3, 3]
    residual, jacobian = _residuals(model, points, T)
    inner = np.abs(residual) > 1e-4  # single precision swamps finite differences closer in
    for i in range(6):
        xi = np.zeros(6)
        xi[i] = 1e-4
        ahead, _ = _residuals(model, points, T @ exp(xi))
        back, _ = _residuals(model, points, T @ exp(-xi))
        slope = (ahead - back) / 2e-4
        error = np.abs(slope - jacobian[:, i])[inner]
        assert np.quantile(error, 0.9) < 0.02  # the nearest face changes for a few points


def test_starts_are_rigid_and_spread(parts):
    from reach.stable_poses import stable_poses

    poses = stable_poses(parts["bracket"])
    planar = planar_starts(poses)
    assert planar.shape == (72 * len(poses), 4, 4)
    up = planar[72:144, 2, :3]
    np.testing.assert_allclose(up, np.broadcast_to(poses[1].T_world_object[2, :3], up.shape))
    free = free_starts(np.array([0.01, 0.02, 0.03]))
    np.testing.assert_allclose(
        free[:, :3, :3] @ free[:, :3, :3].transpose(0, 2, 1),
        np.broadcast_to(np.eye(3), (len(free), 3, 3)),
        atol=1e-12,
    )
    np.testing.assert_allclose(free[:, :3, :3] @ [0.01, 0.02, 0.03] + free[:, :3, 3], 0, atol=1e-12)
    # No orientation is further than 20 degrees from a start.
    rng = np.random.default_rng(0)
    for _ in range(50):
        R = exp(np.concatenate([rng.normal(size=3), np.zeros(3)]))[:3, :3]
        cosine = ((free[:, :3, :3] * R).sum(axis=(1, 2)) - 1) / 2
        assert np.degrees(np.arccos(cosine.max())) < 20


def test_a_leaning_part_is_set_into_its_stable_pose(parts):
    from reach.stable_poses import stable_poses

    obj = parts["pawn"]
    model, sym = mesh_model(obj), symmetry(obj)
    pose = stable_poses(obj)[0]
    # A camera frame that is not aligned with the table, and a pawn turned about its own axis.
    T_camera_table = exp([2.5, 0.3, -0.2, 0.1, 0.0, 0.5])
    axis_table = pose.T_world_object[:3, 2]  # about which a pawn may roll without leaning
    across = np.cross((0, 0, 1), axis_table) if abs(axis_table[2]) < 0.9 else (1.0, 0, 0)
    lean = rotation_about(across, np.radians(5))
    T = T_camera_table @ make_transform(lean, (0.03, 0.01, 0.004)) @ pose.T_world_object
    up = T_camera_table[:3, 2]
    index, tilt = nearest_stable_pose(T, up, stable_poses(obj), sym)
    assert (index, np.degrees(tilt)) == (0, pytest.approx(5, abs=0.3))
    stood = stood_up(T, up, float(up @ T_camera_table[:3, 3]), pose, sym, model.hull_vertices)
    on_table = inverse(T_camera_table) @ stood
    heights = (obj.vertices @ on_table[:3, :3].T + on_table[:3, 3])[:, 2]
    assert heights.min() == pytest.approx(0, abs=1e-9)
    assert nearest_stable_pose(stood, up, stable_poses(obj), sym)[1] < 1e-6
    np.testing.assert_allclose(stood[:3, :3].T @ stood[:3, :3], np.eye(3), atol=1e-9)


def test_open_directions_are_named():
    strong = np.diag([1e7, 1e7, 1e7, 1e9, 1e9, 1e9])
    assert unobservable_directions(strong, np.zeros(3), 0.03) == ()
    no_turn = np.diag([1e7, 1e7, 1e-3, 1e9, 1e9, 1e9])
    assert unobservable_directions(no_turn, np.zeros(3), 0.03) == ("rotation about the object's z",)
    no_slide = np.diag([1e7, 1e7, 1e7, 1e9, 1.0, 1e9])
    assert unobservable_directions(no_slide, np.zeros(3), 0.03) == (
        "translation along the object's y",
    )
