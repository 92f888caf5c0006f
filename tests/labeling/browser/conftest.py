"""A browser, and pages of a console in it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from console_page import CHROMIUM, DRIVER, FLAGS, Page  # noqa: E402


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


@pytest.fixture
def page(bench: Any, serve: Any, browser: Any) -> Page:
    return Page(browser, serve(bench).link)


@pytest.fixture
def awaiting(bench: Any, page: Page) -> Page:
    """The page, with the first trial executed and waiting for its label."""
    bench.executed()
    page.until_state("AWAITING_LABEL")
    return page


@pytest.fixture
def reviewing(bench: Any, serve: Any, browser: Any) -> Page:
    """The review of two trials that were labeled in an earlier sitting."""
    bench.labelled("success")
    bench.labelled("failure", reason="missed")
    page = Page(browser, serve(bench, mode="review", sitting_since=bench.state.seq).link)
    page.wait("return document.querySelectorAll('#review-list li').length === 2")
    return page
