"""Real keys in a real headless browser, on the real page."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from labeling.control.commands import Actor
from labeling.display.console import Console
from labeling.server.access import make_access
from labeling.server.server import ConsoleServer, free_port
from logs.journal.events import Phase, Source
from logs.journal.file import read_journal

CHROMIUM = shutil.which("chromium")
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader"
    " --disable-dev-shm-usage --disable-quic --no-first-run --disable-background-networking"
    " --disable-component-update --disable-sync --window-size=1400,900"
)

BO = Actor("bo", Source.OPERATOR)

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromium-driver"),
]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for flag in FLAGS.split():
        options.add_argument(flag)
    options.add_argument(f"--user-data-dir={tmp_path_factory.mktemp('profile')}")
    options.binary_location = CHROMIUM
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    yield driver
    driver.quit()


class Page:
    """The console's page: press keys, wait for what it shows."""

    def __init__(self, driver: Any, link: str) -> None:
        self.driver = driver
        driver.get("about:blank")
        driver.get(link)
        self.wait("return document.body.dataset.ready === 'true'")
        self.until_state("READY", "PLACE_OBJECT", "AWAITING_LABEL", "STOPPED", "HELD", "REVIEW")

    def run(self, script: str, *arguments: Any) -> Any:
        return self.driver.execute_script(script, *arguments)

    def wait(self, script: str, *arguments: Any) -> Any:
        from selenium.webdriver.support.ui import WebDriverWait

        return WebDriverWait(self.driver, 15, 0.02).until(
            lambda driver: driver.execute_script(script, *arguments), script
        )

    def until_state(self, *states: str) -> None:
        self.wait("return arguments[0].includes(document.body.dataset.state)", states)

    def receipt(self, kind: str) -> str:
        self.wait("return document.getElementById('receipt').dataset.kind === arguments[0]", kind)
        return str(self.run("return document.getElementById('receipt').textContent"))

    def press(self, *keys: str) -> None:
        from selenium.webdriver.common.action_chains import ActionChains

        ActionChains(self.driver).send_keys(*keys).perform()

    def on_stage(self, number: str) -> None:
        """Wait until a trial of a review is there and may be judged."""
        self.wait(
            "return document.getElementById('trial-number').textContent === arguments[0]"
            " && !document.getElementById('do-success').disabled",
            number,
        )

    def element(self, identity: str) -> Any:
        return self.driver.find_element("id", identity)


def labels(bench: Any) -> list[str]:
    entries = read_journal(bench.folder.journal_path)
    told = ("label", "relabel", "second_label", "undo", "skip")
    return [e.event.kind for e in entries if e.event.kind in told]


@pytest.fixture
def page(bench: Any, serve: Any, browser: Any) -> Page:
    return Page(browser, serve(bench).link)


@pytest.fixture
def awaiting(bench: Any, page: Page) -> Page:
    """The page, with the first trial executed and waiting for its label."""
    bench.executed()
    page.until_state("AWAITING_LABEL")
    return page


def test_one_key_labels_and_one_key_undoes(bench: Any, awaiting: Page) -> None:
    awaiting.press("s")
    assert "trial 1 success" in awaiting.receipt("stored")
    assert bench.trial(1).label.outcome == "success"
    awaiting.press("u")
    awaiting.wait("return document.body.dataset.target === 'relabel'")
    assert bench.trial(1).label is None
    awaiting.press("t", "s")
    awaiting.wait("return document.querySelector('#history .success') !== null")
    assert bench.trial(1).label.rotated
    assert labels(bench) == ["label", "undo", "relabel"]


def test_a_failure_takes_its_reason_and_the_note(bench: Any, awaiting: Page) -> None:
    awaiting.press("n")
    awaiting.press("sfu 123 missed by a hair")
    assert labels(bench) == []
    awaiting.press("\ue007")  # Enter leaves the field
    awaiting.press("f")
    awaiting.wait("return !document.getElementById('choices').hidden")
    awaiting.press("3")
    awaiting.receipt("stored")
    label = bench.trial(1).label
    assert (label.outcome, label.reason) == ("failure", "dropped_while_held")
    assert label.note == "sfu 123 missed by a hair"


def test_a_digit_alone_means_nothing(bench: Any, awaiting: Page) -> None:
    awaiting.press("1", "2", "3")
    awaiting.press("t")
    awaiting.wait("return document.getElementById('do-rotated').ariaPressed === 'true'")
    assert labels(bench) == []


def test_a_held_down_key_labels_once(bench: Any, awaiting: Page) -> None:
    repeat = {"type": "keyDown", "key": "s", "code": "KeyS", "text": "s", "autoRepeat": False}
    for index in range(30):
        awaiting.driver.execute_cdp_cmd(
            "Input.dispatchKeyEvent", {**repeat, "autoRepeat": index > 0}
        )
    awaiting.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyUp", "key": "s"})
    awaiting.receipt("stored")
    bench.executed()
    awaiting.wait("return document.getElementById('trial-number').textContent === '2'")
    assert labels(bench) == ["label"]


def test_keys_with_modifiers_are_not_ours(bench: Any, awaiting: Page) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    for modifier in ("\ue009", "\ue00a"):  # Control, Alt
        chain = ActionChains(awaiting.driver).key_down(modifier).send_keys("s").key_up(modifier)
        chain.perform()
    awaiting.press("t")
    awaiting.wait("return document.getElementById('do-rotated').ariaPressed === 'true'")
    assert labels(bench) == []


def test_space_on_a_button_that_was_clicked_is_no_second_label(bench: Any, awaiting: Page) -> None:
    awaiting.element("do-success").click()
    awaiting.receipt("stored")
    bench.executed()
    awaiting.wait(
        "return document.getElementById('trial-number').textContent === '2'"
        " && document.body.dataset.state === 'AWAITING_LABEL'"
    )
    awaiting.run("document.getElementById('do-success').focus()")
    awaiting.press(" ")
    awaiting.press("\ue007")
    awaiting.press("t")
    awaiting.wait("return document.getElementById('do-rotated').ariaPressed === 'true'")
    assert labels(bench) == ["label"]


def test_escape_stops_also_while_typing_and_clearing_asks_twice(bench: Any, awaiting: Page) -> None:
    awaiting.press("n")
    awaiting.press("hal", "\ue00c")
    awaiting.until_state("STOPPED")
    assert bench.state.stopped
    awaiting.run("document.getElementById('note').blur()")
    awaiting.press("s")
    assert "stopped" in awaiting.receipt("refused")
    assert labels(bench) == []
    awaiting.element("clear-stop").click()
    assert bench.state.stopped
    awaiting.element("confirm-clear-yes").click()
    awaiting.until_state("AWAITING_LABEL")
    assert not bench.state.stopped


def test_enter_places_and_a_redo_asks_for_its_cause(
    bench: Any, page: Page, in_thread: Callable[..., Any]
) -> None:
    waiting = in_thread(bench.begin().wait_placed)
    page.until_state("PLACE_OBJECT")
    page.press("\ue007")
    waiting()
    take = bench.trial(1).takes[0]
    assert take.placed
    page.receipt("stored")
    page.press("r")
    page.wait("return !document.getElementById('choices').hidden")
    page.press("2")
    page.wait("return document.getElementById('count-again').textContent === '1 / 0'")
    assert (take.status, take.ended_because) == ("redone", "seeing")


def test_a_skip_asks_first_and_can_be_undone(bench: Any, awaiting: Page) -> None:
    awaiting.press("k")
    awaiting.wait("return !document.getElementById('choices').hidden")
    assert labels(bench) == []
    awaiting.press("k")
    awaiting.wait("return document.getElementById('count-skipped').textContent === '1'")
    awaiting.press("u")
    awaiting.wait("return document.getElementById('count-skipped').textContent === '0'")
    assert labels(bench) == ["skip", "undo"]


def test_ambiguous_poses_are_chosen_by_digit(
    bench: Any, page: Page, in_thread: Callable[..., Any]
) -> None:
    take = bench.begin()
    bench.do("placed", 1)
    take.advance(Phase.REGISTER)
    waiting = in_thread(lambda: take.confirm_pose({"rivals": [{}]}))
    page.until_state("CONFIRM_POSE")
    page.press("2")
    assert waiting() == 1


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


@pytest.fixture
def reviewing(bench: Any, serve: Any, browser: Any) -> Page:
    """The review of two trials that were labeled in an earlier sitting."""
    bench.labelled("success")
    bench.labelled("failure", reason="missed")
    page = Page(browser, serve(bench, mode="review", sitting_since=bench.state.seq).link)
    page.wait("return document.querySelectorAll('#review-list li').length === 2")
    return page


def test_a_second_operators_review_offers_no_filter_by_verdict(
    bench: Any, reviewing: Page, serve: Any
) -> None:
    choices = "[...document.querySelectorAll('#filter select, #filter input')]"
    offered = f"return {choices}.filter(one => one.offsetParent).map(one => one.name)"
    assert reviewing.run(offered) == ["object", "outcome", "margin_below", "disagrees_with"]
    second = Page(reviewing.driver, serve(bench, mode="review", second=True, actor=BO).link)
    second.wait("return document.querySelectorAll('#review-list li').length === 2")
    assert second.run(offered) == ["object", "margin_below"]


def test_undo_in_a_review_walks_back_this_sitting_only(bench: Any, reviewing: Page) -> None:
    reviewing.on_stage("1")
    reviewing.press("f", "1")
    reviewing.on_stage("2")
    reviewing.press("s")
    reviewing.wait("return document.getElementById('undo-text').textContent.includes('of 2')")
    for trial in ("2", "1"):
        reviewing.press("u")
        reviewing.wait(
            "return document.getElementById('trial-number').textContent === arguments[0]", trial
        )
        reviewing.wait(
            "return !document.getElementById('undo-text').textContent.includes('of ' + arguments[0])",
            trial,
        )
    assert [bench.trial(n).label.outcome for n in (1, 2)] == ["success", "failure"]
    assert labels(bench) == ["label", "label", "relabel", "relabel", "undo", "undo"]
    reviewing.press("u", "u")
    reviewing.press("t")
    reviewing.wait("return document.getElementById('do-rotated').ariaPressed === 'true'")
    assert labels(bench)[-3:] == ["relabel", "undo", "undo"]


def test_the_buttons_judge_trials_of_a_session_that_ended_in_a_stop(
    bench: Any, serve: Any, browser: Any
) -> None:
    from labeling.reviewing import review_console
    from logs.session.folder import SessionFolder

    bench.labelled("success")
    bench.do("stop")
    bench.controller.close("ended")
    with review_console(SessionFolder.open(bench.folder.path), BO) as console:
        access = make_access("127.0.0.1", free_port(), token="t" * 24)
        with ConsoleServer(console, access) as server:
            page = Page(browser, server.link)
            page.on_stage("1")
            page.element("do-failure").click()
            page.wait("return document.querySelectorAll('#choices button').length === 6")
            page.run("document.querySelector('#choices button').click()")
            page.receipt("stored")
            with console.controller.reading() as state:
                assert state.order[0].label.reason == "missed"


def test_a_second_press_is_not_a_verdict_on_the_trial_that_just_came_up(
    bench: Any, reviewing: Page
) -> None:
    reviewing.on_stage("1")
    reviewing.run(  # a finger that is faster than this test: pressed as soon as the trial changes
        """
        const number = document.getElementById("trial-number");
        const press = new KeyboardEvent("keydown", { key: "s", bubbles: true });
        new MutationObserver((_, once) => { once.disconnect(); document.dispatchEvent(press); })
          .observe(number, { childList: true, characterData: true, subtree: true });
        """
    )
    reviewing.press("s")
    assert "only just come up" in reviewing.receipt("refused")
    reviewing.on_stage("2")
    assert labels(bench) == ["label", "label", "relabel"]
    reviewing.press("s")
    reviewing.receipt("stored")
    assert labels(bench) == ["label", "label", "relabel", "relabel"]


def test_a_chosen_filter_leaves_the_keys_to_the_operator(bench: Any, reviewing: Page) -> None:
    from selenium.webdriver.support.ui import Select

    reviewing.element("filter").find_element("name", "object").click()
    Select(reviewing.element("filter").find_element("name", "object")).select_by_value("cube")
    reviewing.on_stage("2")
    reviewing.press("f", "1")
    reviewing.receipt("stored")
    assert bench.trial(2).label.reason == "missed"
    assert labels(bench)[-1] == "relabel"


def test_a_second_operator_takes_back_their_last_verdict(
    bench: Any, serve: Any, browser: Any
) -> None:
    bench.labelled("success")
    bench.labelled("failure", reason="missed")
    server = serve(bench, mode="review", second=True, actor=BO, sitting_since=bench.state.seq)
    page = Page(browser, server.link)
    marks = "[...document.querySelectorAll('#review-list .mark')].map(mark => mark.textContent)"
    page.wait(f"return {marks}.join() === 'unlabeled,unlabeled'")
    page.on_stage("1")
    page.press("u")
    assert "nothing to undo" in page.receipt("refused")
    page.press("f", "1")
    page.on_stage("2")
    page.press("s")
    page.wait("return document.getElementById('undo-text').textContent === 'Undo label of 2'")
    page.wait(f"return {marks}.join() === 'failure: missed,success'")
    page.press("u")
    told = "trial 2: its label no longer holds"
    page.wait("return document.getElementById('receipt').textContent.includes(arguments[0])", told)
    page.wait(f"return {marks}.join() === 'failure: missed,unlabeled'")
    page.on_stage("2")
    page.press("f", "2")
    page.wait(f"return {marks}.join() === 'failure: missed,failure: slipped on lift'")
    first, second = (bench.trial(number).takes[0] for number in (1, 2))
    assert [take.second_labels["bo"].outcome for take in (first, second)] == ["failure"] * 2
    assert [take.label.outcome for take in (first, second)] == ["success", "failure"]
    assert labels(bench)[2:] == ["second_label", "second_label", "undo", "second_label"]


def test_an_earlier_label_is_taken_back_only_when_asked_on_its_trial(
    bench: Any, reviewing: Page
) -> None:
    reviewing.press("\ue015")  # down, to the second trial
    reviewing.wait("return document.getElementById('trial-number').textContent === '2'")
    assert "Take back 2's label" in reviewing.element("undo-text").text
    reviewing.press("u")
    reviewing.wait("return !document.getElementById('choices').hidden")
    assert "failure: missed" in reviewing.element("choices").text
    assert labels(bench) == ["label", "label"]
    reviewing.press("1")
    reviewing.receipt("stored")
    assert bench.trial(2).label is None and bench.trial(1).label is not None
    assert labels(bench) == ["label", "label", "undo"]


def test_what_was_begun_for_one_take_never_ends_up_on_another(bench: Any, awaiting: Page) -> None:
    awaiting.press("t", "f")
    awaiting.wait("return !document.getElementById('choices').hidden")
    bench.do("label", 1, outcome="success")  # another console was faster
    bench.executed()
    awaiting.wait("return document.getElementById('trial-number').textContent === '2'")
    awaiting.press("1")
    assert awaiting.element("do-rotated").get_attribute("aria-pressed") == "false"
    awaiting.press("s")
    awaiting.receipt("stored")
    label = bench.trial(2).label
    assert (label.outcome, label.rotated) == ("success", False)


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


def test_a_remapped_key_labels_also_in_the_next_session(
    bench: Any, serve: Any, awaiting: Page
) -> None:
    awaiting.element("open-keys").click()
    awaiting.run(
        "[...document.querySelectorAll('#key-table tr')]"
        ".find(row => row.textContent.startsWith('success')).querySelector('button').click()"
    )
    awaiting.press("g")
    awaiting.run("document.getElementById('keys').close()")
    awaiting.press("s")
    awaiting.press("g")
    awaiting.receipt("stored")
    assert labels(bench) == ["label"]
    again = Page(awaiting.driver, serve(bench).link)  # another port, as tomorrow
    assert again.run("return document.querySelector('kbd[data-key=success]').textContent") == "g"
    again.run("document.cookie = 'reach-console-keys=%7B%7D; path=/'")


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
