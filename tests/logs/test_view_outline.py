"""Outlines of parts: sharp edges of angular ones, the rim of round ones."""

import numpy as np
import pytest
import trimesh

from logs.view.outline import outline

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("finer", [0, 2])
def test_a_box_is_told_from_its_twelve_edges(finer):
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    for _ in range(finer):
        box = box.subdivide()
    ends = outline(box.triangles, UP)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert len(ends) == 12 * 2**finer
    assert lengths.sum() == pytest.approx(4 * (0.02 + 0.03 + 0.04))


def test_a_round_part_is_told_from_its_rim():
    ends = outline(trimesh.creation.icosphere(3, 0.02).triangles, UP)
    points, degree = np.unique(ends.reshape(-1, 3).round(9), axis=0, return_counts=True)
    assert set(degree) == {2}  # a closed curve
    assert np.abs(points[:, 2]).max() < 0.002
    assert np.linalg.norm(points, axis=1) == pytest.approx(0.02, rel=0.01)


def test_an_open_surface_ends_in_its_border():
    triangle = np.array([[[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]]], float)
    assert len(outline(triangle, UP)) == 3
