"""Recorded trials reviewed by real keys in a real headless browser."""

from __future__ import annotations

from typing import Any

from console_page import BROWSER_TEST, Page, labels

from labeling.control.commands import Actor
from labeling.server.access import make_access
from labeling.server.server import ConsoleServer, free_port
from logs.journal.events import Source

BO = Actor("bo", Source.OPERATOR)

pytestmark = BROWSER_TEST


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
