import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reach.errors import InvalidInputError, UnknownNameError
from reach.stable_poses import stable_poses
from reach.transforms import make_transform
from registration import DepthFrame, Intrinsics, RegistrationOptions, register

EASY = ("bar_clamp", "bracket", "pawn", "gear", "pipe_tee", "chiral_stair")


@pytest.mark.parametrize("sensor", ["structured-light", "stereo"])
@pytest.mark.parametrize("name", EASY)
def test_a_declared_part_is_found(parts, scenes, is_right, name, sensor):
    rng = np.random.default_rng([3, len(name)])
    case = scenes.make_case(parts[name], rng, scenes.SceneSettings(sensor))
    found = register(case.obj, case.frame, stable_pose=case.stable_pose)
    assert is_right(case, found.T_camera_object)
    assert found.accepted and found.stable_pose == case.stable_pose
    assert found.observed_overlap > 0.85 and found.fitness > 0.85
    assert found.rmse < (3e-4 if sensor == "structured-light" else 3e-3)
    np.testing.assert_allclose(
        found.T_world_object, case.frame.T_world_camera @ found.T_camera_object, atol=1e-12
    )
    assert np.linalg.eigvalsh(found.covariance).min() > 0


@pytest.mark.parametrize("mode", ["any", "free"])
@pytest.mark.parametrize("name", ["bar_clamp", "near_symmetric_box", "chiral_stair"])
def test_a_part_is_found_without_being_declared(parts, scenes, is_right, name, mode):
    rng = np.random.default_rng([8, len(name)])
    case = scenes.make_case(parts[name], rng, scenes.SceneSettings())
    found = register(case.obj, case.frame, mode=mode)
    assert is_right(case, found.T_camera_object)
    assert found.stable_pose == case.stable_pose and not found.contradicts_declared


def test_a_part_put_down_otherwise_than_declared_is_noticed(parts, scenes, is_right):
    case = scenes.make_case(
        parts["bracket"], np.random.default_rng(1), scenes.SceneSettings(), stable_pose=1
    )
    found = register(case.obj, case.frame, stable_pose=0)
    assert found.contradicts_declared and not found.accepted
    assert found.stable_pose == 1 and is_right(case, found.T_camera_object)


def test_without_the_check_only_the_declared_pose_is_searched(parts, scenes):
    case = scenes.make_case(parts["bracket"], np.random.default_rng(1), scenes.SceneSettings())
    options = RegistrationOptions(check_other_poses=False)
    found = register(case.obj, case.frame, stable_pose=case.stable_pose, options=options)
    assert "check other poses" not in found.timings and found.accepted


def test_a_hidden_handle_is_ambiguous_and_the_turns_are_rivals(parts, scenes):
    mug = parts["mug"]
    upright = next(
        pose.index for pose in stable_poses(mug) if abs(pose.T_world_object[2, 2]) > 0.99
    )
    hidden = []
    for seed in range(12):
        case = scenes.make_case(
            mug, np.random.default_rng(seed), scenes.SceneSettings(), stable_pose=upright
        )
        T_camera_object = case.T_camera_object
        # The handle points along the mug's x; the camera looks along its z.
        if T_camera_object[2, 0] > 0.75:
            hidden.append(case)
    assert hidden, "no seed hides the handle"
    for case in hidden[:2]:
        found = register(mug, case.frame, stable_pose=upright)
        assert found.ambiguous and len(found.rivals) >= 1
        assert found.margin < 0.25
        assert found.rivals[0].render_cost < found.render_cost + 0.05


def test_the_same_seed_gives_the_same_bits(parts, scenes):
    case = scenes.make_case(parts["gear"], np.random.default_rng(4), scenes.SceneSettings("stereo"))
    a, b = (register(case.obj, case.frame, mode="any", seed=5) for _ in range(2))
    for name in ("T_camera_object", "covariance"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
    assert (a.render_cost, a.margin, a.seed) == (b.render_cost, b.margin, 5)


THREADS = """
import hashlib, sys
sys.path.insert(0, {root!r})
import numpy as np
from benchmarks.registration_objects import part
from benchmarks.registration_scenes import SceneSettings, make_case
from registration import register
case = make_case(part("bracket"), np.random.default_rng(2), SceneSettings("stereo"))
found = [
    register(case.obj, case.frame, stable_pose=case.stable_pose, seed=1),
    register(case.obj, case.frame, mode="free", seed=1),
]
from benchmarks.registration_holdout import holdout_part
round = make_case(holdout_part("near_sphere", 1), np.random.default_rng(2), SceneSettings("stereo"))
found.append(register(round.obj, round.frame, mode="any", seed=1))
assert found[-1].rivals
digest = hashlib.sha256(case.frame.depth.tobytes())
for r in found:
    digest.update(r.T_world_object.tobytes() + r.covariance.tobytes())
    digest.update(b"".join(rival.T_world_object.tobytes() for rival in r.rivals))
    digest.update(np.array([r.render_cost, r.margin, r.fitness, r.rmse]).tobytes())
print(digest.hexdigest())
"""


def test_one_and_two_threads_give_the_same_bits():
    root = str(Path(__file__).resolve().parents[2])
    digests = set()
    for threads in ("1", "2"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = os.environ | dict.fromkeys(names, threads)
        answer = subprocess.run(
            [sys.executable, "-c", THREADS.format(root=root)],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        digests.add(answer.stdout.strip())
    assert len(digests) == 1


def test_bad_requests_name_the_choices(parts, scenes):
    case = scenes.make_case(parts["cube"], np.random.default_rng(0), scenes.SceneSettings())
    with pytest.raises(UnknownNameError, match="any, declared, free"):
        register(case.obj, case.frame, mode="guess")
    with pytest.raises(InvalidInputError, match="needs a stable pose of 'cube', 0 to 0; got 4"):
        register(case.obj, case.frame, stable_pose=4)
    with pytest.raises(InvalidInputError, match="got None"):
        register(case.obj, case.frame)


def test_a_camera_may_look_straight_down(parts):
    camera = Intrinsics(400, 300, 1200.0, 1200.0, 199.5, 149.5)
    T_world_camera = make_transform(np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 0.6))
    rng = np.random.default_rng(0)
    turn = np.radians(20)
    for others in (0, 1):
        depth = np.full((300, 400), 0.6)
        for x in (0.0, 0.07)[: others + 1]:  # a cube, and half of one beside it
            top = camera.rays()[..., :2] * 0.57 - (x, 0.0)
            along = top @ [np.cos(turn), np.sin(turn)], top @ [-np.sin(turn), np.cos(turn)]
            inside = (np.abs(along[0]) < 0.015) & (np.abs(along[1]) < (0.015 if x == 0 else 0.008))
            depth[inside] = 0.57
        noisy = (depth + 1e-4 * rng.normal(size=depth.shape)).astype(np.float32)
        found = register(parts["cube"], DepthFrame(noisy, camera, T_world_camera), stable_pose=0)
        center = found.T_world_object[:3, :3] @ parts["cube"].com + found.T_world_object[:3, 3]
        np.testing.assert_allclose(center, (0.0, 0.0, 0.015), atol=3e-4)
        sides = found.T_world_object[:2, :3]
        yaw = np.degrees(np.arctan2(sides[1], sides[0])[np.linalg.norm(sides, axis=0) > 0.9])
        assert np.abs((yaw + 20 + 45) % 90 - 45).max() < 1.0
        assert found.accepted


def test_calibration_error_moves_the_world_pose_only(parts, scenes, is_right):
    rng = np.random.default_rng(9)
    settings = scenes.SceneSettings(calibration_error=2e-3)
    case = scenes.make_case(parts["bar_clamp"], rng, settings)
    found = register(case.obj, case.frame, stable_pose=case.stable_pose)
    assert found.accepted and is_right(case, found.T_camera_object)
    T_true = make_case_without_error(scenes, parts["bar_clamp"]).frame.T_world_camera
    off = np.linalg.norm((found.T_world_object - T_true @ case.T_camera_object)[:3, 3])
    assert off == pytest.approx(2e-3, abs=4e-4)


def make_case_without_error(scenes, obj):
    return scenes.make_case(obj, np.random.default_rng(9), scenes.SceneSettings())


def test_real_meshes_are_found(scenes, is_right):
    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = Path(os.environ.get("REACH_DATA", beside)) / "meshes"
    meshes = sorted(folder.glob("*.obj"))
    if not meshes:
        pytest.skip(f"no real meshes in {folder}: set REACH_DATA to a folder with meshes/*.obj")
    from reach import GraspObject

    for path in meshes:
        obj = GraspObject.load(path, mass=0.05)
        case = scenes.make_case(obj, np.random.default_rng(3), scenes.SceneSettings())
        found = register(obj, case.frame, stable_pose=case.stable_pose)
        assert found.ambiguous or is_right(case, found.T_camera_object), path.name


def test_a_frame_of_another_resolution_works_too(parts, scenes, is_right):
    case = scenes.make_case(parts["pipe_tee"], np.random.default_rng(6), scenes.SceneSettings())
    k = case.frame.intrinsics
    half = replace(
        k,
        width=k.width // 2,
        height=k.height // 2,
        fx=k.fx / 2,
        fy=k.fy / 2,
        cx=k.cx / 2,
        cy=k.cy / 2,
    )
    frame = replace(case.frame, depth=case.frame.depth[::2, ::2], intrinsics=half)
    found = register(case.obj, frame, stable_pose=case.stable_pose)
    assert is_right(case, found.T_camera_object)
