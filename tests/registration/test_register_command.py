import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from collection.cameras.frame_files import write_frame
from collection.cli.register import register
from reach.errors import ReachError


@pytest.fixture(scope="module")
def app():
    app = typer.Typer()
    app.command()(register)
    return app


@pytest.fixture(scope="module")
def scene(tmp_path_factory, parts, scenes):
    """A case with its mesh, frame, clouds and camera file on disk."""
    import open3d

    folder = tmp_path_factory.mktemp("clouds")
    rng = np.random.default_rng(5)
    case = scenes.make_case(parts["bar_clamp"], rng, scenes.SceneSettings(), stable_pose=0)
    case.obj.mesh.export(folder / "part.stl")
    frame = case.frame
    write_frame(folder / "frame.npz", frame, T_world_camera=frame.T_world_camera)
    write_frame(folder / "no_pose.npz", frame)
    points = frame.points_camera().reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    open3d.io.write_point_cloud(str(folder / "cloud.ply"), cloud)
    open3d.io.write_point_cloud(str(folder / "cloud.pcd"), cloud)
    k = frame.intrinsics
    camera = {
        "intrinsics": {n: getattr(k, n) for n in ("width", "height", "fx", "fy", "cx", "cy")},
        "T_world_camera": frame.T_world_camera.tolist(),
    }
    (folder / "camera.json").write_text(json.dumps(camera))
    return folder, case


def run(app, *arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)


@pytest.mark.parametrize("cloud", ["frame.npz", "cloud.ply", "cloud.pcd"])
def test_every_kind_of_file_gives_the_pose(app, scene, is_right, cloud):
    folder, case = scene
    given = [] if cloud == "frame.npz" else ["--camera", folder / "camera.json"]
    answer = run(app, "--mesh", folder / "part.stl", "--cloud", folder / cloud, *given, "--json")
    assert answer.exit_code == 0
    found = json.loads(answer.stdout)
    assert found["accepted"] and found["stable_pose"] == 0
    assert is_right(case, np.array(found["T_camera_object"]))
    assert np.array(found["covariance"]).shape == (6, 6)
    expected = case.frame.T_world_camera @ np.array(found["T_camera_object"])
    np.testing.assert_allclose(found["T_world_object"], expected, atol=1e-9)


def test_a_picture_of_the_overlay_is_drawn(app, scene):
    from PIL import Image

    folder, _ = scene
    picture = folder / "overlay.png"
    answer = run(
        app,
        *("--mesh", folder / "part.stl", "--cloud", folder / "frame.npz"),
        *("--stable-pose", 0, "--picture", picture),
    )
    assert answer.exit_code == 0 and "accepted, stable pose 0" in answer.stdout
    with Image.open(picture) as image:
        colors = np.asarray(image.convert("RGB")).astype(int)
    green = (colors[..., 1] > 120) & (colors[..., 0] < 80) & (colors[..., 2] < 100)
    assert green.sum() > 200  # the outline of the pose


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--cloud", "nothing.npz"), "no file at"),
        (("--cloud", "{folder}/part.stl"), "valid: .npz, .ply, .pcd"),
        (("--cloud", "{folder}/cloud.ply"), "give --camera"),
        (("--cloud", "{folder}/no_pose.npz"), "holds no T_world_camera"),
        (("--cloud", "{folder}/frame.npz", "--stable-pose", "9"), "needs a stable pose"),
        (("--cloud", "{folder}/frame.npz", "--mode", "guess"), "unknown registration mode"),
        (("--cloud", "{folder}/frame.npz", "--sensor", "sonar"), "unknown sensor"),
        (("--cloud", "{folder}/frame.npz", "--picture", "a.gif"), "valid: .png"),
        (("--cloud", "{folder}/cloud.ply", "--camera", "{folder}/part.stl"), "camera file"),
    ],
)
def test_bad_input_is_one_clear_error(app, scene, arguments, message):
    folder, _ = scene
    arguments = [argument.format(folder=folder) for argument in arguments]
    with pytest.raises(ReachError, match=message) as error:
        run(app, "--mesh", folder / "part.stl", *arguments)
    assert "\n" not in str(error.value)


def test_a_camera_file_with_a_wrong_field_names_it(app, scene):
    folder, case = scene
    bad = folder / "bad.json"
    bad.write_text(json.dumps({"T_world_camera": np.eye(4).tolist(), "focal": 3}))
    with pytest.raises(ReachError, match="focal"):
        run(app, "--mesh", folder / "part.stl", "--cloud", folder / "frame.npz", "--camera", bad)


def test_a_cloud_in_world_coordinates_and_millimeters(app, scene, is_right):
    import open3d

    folder, case = scene
    points = case.frame.points_camera().reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    T = case.frame.T_world_camera
    world = 1e3 * (points @ T[:3, :3].T + T[:3, 3])
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(world))
    open3d.io.write_point_cloud(str(folder / "world.ply"), cloud)
    camera = json.loads((folder / "camera.json").read_text())
    (folder / "world.json").write_text(
        json.dumps(camera | {"cloud_frame": "world", "unit": "mm", "sensor": "structured-light"})
    )
    answer = run(
        app,
        *("--mesh", folder / "part.stl", "--cloud", folder / "world.ply"),
        *("--camera", folder / "world.json", "--json"),
    )
    assert is_right(case, np.array(json.loads(answer.stdout)["T_camera_object"]))


def test_millimeters_taken_for_meters_are_told(app, scene):
    import open3d

    folder, case = scene
    points = case.frame.points_camera().reshape(-1, 3)
    points = 1e3 * points[np.isfinite(points).all(axis=1)]
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    open3d.io.write_point_cloud(str(folder / "mm.ply"), cloud)
    with pytest.raises(ReachError, match='probably in millimeters: say "unit": "mm"'):
        given = ("--camera", folder / "camera.json")
        run(app, "--mesh", folder / "part.stl", "--cloud", folder / "mm.ply", *given)
    flipped = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(-points / 1e3))
    open3d.io.write_point_cloud(str(folder / "flipped.ply"), flipped)
    with pytest.raises(ReachError, match="behind the camera"):
        run(app, "--mesh", folder / "part.stl", "--cloud", folder / "flipped.ply", *given)
