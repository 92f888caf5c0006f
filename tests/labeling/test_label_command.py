"""`reach label` and `reach status` as a user runs them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from logs.journal.file import read_journal

ROOT = Path(__file__).parents[2]
LABEL = "import sys; from collection.cli.label import label; import typer; typer.run(label)"
STATUS = "import sys; from collection.cli.status import status; import typer; typer.run(status)"


def run(script: str, *arguments: str) -> str:
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def start() -> Iterator[Callable[..., tuple[subprocess.Popen[str], httpx.Client]]]:
    """Start `reach label`; returns the process and a client of its console."""
    started: list[tuple[subprocess.Popen[str], httpx.Client]] = []

    def begin(*arguments: str) -> tuple[subprocess.Popen[str], httpx.Client]:
        process = subprocess.Popen(
            [sys.executable, "-c", LABEL, *arguments],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        lines: list[str] = []
        while not any("token=" in line for line in lines):
            line = process.stdout.readline()
            assert line, lines
            lines.append(line)
        parts = urlsplit(lines[-1].strip())
        client = httpx.Client(
            base_url=f"{parts.scheme}://{parts.netloc}",
            headers={"authorization": "Bearer " + parts.fragment.removeprefix("token=")},
            trust_env=False,
        )
        started.append((process, client))
        return process, client

    yield begin
    for process, client in started:
        client.close()
        process.kill()
        process.communicate()


def relabel(client: httpx.Client, item: dict[str, Any], kind: str, **value: Any) -> dict[str, Any]:
    command = {"kind": kind, "trial_id": item["trial_id"], "rev": item["rev"], "value": value}
    tick = client.get("/api/view").json()["tick"]
    body = {**command, "tick": tick, "id": f"command-{time.monotonic_ns()}"}
    return dict(client.post("/api/commands", json=body).json())


def test_a_recorded_session_is_relabeled_and_left_as_it_ended(bench: Any, start: Any) -> None:
    bench.labelled("success")
    bench.controller.close("finished")
    process, client = start(str(bench.folder.path), "--name", "bo")
    item = client.get("/api/review").json()["trials"][0]
    answer = relabel(client, item, "relabel", outcome="failure", reason="other", note="slow look")
    assert answer["status"] == "stored"
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0
    state = bench.folder.read_state()
    label = state.order[0].label
    assert (label.operator, label.outcome, label.note) == ("bo", "failure", "slow look")
    assert state.closed.status == "finished"
    assert [e.event.kind for e in read_journal(bench.folder.journal_path)][-1] == "relabel"


def test_a_second_operator_labels_blindly_and_agreement_is_printed(bench: Any, start: Any) -> None:
    bench.labelled("success")
    bench.labelled("failure", reason="missed")
    bench.controller.close("finished")
    process, client = start(str(bench.folder.path), "--name", "bo", "--second")
    for item in client.get("/api/review").json()["trials"]:
        assert item["label"] is None
        assert relabel(client, item, "second_label", outcome="success")["status"] == "stored"
    process.send_signal(signal.SIGTERM)
    printed, _ = process.communicate(timeout=60)
    assert "1 of 2 pairs of blind verdicts on 2 trials agree" in printed
    found = json.loads(run(LABEL, str(bench.folder.path), "--agreement", "--json"))
    assert found == {
        "pairs": 2,
        "trials": 2,
        "agreed": 1,
        "kappa": 0.0,
        "interval": None,
        "undefined": "",
    }


def test_a_session_under_way_is_not_relabeled(bench: Any) -> None:
    command = [sys.executable, "-c", LABEL, str(bench.folder.path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode != 0
    assert "is being written by process" in done.stderr


def test_practice_runs_without_a_session(start: Any, tmp_path: Path) -> None:
    process, client = start("--practice")
    assert client.get("/api/view").json()["practice"] is True
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0


def test_status_counts_a_session_under_way(bench: Any) -> None:
    bench.labelled("success")
    bench.executed()
    found = json.loads(run(STATUS, str(bench.folder.path), "--json"))
    wanted = {"planned": 3, "done": 2, "labelled": 1, "unlabelled": 1, "voided": 0}
    assert {name: found[name] for name in wanted} == wanted
    assert found["disk_left"] > 0


def test_status_imports_nothing_heavy() -> None:
    script = (
        "import sys; from collection.cli.status import status; import logs.session.folder, logs.disk;"
        "heavy = {'numpy', 'fastapi', 'rerun', 'pandas', 'mcap', 'textual'} & set(sys.modules);"
        "print(sorted(heavy))"
    )
    assert run(script).strip() == "[]"
