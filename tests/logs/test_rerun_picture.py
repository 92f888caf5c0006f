"""The views rendered without a screen: nothing fails to draw, and the picture is the known one."""

import io
import json
import os
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from logs.record.annotation_files import write_annotation
from logs.record.annotations import LabelRecord, ScoreRecord
from logs.record.recorder import TrialRecorder
from logs.view.session import write_session_view
from logs.view.trial import derive_rrd

pytestmark = [pytest.mark.viewer, pytest.mark.slow, pytest.mark.timeout(180)]
LAVAPIPE = sorted(Path("/usr/share/vulkan/icd.d").glob("lvp_icd*.json"))
REFERENCE_SIZE = (320, 180)


@pytest.fixture(scope="module")
def viewer() -> Iterator[object]:
    """A Rerun viewer that draws in software, on a port of its own."""
    if not LAVAPIPE:
        pytest.skip("no software renderer: apt-get install mesa-vulkan-drivers libvulkan1")
    from rerun.experimental import ViewerClient

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    before = os.environ.get("VK_ICD_FILENAMES")
    os.environ["VK_ICD_FILENAMES"] = str(LAVAPIPE[0])
    executable = Path(sys.executable).parent / "rerun"
    client = ViewerClient.spawn(headless=True, port=port, executable_path=str(executable))
    yield client
    client.quit()
    os.environ.pop("VK_ICD_FILENAMES")
    if before is not None:
        os.environ["VK_ICD_FILENAMES"] = before


@pytest.fixture(scope="module")
def take(made, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("take")
    with TrialRecorder(folder) as recorder:
        made.record_trial(recorder, samples=100, size=(160, 120))
    write_annotation(folder, LabelRecord(made.TRIAL_ID, 1, 1, "1", 1, "success"))
    score = ScoreRecord(made.TRIAL_ID, 1, 2, "2", 2, "reach", "1", 0.81, patches=made.patches())
    write_annotation(folder, score)
    path = {"path": json.dumps(made.settling(-0.04))}
    settled = ScoreRecord(made.TRIAL_ID, 1, 3, "3", 3, "settled", "1", 1.0, texts=path)
    write_annotation(folder, settled)
    return folder


def wait_for(condition, what: str, seconds: float = 40.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.05)


def open_file(viewer, path: Path) -> list:
    """Open one recording alone; the views it shows."""
    viewer.close("all")
    viewer.open(str(path))
    wait_for(lambda: not viewer.get_state().loading and viewer.get_state().views, "loaded")
    return viewer.get_state().views


def pixels_of(viewer, view_id: str, size: tuple[int, int] = REFERENCE_SIZE) -> np.ndarray:
    """RGB pixels of a view as it is drawn now."""
    from PIL import Image

    image = Image.open(io.BytesIO(viewer.take_screenshot(view_id)))
    return np.asarray(image.convert("RGB").resize(size)).astype(int)


def healthy(views: list) -> bool:
    reports = {view.name: view.reports for view in views if view.reports}
    assert reports == {}
    return True


def test_the_view_draws_and_looks_as_it_should(viewer, take: Path, fixtures: Path) -> None:
    from PIL import Image

    open_file(viewer, derive_rrd(take))
    viewer.set_time("elapsed", duration=4.3, play_state="paused")
    views = {view.name: view for view in viewer.get_state().views}
    assert {"scene", "color", "depth", "predicted contact", "label and scores"} <= set(views)
    for name in ("scene", "predicted contact"):
        view_id, path = views[name].view_id, fixtures / f"view_{name.split()[-1]}.png"
        if os.environ.get("REACH_DRAW_REFERENCE") == "1":
            time.sleep(5)
            Image.fromarray(pixels_of(viewer, view_id).astype(np.uint8)).save(path)
        expected = np.asarray(Image.open(path).convert("RGB")).astype(int)
        assert expected.std() > 10
        wait_for(
            lambda view_id=view_id, expected=expected: (
                np.abs(pixels_of(viewer, view_id) - expected).mean() < 3.0
            ),
            f"{name} looks as in {path.name}",
        )
    assert healthy(viewer.get_state().views)


def test_contacts_are_drawn_by_pressure(viewer, take: Path) -> None:
    """The patch has violet and yellow in it: colors of low and of high pressure."""
    open_file(viewer, derive_rrd(take))
    view = next(v for v in viewer.get_state().views if v.name == "predicted contact")

    def has_both_colors() -> bool:
        red, green, blue = pixels_of(viewer, view.view_id, (640, 480)).reshape(-1, 3).T
        yellow = (red > 140) & (green > 120) & (blue < 80)
        violet = (red < 130) & (green < 40) & (blue > 90)
        return yellow.sum() > 15 and violet.sum() > 15

    wait_for(has_both_colors, "a patch from violet to yellow is drawn")


def ghost_pixels(viewer, view_id: str) -> int:
    """How much of a view is of the ghosts' red; the pads' orange has far less blue than green."""
    red, green, blue = pixels_of(viewer, view_id, (640, 480)).reshape(-1, 3).T
    return int(((red > 90) & (red > 1.4 * green) & (abs(green - blue) < 25)).sum())


def test_ghosts_of_the_settling_part_come_with_the_closing_jaws(viewer, take: Path) -> None:
    open_file(viewer, derive_rrd(take))
    view_id = next(v for v in viewer.get_state().views if v.name == "scene").view_id
    viewer.set_time("elapsed", duration=2.0, play_state="paused")
    wait_for(lambda: ghost_pixels(viewer, view_id) < 30, "before, there are none")
    viewer.set_time("elapsed", duration=3.2, play_state="paused")
    wait_for(lambda: ghost_pixels(viewer, view_id) > 300, "ghosts are drawn")


def test_ghosts_can_be_switched_off(viewer, take: Path, tmp_path: Path, monkeypatch) -> None:
    """By the eye beside `predicted_settling` in the viewer's list, which is what this sets."""
    import rerun.blueprint as rrb

    from logs.view.settling import SETTLING

    scene = rrb.Spatial3DView
    hidden = {SETTLING: rrb.EntityBehavior(visible=False)}
    monkeypatch.setattr(
        "logs.view.blueprint.rrb.Spatial3DView",
        lambda **given: scene(**given, overrides=hidden if given["name"] == "scene" else None),
    )
    # The viewer keeps an application's first layout: this one needs an application of its own.
    monkeypatch.setattr("logs.view.trial.APPLICATION", "reach-trials without ghosts")
    open_file(viewer, derive_rrd(take, tmp_path / "hidden.rrd"))
    view_id = next(v for v in viewer.get_state().views if v.name == "scene").view_id
    viewer.set_time("elapsed", duration=2.0, play_state="paused")
    wait_for(lambda: pixels_of(viewer, view_id).std() > 10, "the scene is drawn")
    jaws_open = pixels_of(viewer, view_id)
    viewer.set_time("elapsed", duration=3.2, play_state="paused")
    wait_for(lambda: np.abs(pixels_of(viewer, view_id) - jaws_open).max() > 50, "the jaws closed")
    assert ghost_pixels(viewer, view_id) < 30
    assert healthy(viewer.get_state().views)


def test_the_blind_view_draws_and_shows_no_prediction(viewer, take: Path) -> None:
    views = open_file(viewer, derive_rrd(take, blind=True))
    assert healthy(viewer.get_state().views)
    assert not any("contact" in view.name or "score" in view.name for view in views)


def test_the_session_s_view_draws_at_every_step(viewer, sessions, tmp_path: Path) -> None:
    session = sessions.build_session(tmp_path / "s", 3, samples=3)
    open_file(viewer, write_session_view(session.path, tmp_path / "all.rrd"))
    for timeline in ("disagreement", "by_object"):
        for step in (1, 2, 3):
            viewer.set_time(timeline, sequence=step, play_state="paused")
            assert healthy(viewer.get_state().views)


def test_the_record_itself_opens_in_the_viewer(viewer, take: Path) -> None:
    """Without any of this project's code: Rerun draws the .mcap that it is given."""
    views = open_file(viewer, take / "trial.mcap")
    # While the file's channels come in one by one, a camera may stand there without its pose.
    wait_for(
        lambda: not any(view.reports for view in viewer.get_state().views), "nothing to report"
    )
    assert {"3D", "2D"} <= {view.view_class for view in views}
