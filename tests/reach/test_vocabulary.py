"""Objects, pads and grasps refuse nonsense, and know their own geometry."""

import ast
import importlib
from pathlib import Path

import numpy as np
import pytest
import trimesh

import reach
from reach import Grasp, GraspObject, Pad, ParallelJawGripper, transforms
from reach.errors import (
    InvalidInputError,
    InvalidMeshError,
    InvalidPadError,
    InvalidTransformError,
    UnknownNameError,
)


def box(extents=(0.03, 0.03, 0.03)):
    return trimesh.creation.box(extents)


def test_every_public_name_is_there():
    assert sorted(reach.__all__) == reach.__all__
    for name in reach.__all__:
        assert getattr(reach, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute"):
        reach.nothing  # noqa: B018


def test_what_type_checkers_see_is_what_is_imported():
    """The names imported for type checkers are those of `__all__`, from the same modules."""
    tree = ast.parse(Path(reach.__file__).read_text())
    seen = {
        name.asname: node.module
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        for name in node.names
    }
    assert sorted(seen) == reach.__all__
    for name, module in seen.items():
        assert getattr(importlib.import_module(module), name) is getattr(reach, name)


def test_no_module_of_the_package_bears_a_public_name():
    """Importing it would put the module in the name's place."""
    modules = {path.stem for path in Path(reach.__file__).parent.iterdir()}
    assert not modules & set(reach.__all__)


def test_volume_and_centroid_of_a_shifted_box():
    mesh = box((0.01, 0.02, 0.03))
    part = GraspObject("part", mesh.vertices + [1.0, 2.0, 3.0], mesh.faces, mass=0.01)
    assert part.volume == pytest.approx(6e-6)
    np.testing.assert_allclose(part.com, [1, 2, 3])


def test_mesh_in_millimeters_is_noticed(tmp_path):
    path = tmp_path / "cube.stl"
    box((30, 30, 30)).export(path)
    with pytest.raises(InvalidMeshError, match="--mesh-unit mm"):
        GraspObject.load(path)
    assert GraspObject.load(path, unit="mm").volume == pytest.approx(2.7e-5)
    with pytest.raises(UnknownNameError, match="valid: cm, in, m, mm"):
        GraspObject.load(path, unit="furlong")


def test_open_inverted_and_degenerate_meshes_are_refused():
    mesh = box()
    with pytest.raises(InvalidMeshError, match="not watertight"):
        GraspObject("open", mesh.vertices, mesh.faces[:-1], 0.1)
    with pytest.raises(InvalidMeshError, match="inside out"):
        GraspObject("inverted", mesh.vertices, mesh.faces[:, ::-1], 0.1)
    with pytest.raises(InvalidMeshError, match="flat"):
        GraspObject("flat", mesh.vertices * [1, 1, 0], mesh.faces, 0.1)
    with pytest.raises(InvalidMeshError, match="not finite"):
        GraspObject("nan", mesh.vertices * np.nan, mesh.faces, 0.1)
    with pytest.raises(InvalidMeshError, match="missing vertex"):
        GraspObject("short", mesh.vertices[:4], mesh.faces, 0.1)


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan, np.inf])
def test_mass_is_positive(mass):
    with pytest.raises(InvalidInputError, match="mass"):
        GraspObject("part", box().vertices, box().faces, mass)


def _written(tmp_path, name, change):
    path = tmp_path / name
    mesh = box()
    change(mesh)
    mesh.export(path)
    return path


def _open(mesh):
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)


def _turn_one_face(mesh):
    mesh.faces[0] = mesh.faces[0, ::-1]


@pytest.mark.parametrize(
    ("change", "complaint", "told"),
    [
        (trimesh.Trimesh.invert, "inside out", "turned 12 of 12"),
        (_turn_one_face, "no partner|winding", "turned 1 of 12"),
        (_open, "not watertight", "closed them with 1 triangles"),
    ],
    ids=["inverted", "one face inverted", "open"],
)
def test_reading_refuses_a_bad_surface_and_mends_it_only_on_demand(
    tmp_path, caplog, change, complaint, told
):
    path = _written(tmp_path, "part.stl", change)
    with pytest.raises(InvalidMeshError, match=f"'part'.*({complaint})"):
        GraspObject.load(path)
    assert not caplog.records
    assert GraspObject.load(path, repair=True).volume == pytest.approx(box().volume)
    assert [told in record.getMessage() for record in caplog.records] == [True]


def test_reading_a_sound_file_with_repair_tells_nothing(tmp_path, caplog):
    path = _written(tmp_path, "part.stl", lambda mesh: None)
    assert GraspObject.load(path, repair=True).volume == pytest.approx(box().volume)
    assert not caplog.records


def test_reading_refuses_text_and_absent_files(tmp_path):
    text = tmp_path / "text.stl"
    text.write_text("this is no mesh")
    with pytest.raises(InvalidMeshError, match="text.stl"):
        GraspObject.load(text)
    with pytest.raises(InvalidMeshError, match="no mesh file"):
        GraspObject.load(tmp_path / "absent.stl")


def test_content_hash_follows_geometry_only():
    a = GraspObject("a", box().vertices, box().faces, 0.1)
    b = GraspObject("b", box().vertices, box().faces, 0.2)
    c = GraspObject("a", box().vertices * 1.01, box().faces, 0.1)
    assert a.content_hash == b.content_hash != c.content_hash


def test_yumi_pads_face_each_other_and_meet():
    yumi = ParallelJawGripper.yumi()
    left, right = (yumi.T_gripper_pad(jaw) for jaw in (0, 1))
    np.testing.assert_allclose(left[:3, 2], -right[:3, 2])
    assert np.linalg.norm(left[:3, 3] - right[:3, 3]) == pytest.approx(0.05, abs=1e-5)
    closed = [yumi.T_gripper_pad(jaw, opening=0.0) for jaw in (0, 1)]
    np.testing.assert_allclose(closed[0][:3, 3], closed[1][:3, 3], atol=3e-5)
    for T in (left, right, *closed):
        transforms.as_transform(T)
        np.testing.assert_allclose(T[:3, 0], [0, 0, 1])
    with pytest.raises(InvalidInputError, match="opening"):
        yumi.T_gripper_pad(0, opening=0.06)


def test_yumi_pad_area():
    pad = ParallelJawGripper.yumi().jaws[0].pad
    assert pad.area == pytest.approx((27.5 * 20 - 5 * 5) * 1e-6)
    assert pad.width == pytest.approx(0.020)


@pytest.mark.parametrize(
    "polygon",
    [
        [(0, 0), (1, 0)],
        [(0, 0), (1, 0), (2, 0)],
        [(0, 0), (2, 0), (1, 0.2), (1, 2)],
        [(0, 0, 0), (1, 0, 0), (1, 1, 1)],
        [(0, 0), (1, 0), (1, np.nan)],
        [(np.cos(a), np.sin(a)) for a in 4 * np.pi * np.arange(5) / 5],
    ],
)
def test_bad_pads_are_refused(polygon):
    with pytest.raises(InvalidPadError):
        Pad(np.array(polygon, dtype=float))


def test_clockwise_pads_are_turned():
    assert Pad(np.array([(0, 0), (0, 1), (1, 1), (1, 0)], dtype=float)).area == pytest.approx(1)


def test_grasp_refuses_nan_and_negative_force():
    with pytest.raises(InvalidTransformError, match="T_object_gripper"):
        Grasp(np.full((4, 4), np.nan))
    with pytest.raises(InvalidInputError, match="force"):
        Grasp(np.eye(4), force=-1)
