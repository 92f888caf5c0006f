"""What the page shows in a real headless browser, and what a lost connection does to it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from console_page import BROWSER_TEST, Page, labels

from labeling.display.console import Console
from labeling.server.server import ConsoleServer
from logs.journal.events import Phase

pytestmark = BROWSER_TEST


def test_predictions_are_drawn_only_after_the_label(bench: Any, awaiting: Page) -> None:
    bench.score(1, 0.4321)
    awaiting.press("t")
    awaiting.wait("return document.getElementById('do-rotated').ariaPressed === 'true'")
    assert "0.43" not in awaiting.driver.page_source
    awaiting.press("s")
    awaiting.wait("return document.getElementById('history').textContent.includes('0.43')")


def test_text_from_the_session_never_becomes_markup(bench: Any, awaiting: Page) -> None:
    evil = "<img src=x onerror=window.hacked=1>"
    bench.controller.hold("robot", evil)
    bench.do("label", 1, outcome="success")
    awaiting.until_state("HELD")
    assert evil in awaiting.element("banner-text").text
    assert awaiting.run("return window.hacked") is None


def test_a_lost_connection_shows_and_queues_nothing(bench: Any, serve: Any, browser: Any) -> None:
    server = serve(bench)
    bench.controller.set_light("robot", ok=True)
    bench.executed()
    page = Page(browser, server.link)
    page.until_state("AWAITING_LABEL")
    server.__exit__(None, None, None)
    page.until_state("LOST")
    lights = page.run(
        "return [...document.querySelectorAll('.lights li')].map(l => l.dataset.light)"
    )
    assert lights[0] == lights[2] == "bad"
    page.press("s")
    assert "nothing was sent" in page.receipt("refused")
    console = Console(bench.controller, server._console.actor, "monday", hold_without_console=False)
    with ConsoleServer(console, server.access):
        page.until_state("AWAITING_LABEL")
        assert labels(bench) == []
        page.press("s")
        page.receipt("stored")
    assert labels(bench) == ["label"]


def test_a_label_without_an_answer_shows_unconfirmed_until_the_view_tells(
    bench: Any, awaiting: Page
) -> None:
    awaiting.run(
        """
        const real = window.fetch;
        window.fetch = async (path, options) => {
          const answer = await real(path, options);
          if (path === "/api/commands") { window.fetch = real; throw new TypeError("cut"); }
          return answer;
        };
        """
    )
    awaiting.press("s")
    awaiting.receipt("stored")  # the next view names the command among the stored ones
    awaiting.wait("return document.getElementById('unconfirmed').hidden")
    assert labels(bench) == ["label"]


def test_the_recording_is_shown_and_its_keys_still_label(
    bench: Any, serve: Any, browser: Any, tmp_path: Path
) -> None:
    rerun = pytest.importorskip("rerun")
    recording = bench.folder.path / "trial.rrd"
    stream = rerun.RecordingStream("reach-test", recording_id="r")
    stream.set_sinks(rerun.FileSink(str(recording)))
    stream.log("world/points", rerun.Points3D([[0, 0, 0], [1, 1, 1]], radii=0.1))
    stream.disconnect()
    bench.labelled("failure", reason="missed")
    server = serve(bench, mode="review", recordings=lambda trial: recording)
    browser.get("about:blank")
    browser.get(server.link)
    page = Page.__new__(Page)
    page.driver = browser
    page.wait("return document.querySelector('#review-list li') !== null")
    page.wait("return !document.getElementById('viewer').hidden")
    browser.switch_to.frame("viewer")
    page.wait("return document.body?.dataset.started === 'true'")
    page.run("document.getElementById('canvas').focus(); window.focus()")
    assert page.run("return document.hasFocus()")
    browser.switch_to.default_content()
    page.on_stage("1")
    browser.switch_to.frame("viewer")
    page.press("s")
    browser.switch_to.default_content()
    assert "trial 1 success" in page.receipt("stored")
    assert bench.trial(1).label.outcome == "success"


def test_a_button_under_the_finger_stays_while_views_arrive(bench: Any, awaiting: Page) -> None:
    awaiting.press("f")
    awaiting.wait("return !document.getElementById('choices').hidden")
    awaiting.run("window.pressed = document.querySelector('#choices button')")
    for score in range(3):
        bench.score(1, 0.5, model=f"model-{score}")
    bench.controller.set_light("camera", ok=True)
    awaiting.wait("return document.getElementById('light-camera').dataset.light === 'good'")
    assert awaiting.run("return window.pressed.isConnected")
    awaiting.run("window.pressed.click()")
    awaiting.receipt("stored")
    assert bench.trial(1).label.reason == "missed"


def test_a_foreign_frame_s_keys_are_ignored(bench: Any, awaiting: Page) -> None:
    awaiting.run("window.postMessage({key: 's'}, '*')")
    awaiting.press("t")
    awaiting.wait("return document.getElementById('do-rotated').ariaPressed === 'true'")
    assert labels(bench) == []


def test_the_page_fits_a_tablet(bench: Any, awaiting: Page) -> None:
    awaiting.driver.set_window_size(820, 1180)
    try:
        for name in ("do-success", "do-failure", "stop"):
            box = awaiting.element(name).rect
            assert box["height"] >= 44 and box["width"] >= 44
            seen = awaiting.run(
                "const b = document.getElementById(arguments[0]).getBoundingClientRect();"
                "return b.top >= 0 && b.bottom <= innerHeight && b.right <= innerWidth",
                name,
            )
            assert seen, name
    finally:
        awaiting.driver.set_window_size(1400, 900)


def test_the_page_reports_no_errors(browser: Any, awaiting: Page) -> None:
    browser.get_log("browser")  # what earlier tests provoked
    awaiting.press("f", "x", "t", "p", "p", "r", "x")
    awaiting.wait("return document.getElementById('choices').hidden")
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_pictures_show_how_to_place_and_what_was_found(
    bench: Any, serve: Any, browser: Any
) -> None:
    from io import BytesIO

    from PIL import Image

    stream = BytesIO()
    Image.new("RGB", (8, 6), "red").save(stream, "PNG")
    server = serve(bench)
    take = bench.begin()
    server._console.pictures.put(take.trial_id, 1, "placing", stream.getvalue)
    page = Page(browser, server.link)
    page.wait("return document.querySelector('#placing img').naturalWidth === 8")
    assert page.element("placing").is_displayed() and not page.element("overlay").is_displayed()
    bench.do("placed", 1)
    server._console.pictures.put(take.trial_id, 1, "overlay", stream.getvalue)
    take.advance(Phase.REGISTER, {"registration": {"fitness": 0.93}})
    page.wait("return document.querySelector('#overlay img').naturalWidth === 8")
    assert page.element("overlay").is_displayed() and not page.element("placing").is_displayed()
    assert "0.930" in page.element("registration").text
    take.advance(Phase.CONFIRM_POSE, {"rivals": [{}, {}]})
    page.until_state("CONFIRM_POSE")
    page.wait("return document.querySelectorAll('#choices button').length === 4")
    assert "3 poses" in page.element("banner").text
    edges = [
        f"document.getElementById('{one}').getBoundingClientRect()"
        for one in ("overlay", "choices")
    ]
    assert page.run(f"return {edges[0]}.bottom <= {edges[1]}.top"), "the choice covers the picture"
