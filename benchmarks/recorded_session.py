"""What the records of a real session cost: `python benchmarks/recorded_session.py SESSION`.

Works on a copy (records are hard links). Takes are recorded again, message by message, from what
their records hold. Prints one JSON object; times are CPU seconds of the process unless the name
says `wall`.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from logs.journal import events as ev
from logs.record.recorder import TrialRecorder
from logs.record.trial_record import TrialRecord, read_record
from logs.session.folder import SessionFolder
from logs.session.index import list_takes, rebuild_index
from logs.view.session import write_session_view
from logs.view.session_overview import counting
from logs.view.trial import derive_rrd


class Stopwatch:
    """What the trial waits for: its thread's own work, and waiting for others on a busy machine.

    Longest call and sum of all calls, by the wall's clock and by the thread's [s].
    """

    def __init__(self) -> None:
        self.longest = self.total = self.longest_work = self.work = 0.0

    def __call__(self, call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """Call, and measure."""
        began, began_work = time.perf_counter(), time.thread_time()
        result = call(*arguments, **named)
        took, work = time.perf_counter() - began, time.thread_time() - began_work
        self.longest, self.total = max(self.longest, took), self.total + took
        self.longest_work, self.work = max(self.longest_work, work), self.work + work
        return result


def record_again(record: TrialRecord, folder: Path) -> tuple[Stopwatch, float]:
    """Record what a record holds once more; what the trial waits for, and all CPU time."""
    pixels = [frame.pixels() for frame in record.color]
    joints = record.joints[0]
    frames = {name: track for name, track in record.frames.items() if len(track.time_ns) > 1}
    poses = {name: track.transforms() for name, track in frames.items()}
    watch, began = Stopwatch(), time.process_time()
    recorder = watch(TrialRecorder, folder)
    watch(recorder.start, record.descriptor, record.attachments.values())
    for camera in record.cameras.values():
        watch(recorder.camera, camera)
    for image in record.depth:
        watch(recorder.depth, image)
    watch(recorder.registration, record.registration)
    for n, time_ns in enumerate(joints.time_ns.tolist()):
        now = {name: T[n] for name, T in poses.items() if n < len(T)}
        watch(recorder.frames, time_ns, now)
        watch(recorder.joints, time_ns, joints.names, joints.positions[n])
        watch(recorder.jaw, time_ns, record.jaw.widths[n], record.jaw.forces[n])
    for frame, shot in zip(record.color, pixels, strict=True):
        watch(recorder.color, frame.time_ns, shot, frame.camera)
    for phase in record.phases:
        watch(recorder.phase, phase.name, phase.time_ns)
    watch(recorder.execution, record.execution)
    recorder.stop(record.stop.exit_status)
    return watch, time.process_time() - began


def trial_costs(folders: list[Path], scratch: Path) -> dict[str, Any]:
    """Medians over real takes."""
    found: dict[str, list[float]] = {}
    for number, folder in enumerate(folders):
        record = read_record(folder)
        watch, cpu = record_again(record, scratch / f"again{number}")
        derive_rrd(folder, scratch / "warm.rrd")
        began = time.process_time()
        derive_rrd(folder, scratch / "view.rrd")
        sizes = [(folder / "trial.mcap").stat().st_size, (scratch / "view.rrd").stat().st_size]
        values = {
            "cpu": cpu,
            "longest_call": watch.longest_work,
            "all_calls": watch.work,
            "longest_call_wall": watch.longest,
            "all_calls_wall": watch.total,
            "derive_view": time.process_time() - began,
            "messages": float(record.message_count),
            "color_frames": float(len(record.color)),
            "record_mb": sizes[0] / 1e6,
            "view_mb": sizes[1] / 1e6,
        }
        for name, value in values.items():
            found.setdefault(name, []).append(value)
    return {name: round(statistics.median(values), 4) for name, values in found.items()}


def session_costs(folder: SessionFolder, scratch: Path) -> dict[str, Any]:
    """Index and session view."""
    results: dict[str, Any] = {}

    def measure(name: str, call: Callable[[], Any]) -> Any:
        wall, cpu = time.perf_counter(), time.process_time()
        result = call()
        results[name] = round(time.process_time() - cpu, 3)
        results[f"{name}_wall"] = round(time.perf_counter() - wall, 3)
        return result

    measure("index_build", lambda: rebuild_index(folder))
    rows = measure("list", lambda: list_takes(folder.path))
    labeled = next(row for row in counting(rows) if row.outcome == "success")
    with folder.open_journal() as journal:
        journal.append(
            ev.Relabelled(
                trial_id=labeled.trial_id,
                take=labeled.take,
                outcome=ev.Outcome.SUCCESS,
                operator="benchmark",
                source=ev.Source.OPERATOR_SIM,
            )
        )
    measure("list_after_a_label", lambda: list_takes(folder.path))
    view = measure("view", lambda: write_session_view(folder.path, scratch / "all.rrd"))
    results |= {"takes": len(rows), "view_mb": round(view.stat().st_size / 1e6, 2)}
    results["peak_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)
    return results


def copied(session: Path, to: Path) -> SessionFolder:
    """A session of its own whose records are links; what is under way is left out."""

    def link(source: str, target: str) -> None:
        if Path(source).suffix == ".mcap":
            os.link(source, target)
        else:
            shutil.copyfile(source, target)

    ignored = shutil.ignore_patterns("*.part", "*.rrd", "index.sqlite*", "writer.lock")
    shutil.copytree(session, to, copy_function=link, ignore=ignored)
    journal = to / "events.jsonl"
    content = journal.read_bytes()
    journal.write_bytes(content[: content.rfind(b"\n") + 1])
    return SessionFolder.open(to)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("session", type=Path)
    parser.add_argument("--takes", type=int, default=10)
    chosen = parser.parse_args()
    beside = chosen.session.resolve().parent
    with tempfile.TemporaryDirectory(dir=beside, prefix=".benchmark") as temporary:
        scratch = Path(temporary)
        folder = copied(chosen.session, scratch / "session")
        executed = [row for row in counting(list_takes(folder.path)) if row.record == "complete"]
        folders = [folder.path / row.folder for row in executed[: chosen.takes]]
        result = {"trial": trial_costs(folders, scratch), "session": session_costs(folder, scratch)}
    json.dump(result, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
