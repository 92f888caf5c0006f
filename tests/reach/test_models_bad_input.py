"""Nonsense is refused with a typed error that names the value: never a silent False."""

import numpy as np
import pytest
import trimesh

from reach import (
    AreaContact,
    EllipseContact,
    Grasp,
    GraspObject,
    ParallelJawGripper,
    PointContact,
    Scene,
)
from reach.errors import InvalidInputError, InvalidMeshError, InvalidTransformError
from reach.models.reference import ReferenceAreaContact

MODELS = [AreaContact, EllipseContact, PointContact, ReferenceAreaContact]


def scene():
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    part = GraspObject("cube", mesh.vertices, mesh.faces, 0.01)
    return Scene(part, ParallelJawGripper.yumi(), np.eye(4))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("friction", [-0.1, np.nan, np.inf])
def test_friction_is_finite_and_not_negative(model, friction):
    with pytest.raises(InvalidInputError, match=f"friction is .*{friction}"):
        model(friction=friction)


@pytest.mark.parametrize(
    ("model", "parameters", "named"),
    [
        (AreaContact, {"compliance": 0.0}, "compliance"),
        (EllipseContact, {"compliance": -1e-4}, "compliance"),
        (PointContact, {"torsion": np.nan}, "torsion"),
        (ReferenceAreaContact, {"triangles": 0}, "triangles"),
        (AreaContact, {"margin_cap": 0}, "margin_cap"),
        (AreaContact, {"compliance": None}, "compliance .* is None"),
        (PointContact, {"friction": "rough"}, "friction is 'rough'"),
    ],
)
def test_other_parameters(model, parameters, named):
    with pytest.raises(InvalidInputError, match=named):
        model(**parameters)


@pytest.mark.parametrize("model", [model() for model in MODELS], ids=lambda model: model.name)
def test_batches_are_checked(model):
    T = np.tile(np.eye(4), (3, 1, 1))
    bad = T.copy()
    bad[1, 0, 3] = np.nan
    with pytest.raises(InvalidTransformError, match=r"T_object_gripper\[1\]"):
        model.evaluate_batch(scene(), bad)
    with pytest.raises(InvalidTransformError, match=r"T_object_gripper\[0\]"):
        model.evaluate_batch(scene(), T * 2)
    with pytest.raises(InvalidTransformError, match="shape"):
        model.evaluate_batch(scene(), np.eye(3))
    with pytest.raises(InvalidInputError, match="mass"):
        model.evaluate_batch(scene(), T, mass=[0.1, 0.0, 0.1])
    with pytest.raises(InvalidInputError, match="friction"):
        model.evaluate_batch(scene(), T, friction=-0.5)
    with pytest.raises(InvalidInputError, match="force"):
        model.evaluate_batch(scene(), T, force=[1.0, 2.0])
    with pytest.raises(InvalidInputError, match="center of mass"):
        model.evaluate_batch(scene(), T, com=(0, 0, np.nan))
    with pytest.raises(InvalidInputError, match=r"center of mass has shape \(2,\)"):
        model.evaluate_batch(scene(), T, com=(0, 0))
    with pytest.raises(InvalidInputError, match="friction is not numeric: 'rough'"):
        model.evaluate_batch(scene(), T, friction="rough")
    assert len(model.evaluate_batch(scene(), np.empty((0, 4, 4)))) == 0


def test_degenerate_triangles_inside_a_closed_mesh_do_no_harm():
    """A box with a vertex on an edge, joined by slivers of zero area."""
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    a, b, c = faces[0]
    split = len(vertices)
    vertices = np.vstack([vertices, (vertices[a] + vertices[b]) / 2])
    # Cut one face at the edge's middle; the neighbor keeps its edge, and a sliver closes the gap.
    faces = np.vstack([faces[1:], [(a, split, c), (split, b, c), (a, b, split)]])
    part = GraspObject("slivers", vertices, faces, 0.01)
    whole = scene()
    grasp = Grasp(np.array([[1, 0, 0, 0], [0, 1, 0, 0.002], [0, 0, 1, -0.16], [0, 0, 0, 1.0]]))
    for model in MODELS:
        with_sliver = model().evaluate(Scene(part, whole.gripper, np.eye(4)), grasp)
        without = model().evaluate(whole, grasp)
        assert with_sliver.resists == without.resists
        assert with_sliver.margin == pytest.approx(without.margin, rel=1e-2)


def test_a_file_of_triangles_without_area_is_refused(tmp_path):
    path = tmp_path / "line.stl"
    line = trimesh.Trimesh([(0, 0, 0), (0.01, 0, 0), (0.02, 0, 0)], [(0, 1, 2)], process=False)
    line.export(path)
    with pytest.raises(InvalidMeshError, match="line.stl.* only triangles without area"):
        GraspObject.load(path, mass=0.01)


@pytest.mark.parametrize("model", [AreaContact, EllipseContact, PointContact])
def test_kernels_are_compiled_once_whatever_the_arrays(model):
    """Read-only and writable arrays are different types to numba: grasps carry read-only ones."""
    T = np.eye(4)[None]
    model().evaluate(scene(), Grasp(T[0]))
    model().evaluate_batch(scene(), T)
    T.setflags(write=False)
    model().evaluate_batch(scene(), T, force=np.broadcast_to(10.0, 1), com=scene().object.com)
    assert len(model.kernel.signatures) == 1
