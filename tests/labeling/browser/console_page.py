"""The console's page in a real headless browser, as its tests see it."""

from __future__ import annotations

import shutil
from typing import Any

import pytest

from logs.journal.file import read_journal

CHROMIUM = shutil.which("chromium")
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader"
    " --disable-dev-shm-usage --disable-quic --no-first-run --disable-background-networking"
    " --disable-component-update --disable-sync --window-size=1400,900"
)

PATIENCE = 60.0
"""Longest wait for anything that the page shows [s]."""

BROWSER_TEST = [
    pytest.mark.browser,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromium-driver"),
]


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

        return WebDriverWait(self.driver, PATIENCE, 0.02).until(
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
