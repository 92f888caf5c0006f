from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from collection.errors import DuplicateNameError
from collection.objects import CATALOG, OBJECT_NAMES, load_object, load_objects
from collection.objects.export import export_parts
from collection.objects.mesh_file import mesh_notes
from collection.objects.printing import PrintSettings, printed_mass
from collection.sampling import sample_grasps
from reach.errors import InvalidMeshError, UnknownNameError
from reach.gripper import ParallelJawGripper
from reach.stable_poses import stable_poses
from reach.symmetry import symmetry


def test_there_are_twenty_one_parts_of_the_paper_s_size():
    faces = [len(load_object(name).faces) for name in OBJECT_NAMES]
    assert len(OBJECT_NAMES) == len(set(OBJECT_NAMES)) == 21
    assert min(faces) == 12 and 2500 < max(faces) <= 3400
    assert 1000 < np.mean(faces) < 1400


@pytest.mark.parametrize("name", OBJECT_NAMES)
def test_a_built_in_part_is_one_printable_solid(name):
    part = load_object(name)
    assert part.name == name and CATALOG[name].challenge
    assert part.mesh.is_watertight and part.mesh.body_count == 1
    assert mesh_notes(part) == []
    np.testing.assert_allclose(part.com, 0, atol=1e-9)
    extents = np.ptp(part.vertices, axis=0)
    assert 3.9e-3 < extents.min() and extents.max() < 0.08
    assert 2e-3 < part.mass < 0.012


@pytest.mark.parametrize("name", OBJECT_NAMES)
def test_a_built_in_part_can_be_held_in_some_stable_pose(name):
    part = load_object(name)
    gripper = ParallelJawGripper.yumi()
    assert any(
        sample_grasps(part, gripper, pose, count=1, rng=np.random.default_rng(0)).grasps
        for pose in stable_poses(part)
    )


def test_cube_3cm_is_a_plain_cube():
    cube = load_object("cube_3cm")
    assert len(cube.vertices) == 8 and len(cube.faces) == 12
    np.testing.assert_allclose(np.abs(cube.vertices), 0.015)


@pytest.mark.parametrize(
    ("name", "order"),
    [("cube_3cm", 24), ("near_cube", 4), ("bracket", 1), ("star", 10), ("gear", 5), ("turbine", 7)],
)
def test_parts_have_the_symmetry_they_are_drawn_with(name, order):
    assert len(symmetry(load_object(name)).rotations) == order


@pytest.mark.parametrize("name", ["cylinder", "egg", "pawn", "vase", "bowl", "cup"])
def test_turned_parts_are_round(name):
    assert symmetry(load_object(name)).axis is not None


def test_printed_mass_counts_walls_and_infill():
    cube = load_object("cube_3cm")
    shell = 6 * 0.03**2 * 4e-4
    expected = 1240 * (shell + 0.05 * (0.03**3 - shell))
    assert cube.mass == pytest.approx(expected)
    solid = printed_mass(cube.vertices, cube.faces, PrintSettings(infill=1.0))
    assert solid == pytest.approx(1240 * 0.03**3)
    thick = printed_mass(cube.vertices, cube.faces, PrintSettings(wall=0.05))
    assert thick == pytest.approx(1240 * 0.03**3), "a wall cannot hold more than the part"


def test_a_mass_that_was_weighed_is_kept():
    assert load_object("cube_3cm", mass=0.003).mass == 0.003


def test_export_writes_millimeters_masses_and_pictures(tmp_path):
    parts = load_objects(["cube_3cm", "mug"])
    export_parts(parts, [{"name": p.name, "mass": p.mass} for p in parts], tmp_path / "prints")
    for part in parts:
        mesh = trimesh.load_mesh(tmp_path / "prints" / f"{part.name}.stl")
        assert mesh.is_watertight and len(mesh.faces) == len(part.faces)
        assert mesh.volume == pytest.approx(part.volume * 1e9, rel=1e-5)
        again = load_object(tmp_path / "prints" / f"{part.name}.stl", mesh_unit="mm")
        assert again.mass == pytest.approx(part.mass, rel=1e-5)
        np.testing.assert_allclose(again.com, part.com, atol=1e-8)
    masses = json.loads((tmp_path / "prints" / "masses.json").read_text())
    assert masses == {"unit": "g", "masses": {p.name: round(p.mass * 1e3, 2) for p in parts}}
    from PIL import Image

    with Image.open(tmp_path / "prints" / "objects.png") as sheet:
        assert len(sheet.convert("RGB").getcolors()) > 20


def test_names_are_resolved_or_refused(tmp_path):
    assert [part.name for part in load_objects(["all"])] == list(OBJECT_NAMES)
    with pytest.raises(UnknownNameError, match=r"'cube'.*cube_3cm"):
        load_object("cube")
    with pytest.raises(InvalidMeshError, match="no mesh file"):
        load_object(tmp_path / "none.stl")
    with pytest.raises(DuplicateNameError, match="mug"):
        load_objects(["mug", "all"])


def write(path, mesh: trimesh.Trimesh):
    mesh.export(path)
    return path


def box(size, at=(0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(at)
    return mesh


def refused(path, **kwargs) -> str:
    with pytest.raises(InvalidMeshError) as error:
        load_object(path, **kwargs)
    message = str(error.value)
    assert "\n" not in message
    return message


def test_overlapping_solids_are_joined(tmp_path):
    pair = trimesh.util.concatenate([box((0.02,) * 3), box((0.02,) * 3, (0.01, 0.001, 0.002))])
    part = load_object(write(tmp_path / "pair.stl", pair))
    overlap = 0.01 * 0.019 * 0.018
    assert part.volume == pytest.approx(2 * 0.02**3 - overlap, rel=1e-6)
    assert part.mesh.body_count == 1
    assert part.mass == pytest.approx(printed_mass(part.vertices, part.faces))


def test_a_piece_turned_inside_out_is_refused(tmp_path):
    second = box((0.01,) * 3, (0.012, 0.001, 0.002))
    second.invert()
    pair = trimesh.util.concatenate([box((0.02,) * 3), second])
    assert "turned inside out" in refused(write(tmp_path / "pair.stl", pair))


def test_pieces_that_do_not_touch_are_refused(tmp_path):
    pair = trimesh.util.concatenate([box((0.02,) * 3), box((0.02,) * 3, (0.05, 0, 0))])
    assert "2 pieces" in refused(write(tmp_path / "pair.stl", pair))


def test_an_open_mesh_is_refused(tmp_path):
    sphere = trimesh.creation.icosphere(2, radius=0.02)
    sphere.update_faces(sphere.triangles_center[:, 2] < 0.005)
    assert "not watertight" in refused(write(tmp_path / "open.stl", sphere))


def test_a_flat_mesh_is_refused(tmp_path):
    flat = trimesh.Trimesh(
        [(0, 0, 0), (0.02, 0, 0), (0.02, 0.02, 0), (0, 0.02, 0)],
        [(0, 1, 2), (0, 2, 3), (0, 2, 1), (0, 3, 2)],
    )
    refused(write(tmp_path / "flat.stl", flat))


def test_absurd_sizes_hint_at_the_unit(tmp_path):
    assert "--mesh-unit mm" in refused(write(tmp_path / "in_mm.stl", box((30, 30, 30))))
    assert "--mesh-unit" in refused(write(tmp_path / "dust.stl", box((1e-4,) * 3)))


def test_a_surface_through_itself_is_noted(tmp_path):
    ball = trimesh.creation.icosphere(2, radius=0.015)
    vertices = np.array(ball.vertices)
    top = vertices[:, 2].argmax()
    vertices[top] *= -1.5  # the pole is pushed out through the other side
    path = write(tmp_path / "folded.stl", trimesh.Trimesh(vertices, ball.faces, process=False))
    notes = mesh_notes(load_object(path))
    assert len(notes) == 1 and "intersects itself" in notes[0]


def test_a_thin_part_is_noted(tmp_path):
    part = load_object(write(tmp_path / "sheet.stl", box((0.03, 0.03, 5e-4))))
    assert any("thinner" in note for note in mesh_notes(part))
