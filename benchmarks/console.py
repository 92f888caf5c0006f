"""Key press to *stored*: `python benchmarks/console.py [--labels 120] [--rounds 3]`.

Real key events in a real headless Chromium, on the real page of a session with a plan of many
trials, its journal synced to the disk as ever, labels mirrored and scores arriving as in a session.
A press counts from the browser's stamp of the key event to the moment the page's receipt says
*stored*; half of the labels are a failure, whose clock starts at its second key. Keys are pressed on
a page that has come to rest, as an operator's are, who watched the robot for seconds. With `--rush`
they are pressed while it still draws the trial before: Chromium then holds back every answer until
the frame that follows the key, or for 50 ms (its feature DeferRendererTasksAfterInput).
Prints one JSON object: milliseconds, and the machine's load, which they are to be read with.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from labeling.control.commands import Actor
from labeling.control.controller import SessionController
from labeling.display.console import Console
from labeling.errors import SessionEndingError
from labeling.server.access import make_access
from labeling.server.server import ConsoleServer, free_port
from logs.journal.events import Noted, Phase, Scored, SensorVerdict, Source
from logs.journal.state import PlannedEntry, SessionState
from logs.session.folder import SessionDescriptor, SessionFolder, open_segment
from logs.session.mirror import AnnotationMirror
from logs.session.mirrored_journal import MirroredJournal

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
FLAGS = (
    "--headless=new --no-sandbox --disable-dev-shm-usage --disable-quic --no-first-run"
    " --use-angle=swiftshader --enable-unsafe-swiftshader"
    " --disable-background-networking --disable-component-update --disable-sync"
    " --window-size=1400,900"
)
MODELS = 8
WATCH = """
window.presses = [];
let pressed = 0;
window.addEventListener("keydown", (event) => { pressed = event.timeStamp; }, { capture: true });
new MutationObserver(() => {
  if (document.getElementById("receipt").dataset.kind !== "stored") return;
  const call = performance.getEntriesByType("resource").filter((e) => e.name.endsWith("/commands")).at(-1);
  window.presses.push([pressed, performance.now(), call?.startTime ?? NaN, call?.responseEnd ?? NaN]);
}).observe(document.getElementById("receipt"), { attributes: true, attributeFilter: ["data-kind"] });
window.changed = performance.now();
new MutationObserver(() => { window.changed = performance.now(); })
  .observe(document, { subtree: true, childList: true, characterData: true, attributes: true });
"""
AT_REST = "return !document.getAnimations().length && performance.now() - window.changed > 150"


def describe(trials: int) -> SessionDescriptor:
    return SessionDescriptor(
        created_ns=1,
        seed=7,
        config={},
        trials=tuple(
            PlannedEntry(number=n, trial_id=f"trial-{n}", grasp_id=f"g{n}", object_name=f"part_{n % 8}")
            for n in range(1, trials + 1)
        ),
        fingerprints={},
        simulated=True,
    )  # fmt: skip


def run_loop(controller: SessionController, folder: SessionFolder) -> None:
    """The session's loop with a robot that needs no time; every label is scored like a real one."""
    try:
        while (work := controller.next_work()) is not None:
            take = controller.begin(work)
            for phase in (Phase.CAPTURE, Phase.REGISTER, Phase.EXECUTE):
                take.advance(phase)
            folder.trial_folder(take.trial_id, take.number).mkdir(parents=True, exist_ok=True)
            take.record_executed("trial.mcap", SensorVerdict(lifted=True))
            take.await_label()
            take.reset()
            for n in range(MODELS):
                controller.record(
                    Scored(
                        trial_id=take.trial_id,
                        take=take.number,
                        model=f"model-{n}",
                        version="1",
                        value=0.5,
                    )
                )
    except SessionEndingError:
        return


@contextmanager
def session(root: Path, trials: int) -> Iterator[tuple[str, SessionFolder]]:
    """A session under way; yields the page's link."""
    folder = SessionFolder.create(root / "S", describe(trials))
    stored = folder.open_journal()
    state = SessionState.fold(folder.descriptor.trials, stored.entries)
    open_segment(stored, state, {}, operator="bench", source=Source.OPERATOR)
    controller = SessionController(
        MirroredJournal(stored, AnnotationMirror(folder, stored.entries)), state
    )
    loop = threading.Thread(target=run_loop, args=(controller, folder))
    console = Console(
        controller, Actor("bench", Source.OPERATOR), "bench", root=folder.path,
        hold_without_console=False,
    )  # fmt: skip
    loop.start()
    try:
        with ConsoleServer(console, make_access("127.0.0.1", free_port())) as server:
            yield server.link, folder
    finally:
        controller.request_end()
        loop.join()
        controller.close("ended")


@contextmanager
def browser(profile: Path) -> Iterator[Any]:
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for flag in (*FLAGS.split(), f"--user-data-dir={profile}"):
        options.add_argument(flag)
    options.binary_location = CHROMIUM
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    try:
        yield driver
    finally:
        driver.quit()


def press(driver: Any, key: str) -> None:
    code = f"Key{key.upper()}" if key.isalpha() else f"Digit{key}"
    down = {"type": "keyDown", "key": key, "text": key, "code": code}
    driver.execute_cdp_cmd("Input.dispatchKeyEvent", down)
    driver.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyUp", "key": key, "code": code})


def wait(driver: Any, script: str, *arguments: Any) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(driver, 60, 0.05).until(lambda d: d.execute_script(script, *arguments), script)


def measure(driver: Any, link: str, labels: int, *, rush: bool) -> np.ndarray:
    """Shape (labels, 4) [ms]: press to request, request to answer, answer to receipt, all."""
    driver.get("about:blank")
    driver.get(link)
    wait(driver, "return document.body.dataset.ready === 'true'")
    driver.execute_script(WATCH)
    for n in range(1, labels + 1):
        wait(
            driver,
            "return document.body.dataset.state === 'AWAITING_LABEL'"
            " && document.getElementById('receipt').dataset.kind === 'none'"
            " && document.getElementById('trial-number').textContent === arguments[0]",
            str(n),
        )
        for key in ("s",) if n % 2 else ("f", "1"):
            if not rush:
                wait(driver, AT_REST)
            press(driver, key)
        wait(driver, "return window.presses.length === arguments[0]", n)
        driver.execute_script("document.getElementById('receipt').dataset.kind = 'none'")
    pressed, seen, sent, answered = np.array(driver.execute_script("return window.presses")).T
    return np.stack([sent - pressed, answered - sent, seen - answered, seen - pressed], axis=1)


def sync_milliseconds(folder: SessionFolder, count: int = 100) -> list[float]:
    """What one journal line costs on this disk [ms]."""
    taken = []
    with folder.open_journal() as journal:
        for _ in range(count):
            begun = time.perf_counter()
            journal.append(Noted(text="a line", operator="bench", source=Source.OPERATOR))
            taken.append((time.perf_counter() - begun) * 1e3)
    return taken


def percentiles(values: Any) -> dict[str, float]:
    return {f"p{p}": round(float(np.nanpercentile(values, p)), 1) for p in (50, 95, 100)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--labels", type=int, default=120)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--trials", type=int, default=1000, help="planned, labeled or not")
    parser.add_argument("--rush", action="store_true", help="press before the page is at rest")
    parser.add_argument("--folder", type=Path, help="on the disk to measure; else a temporary one")
    arguments = parser.parse_args()
    rounds = []
    for _ in range(arguments.rounds):
        with tempfile.TemporaryDirectory(dir=arguments.folder) as scratch:
            load = os.getloadavg()[0]
            with session(Path(scratch), arguments.trials) as (link, folder):
                with browser(Path(scratch) / "profile") as driver:
                    taken = measure(driver, link, arguments.labels, rush=arguments.rush)
            parts = (
                "press_to_request",
                "request_to_answer",
                "answer_to_receipt",
                "press_to_stored",
            )
            rounds.append(
                {
                    "load_before": round(load, 1),
                    "load_after": round(os.getloadavg()[0], 1),
                    "journal_line_ms": percentiles(sync_milliseconds(folder)),
                    **{f"{part}_ms": percentiles(taken[:, i]) for i, part in enumerate(parts)},
                }
            )
    print(json.dumps({"labels": arguments.labels, "trials": arguments.trials, "rounds": rounds}))


if __name__ == "__main__":
    main()
