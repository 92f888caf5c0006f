"""Real keys in a real headless browser: label, undo, reasons, notes, redo, skip, stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from console_page import BROWSER_TEST, Page, labels

from logs.journal.events import Phase

pytestmark = BROWSER_TEST


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
