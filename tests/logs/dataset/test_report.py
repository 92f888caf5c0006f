"""The report stands alone, and its pictures show what they say."""

import base64
import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import trimesh
from PIL import Image

from logs.dataset.labeled_trial import Execution
from logs.report import sections
from logs.report.agreement import OperatorAgreement
from logs.report.curves import pooled, precision_recall_svg, reliability_bins, reliability_svg
from logs.report.drift import drift_svg, measure_drift
from logs.report.page import build_report
from logs.report.pressure import compare_pressure, pressure_svg
from logs.report.reliability_map import ReliabilityPaint, probe_grasps, reliability_color
from logs.report.rendering import corner_normals, object_solid, plate_solid, render
from reach.arrays import frozen
from reach.evaluation.cases import ObjectOutcomes
from reach.evaluation.compare import compare
from reach.gripper import ParallelJawGripper
from reach.models.registry import make_scorer
from reach.objects import GraspObject
from reach.pose_error import PoseError
from reach.transforms import make_transform, rotation_about

ERROR = PoseError.isotropic(translation=1e-3, rotation=3e-3)
YUMI = ParallelJawGripper.yumi()


@pytest.fixture(scope="module")
def dataset(make_dataset):
    made = make_dataset(objects=2, grasps=4, repeats=3)
    return replace(made, name='made <up> & "quoted"')


@pytest.fixture(scope="module")
def result(dataset):
    robust = make_scorer("point-robust", samples=10)
    scorers = [make_scorer("reach"), make_scorer("point"), robust]
    return compare(dataset.cases(), scorers, pose_error=ERROR, use_cache=False)


@pytest.fixture(scope="module")
def page(dataset, result):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("logs.report.page.PROBES", 60)
        agreement = OperatorAgreement(pairs=10, agreed=9, kappa=0.787, interval=(0.41, 0.96))
        return build_report(dataset, result, ERROR, basis="made up", agreement=agreement)


class Collector(HTMLParser):
    """All tags and addresses of a page."""

    VOID = frozenset({"meta", "img", "br", "path", "use", "rect"})

    def __init__(self):
        super().__init__()
        self.tags, self.addresses, self.ids, self.open, self.text = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href"):
                self.addresses.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_startendtag(self, tag, attrs):
        before = len(self.open)
        self.handle_starttag(tag, attrs)
        del self.open[before:]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def parsed(page):
    collector = Collector()
    collector.feed(page)
    assert collector.open == []
    collector.text = re.sub(r"\s+", " ", "".join(collector.text))
    return collector


def test_page_needs_nothing_else(page):
    found = parsed(page)
    assert found.addresses
    for address in found.addresses:
        assert address.startswith(("data:image/png;base64,", "#"))
    assert "script" not in found.tags and "link" not in found.tags
    assert not re.search(r"@import|url\(\s*['\"]?http", page)
    assert len(set(found.ids)) == len(found.ids)
    for address in found.addresses:
        if address.startswith("#"):
            assert address[1:] in found.ids


def test_page_says_what_the_data_say(page, dataset, result):
    found = parsed(page)
    assert "Simulated: 24 of 24 trials" in found.text
    assert 'made <up> & "quoted"' in found.text  # escaped in the source, plain to the reader
    for name, trials in dataset.by_object().items():
        lifted = sum(trial.label.success for trial in trials)
        assert f"{lifted} of {len(trials)} lifted" in found.text
        assert name in found.text
    for row in result.rows:
        assert f"{row.mean['ap']:.2f}" in found.text
    assert "0.82" in found.text  # the paper's AP of point-robust
    assert found.tags.count("svg") == 4  # curves, calibration, pressure, drift
    assert "executed, not labeled 1" in found.text
    assert "agrees with" in found.text


def test_pictures_are_pictures(page):
    found = parsed(page)
    pictures = [a for a in found.addresses if a.startswith("data:")]
    objects = 0
    for address in pictures:
        image = Image.open(io.BytesIO(base64.b64decode(address.split(",")[1])))
        image.load()
        if image.size not in ((360, 300), (520, 420)):
            continue  # a color bar inside a chart
        objects += 1
        alpha = np.asarray(image)[..., 3]
        assert 0.05 < (alpha > 0).mean() < 0.95
    assert objects >= 4  # two parts, two reliability maps


def cube(edge=0.03):
    mesh = trimesh.creation.box((edge, edge, edge))
    return GraspObject("cube", mesh.vertices, mesh.faces, mass=0.02)


def pixels(png):
    return np.asarray(Image.open(io.BytesIO(png))).astype(int)


def test_a_cube_from_above_is_a_square_in_the_middle():
    image = pixels(
        render(
            [object_solid(cube(), np.eye(4), (1, 0, 0))],
            (100, 80),
            azimuth=0.0,
            elevation=np.pi / 2,
        )
    )
    rows, columns = np.nonzero(image[..., 3] > 128)
    assert np.ptp(rows) + 1 == pytest.approx(80 / 1.12, abs=1.5)
    assert np.ptp(columns) == np.ptp(rows)
    assert columns.mean() == pytest.approx(49.5, abs=0.6)
    inside = image[40, 50]
    assert inside[0] > 80 and inside[1] == inside[2] == 0


def test_what_is_nearer_hides_what_is_farther():
    red, blue = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    behind = object_solid(cube(), np.eye(4), red)
    front = object_solid(cube(0.02), make_transform(None, (0, 0, 0.1)), blue)
    for solids in ([behind, front], [front, behind]):
        image = pixels(render(solids, (60, 60), focus=behind.vertices, elevation=np.pi / 2))
        assert image[30, 30, 2] > 80 and image[30, 30, 0] == 0
        assert image[30, 8, 0] > 80


def test_a_translucent_plate_mixes_with_what_is_behind():
    corners = np.array([(-1, -1, 3), (1, -1, 3), (1, 1, 3), (-1, 1, 3)]) * 0.02
    plate = plate_solid(corners, 0.002, (0.0, 0.0, 1.0), opacity=0.5)
    image = pixels(
        render([object_solid(cube(), np.eye(4), (1, 0, 0)), plate], (60, 60), elevation=np.pi / 2)
    )
    assert image[30, 30, 0] > 40 and image[30, 30, 2] > 40


def test_normals_are_sharp_on_a_cube_and_round_on_a_sphere():
    np.testing.assert_allclose(
        corner_normals(cube()), np.repeat(cube().face_normals[:, None], 3, axis=1), atol=1e-12
    )
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.02)
    ball = GraspObject("ball", mesh.vertices, mesh.faces, mass=0.02)
    outward = ball.vertices[ball.faces] / 0.02
    assert np.einsum("fki,fki->fk", corner_normals(ball), outward).min() > 0.999


def test_probe_grasps_close_across_the_part():
    probes = probe_grasps(cube(), YUMI, np.array([0, 0, -1.0]), 200, np.random.default_rng(0))
    assert len(probes.contacts) > 80  # four of six sides can be grasped from above
    gap = probes.contacts[:, 1] - probes.contacts[:, 0]
    np.testing.assert_allclose(np.linalg.norm(gap, axis=1), 0.03, atol=1e-6)
    for T, contacts in zip(probes.T_object_gripper, probes.contacts, strict=True):
        middle = 0.5 * sum((T @ YUMI.T_gripper_pad(jaw))[:3, 3] for jaw in (0, 1))
        np.testing.assert_allclose(middle, contacts.mean(axis=0), atol=1e-9)
        assert T[2, 2] == pytest.approx(-1)  # straight from above


def test_paint_colors_the_side_that_was_probed():
    probes = probe_grasps(cube(), YUMI, np.array([0, 0, -1.0]), 400, np.random.default_rng(0))
    along_x = np.abs(probes.normals[:, 0, 0]) > 0.5
    paint = ReliabilityPaint(probes, along_x.astype(float))
    points = np.array([(0.015, 0, 0), (0, 0.015, 0), (0, 0, 0.015)])
    good, bad, never = paint(points, points / 0.015)
    np.testing.assert_allclose(good, reliability_color(np.array(1.0)), atol=0.02)
    np.testing.assert_allclose(bad, reliability_color(np.array(0.0)), atol=0.02)
    assert np.ptp(never) < 0.06  # gray


def test_bins_by_hand():
    one = ObjectOutcomes("a", frozen([5, 0, 2], np.int64), frozen([5, 5, 5], np.int64))
    score, rate, trials = reliability_bins(one, np.array([1.0, 0.05, 0.97]))
    np.testing.assert_allclose(score, [0.05, 0.985])
    np.testing.assert_allclose(rate, [0.0, 0.7])
    np.testing.assert_allclose(trials, [5, 10])


def test_curves_are_the_same_text_for_the_same_result(result):
    assert precision_recall_svg(result) == precision_recall_svg(result)
    assert reliability_svg(result).startswith("<svg")
    assert pooled(result).trials.sum() == 24


def test_patch_and_pins_agree_for_a_cube_held_at_its_edge():
    from reach.evaluation.cases import GraspCase
    from reach.grasp import Grasp
    from reach.scene import Scene

    rotation = rotation_about((1, 0, 0), np.pi)
    offset = np.array([0.0, 0.012, 0.0])
    height = float(YUMI.T_gripper_pad(0)[2, 3])
    grasp = Grasp(make_transform(rotation, offset - rotation @ (0, 0, height)))
    scene = Scene(cube(), YUMI, make_transform(None, (0.4, 0, 0.015)))
    found = compare_pressure(GraspCase("cube", "g", scene, grasp, 1, 1))
    assert found.patch_forces.sum() == pytest.approx(20, rel=0.02)
    assert found.pin_forces.sum() == pytest.approx(20, rel=0.1)
    assert found.correlation > 0.8
    assert "<svg" in pressure_svg(found)
    away = make_transform(rotation, np.array([0, 0.2, 0]) - rotation @ (0, 0, height))
    assert compare_pressure(GraspCase("cube", "g", scene, Grasp(away), 1, 1)) is None


def test_drift_is_found_where_it_is_and_not_where_it_is_not(dataset):
    def registered(trial, height):
        T = make_transform(None, (0, 0, height)) @ trial.T_world_object
        done = Execution(T_world_object=T, time_ns=trial.number)
        return replace(trial, execution=done, segment=0)

    rng = np.random.default_rng(0)
    noise = rng.normal(0, 1e-4, len(dataset.trials))
    for slope in (0.0, 2e-3):
        ramp = slope * np.linspace(0, 1, len(dataset.trials))
        trials = tuple(map(registered, dataset.trials, ramp + noise))
        (segment,) = measure_drift(replace(dataset, trials=trials)).segments
        change, error = segment.trend["height"]
        assert abs(change - slope) < 3 * error
        assert error < 1.5e-4
    assert "<svg" in drift_svg(measure_drift(dataset))
    assert measure_drift(replace(dataset, trials=dataset.trials[:4])) is None


def test_worst_mistakes_are_the_worst(result):
    shown = sections.disagreements(result)
    model = sections.preferred(result)
    assert shown["model"] == model.name == "reach"
    off = {
        case.grasp_id: score - case.rate
        for case, score in zip(result.cases, model.scores, strict=True)
    }
    positives = [off[card["grasp"]] for card in shown["false_positives"]]
    assert positives == sorted(positives, reverse=True)
    assert all(value >= 0.3 for value in positives)
    assert all(off[card["grasp"]] <= -0.3 for card in shown["false_negatives"])
    objects = [card["object"] for card in shown["false_positives"]]
    assert len(set(objects)) == len(objects)


def test_a_step_between_segments_is_no_trend_within_them(dataset):
    """The part appears 3 mm higher after a new calibration; neither segment drifts."""
    noise = np.random.default_rng(3).normal(0, 1e-4, len(dataset.trials))
    half = len(dataset.trials) // 2

    def trial_at(i, trial):
        T = make_transform(None, (0, 0, noise[i] + 3e-3 * (i >= half))) @ trial.T_world_object
        done = replace(trial.execution, T_world_object=T, time_ns=1 + i)
        redos = ("placement",) if i == half else ()
        return replace(trial, execution=done, segment=int(i >= half), redos=redos)

    trials = tuple(trial_at(i, trial) for i, trial in enumerate(dataset.trials))
    found = measure_drift(replace(dataset, trials=trials))
    assert [(s.start, s.stop) for s in found.segments] == [(0, half), (half, 2 * half)]
    for segment in found.segments:
        change, error = segment.trend["height"]
        assert abs(change) < 4 * error < 1e-3
    (joined,) = measure_drift(
        replace(dataset, trials=tuple(replace(t, segment=0) for t in trials))
    ).segments
    assert joined.trend["height"][0] > 2e-3  # what a line over the step would have claimed
    redone = found.segments[1].redone
    assert redone["lifted"].redone + redone["failed"].redone == 1
    assert found.segments[0].redone["lifted"].redone == 0


def test_page_shows_agreement_of_operators_and_gain_over_the_point_model(page):
    text = parsed(page).text
    assert "agrees on 9 of 10 blind verdicts" in text and "0.79 (95 %: +0.41" in text
    assert "reach against point: AR" in text
