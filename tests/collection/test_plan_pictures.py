"""What a person sees of a plan: coverage, placing instructions, pictures, tables."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from collection.objects import load_object
from collection.pictures import PART_COLOR, View, part_picture
from collection.plan.coverage import Contact, coverage
from collection.plan.placing import how_it_lies, placing_picture
from collection.plan.plan import Plan, make_plan
from collection.plan.table import pose_table, trial_table
from collection.sampling import SamplingOptions
from reach.gripper import ParallelJawGripper

YUMI = ParallelJawGripper.yumi()


@pytest.fixture(scope="module")
def parts():
    return {name: load_object(name) for name in ("cube_3cm", "cylinder", "bracket")}


@pytest.fixture(scope="module")
def plan(parts) -> Plan:
    return make_plan(list(parts.values()), YUMI, grasps=8, repeats=2, seed=2)


def test_coverage_counts_every_grasp_and_both_pads(plan, parts):
    found = coverage(plan.grasps, parts, YUMI)
    assert found.grasps == 24
    for histogram in (found.approach_angle, found.width, found.offset):
        assert sum(histogram.counts) == 24
        assert len(histogram.edges) == len(histogram.counts) + 1
    assert sum(found.contacts.values()) == 48
    assert sum(found.shares.values()) == pytest.approx(1)
    assert set(found.shares) == {kind.value for kind in Contact}


def test_without_jitter_no_pad_misses_and_offsets_are_zero(parts):
    centered = make_plan(
        [parts["cylinder"]],
        YUMI,
        grasps=10,
        repeats=1,
        seed=0,
        options=SamplingOptions(jitter=0.0),
    )
    found = coverage(centered.grasps, parts, YUMI)
    assert found.contacts[Contact.MISS] == 0
    assert found.contacts[Contact.FACE] > 0
    assert found.offset.counts[0] == 10


def test_edges_and_corners_of_a_cube_are_told_from_its_faces(parts):
    from collection.plan.coverage import _Features

    features = _Features.of(parts["cube_3cm"])
    assert features.at(np.array([0.015, 0, 0])) is Contact.FACE
    assert features.at(np.array([0.015, 0.0125, 0])) is Contact.EDGE
    assert features.at(np.array([0.015, 0.0135, 0.0135])) is Contact.CORNER
    round_side = _Features.of(parts["cylinder"])
    assert round_side.at(np.array([0.013, 0, 0])) is Contact.FACE


def test_instructions_tell_height_footprint_and_support(plan, parts):
    cube = plan.objects[0]
    assert how_it_lies(parts["cube_3cm"], cube.poses[0]) == (
        "30 mm high, 30 x 30 mm seen from above, resting on an area of 30 x 30 mm"
    )
    upright = plan.objects[1].poses[1]
    assert "52 mm high, 26 x 26 mm" in how_it_lies(parts["cylinder"], upright)


def test_a_picture_shows_the_part_as_it_lies(plan, parts):
    image = part_picture(
        parts["cube_3cm"],
        plan.objects[0].poses[0].T_world_object,
        View(azimuth=0.0, elevation=np.pi / 2, width=90, height=60),
    )
    assert image.shape == (60, 90, 3)
    brightest = np.array(PART_COLOR) / max(PART_COLOR)
    hue = image / np.maximum(image.max(axis=2, keepdims=True), 1)
    on_part = np.abs(hue - brightest).max(axis=2) < 0.08
    rows, columns = np.nonzero(on_part)
    # Seen from straight above the cube is a square that fills the picture up to its margin.
    assert np.ptp(rows) == pytest.approx(60 / 1.18, abs=2)
    assert np.ptp(columns) == pytest.approx(np.ptp(rows), abs=2)
    assert on_part.sum() == pytest.approx(np.ptp(rows) * np.ptp(columns), rel=0.06)


def test_the_operator_s_picture_is_a_png(plan, parts):
    png = placing_picture(parts["bracket"], plan.objects[2].poses[0])
    with Image.open(io.BytesIO(png)) as picture:
        assert picture.format == "PNG" and picture.size == (320, 240)


def test_tables_list_poses_and_trials(plan, parts):
    poses = pose_table(plan, parts.values())
    assert poses.row_count == sum(len(part.poses) for part in plan.objects)
    assert trial_table(plan).row_count == 48
    assert trial_table(plan, most=5).row_count == 5
