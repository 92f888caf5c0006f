"""Convex parts, pin beds, and the model they make."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh

from reach.errors import InvalidInputError
from reach.gripper import Pad, ParallelJawGripper
from reach.objects import GraspObject
from reach.world.decomposition import convex_parts
from reach.world.grasp_model import grasp_model
from reach.world.pads import pin_bed
from reach.world.parameters import WorldParameters


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("REACH_CACHE", str(tmp_path))
    return tmp_path


def tee() -> GraspObject:
    """Two bars that meet: plainly not convex."""
    bars = [trimesh.creation.box((0.06, 0.01, 0.01)), trimesh.creation.box((0.01, 0.01, 0.05))]
    bars[1].apply_translation((0, 0, -0.03))
    solid = trimesh.boolean.union(bars, engine="manifold")
    return GraspObject("tee", solid.vertices, solid.faces, 0.01)


def test_a_convex_part_is_its_own_hull(own_cache: Path) -> None:
    mesh = trimesh.creation.icosphere(1, 0.02)
    (vertices, faces), *others = convex_parts(GraspObject("ball", mesh.vertices, mesh.faces, 0.01))
    assert not others
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(mesh.volume)


def test_parts_of_a_tee_are_convex_and_fill_it(own_cache: Path) -> None:
    obj = tee()
    parts = [trimesh.Trimesh(v, f) for v, f in convex_parts(obj)]
    assert len(parts) >= 2
    for part in parts:
        assert part.is_convex
    filled = sum(part.volume for part in parts)
    hull = obj.mesh.convex_hull.volume
    assert obj.volume * 0.98 < filled < obj.volume * 1.15 < hull


def test_a_second_load_comes_from_the_cache(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = convex_parts(tee())
    assert len(list(own_cache.rglob("*.npz"))) == 1

    def refuse(_: GraspObject) -> None:
        raise AssertionError("decomposed twice")

    monkeypatch.setattr("reach.world.decomposition._decompose", refuse)
    second = convex_parts(tee())
    for (v1, f1), (v2, f2) in zip(first, second, strict=True):
        np.testing.assert_array_equal(v1, v2)
        np.testing.assert_array_equal(f1, f2)


def test_a_moved_vertex_is_another_entry(own_cache: Path) -> None:
    convex_parts(tee())
    grown = GraspObject("tee", tee().vertices * 1.01, tee().faces, 0.01)
    convex_parts(grown)
    assert len(list(own_cache.rglob("*.npz"))) == 2


def test_pins_carry_the_pads_area_at_its_centroid() -> None:
    pad = ParallelJawGripper.yumi().jaws[0].pad
    bed = pin_bed(pad)
    assert len(bed.centers) == 35
    assert bed.areas.sum() == pytest.approx(pad.area)
    from shapely import Polygon

    centroid = Polygon(pad.polygon).centroid
    middle = bed.areas @ bed.centers / bed.areas.sum()
    np.testing.assert_allclose(middle, (centroid.x, centroid.y), atol=1e-6)


def test_pins_of_a_triangle_stay_inside() -> None:
    pad = Pad(np.array([(-0.01, -0.01), (0.01, 0.0), (-0.01, 0.01)]))
    from shapely import Point, Polygon

    outline = Polygon(pad.polygon)
    bed = pin_bed(pad)
    assert all(outline.contains(Point(*center)) for center in bed.centers)
    assert bed.areas.sum() == pytest.approx(pad.area)


def test_the_model_has_the_objects_mass_properties(own_cache: Path) -> None:
    obj = tee()
    model = grasp_model(obj, ParallelJawGripper.yumi(), WorldParameters()).model
    body = model.body("object")
    assert body.mass[0] == pytest.approx(obj.mass)
    np.testing.assert_allclose(body.ipos, obj.com, atol=1e-12)
    expected = np.linalg.eigvalsh(obj.mesh.moment_inertia * obj.mass / obj.volume)
    np.testing.assert_allclose(np.sort(body.inertia), expected, rtol=1e-6)


def test_world_parameters_refuse_nonsense() -> None:
    with pytest.raises(InvalidInputError, match="friction"):
        WorldParameters(friction=-0.1)
    with pytest.raises(InvalidInputError, match="timestep"):
        WorldParameters(timestep=0.0)


PUBLISHED = Path(os.environ.get("REACH_PUBLISHED", Path(__file__).parents[3] / "shared" / "data"))


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason=f"no published meshes in {PUBLISHED}")
@pytest.mark.parametrize("name", ["cube_3cm", "robosuite_lemon"])
def test_published_convex_meshes_stay_whole(name: str, own_cache: Path) -> None:
    obj = GraspObject.load(PUBLISHED / "meshes" / f"{name}.obj")
    ((vertices, faces),) = convex_parts(obj)
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(obj.volume, rel=6e-3)
