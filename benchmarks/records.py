"""What records cost: `python benchmarks/records.py [--trials 2625] [--memory 1000]`.

Prints one JSON object. A trial here has a 500,000-pixel depth image with sensor noise (so that
it compresses as badly as a real one), a color frame, and 300 samples of joints, jaw and ten
links. Times are CPU seconds of the process unless the name says `wall`.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import resource
import shutil
import sys
import tempfile
import time
import uuid
from pathlib import Path
from types import ModuleType

import numpy as np

from logs.journal import events as ev
from logs.journal.state import PlannedEntry
from logs.record.recorder import TrialRecorder
from logs.record.records import ExitStatus
from logs.record.streams import DepthImage
from logs.session.folder import SessionDescriptor, SessionFolder

FIXTURES = Path(__file__).resolve().parent.parent / "tests" / "logs" / "fixtures"
SHAPE = (600, 840)
SAMPLES = 300


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, FIXTURES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Stopwatch:
    """The longest single call, and the sum of all: what the trial waits for [s]."""

    def __init__(self) -> None:
        self.longest = self.total = 0.0

    def __call__(self, call, *arguments, **named):
        """Call, and measure."""
        began = time.perf_counter()
        result = call(*arguments, **named)
        took = time.perf_counter() - began
        self.longest, self.total = max(self.longest, took), self.total + took
        return result


def record_one(made: ModuleType, folder: Path, depth, color) -> tuple[Stopwatch, float]:
    """Record a trial at a robot's pace; what its thread waited for, and the stop's wall time."""
    watch = Stopwatch()
    recorder = watch(TrialRecorder, folder)
    watch(recorder.start, made.descriptor(made.cube()), attachments(made))
    watch(recorder.phase, "capture")
    watch(recorder.camera, made.camera(SHAPE[1], SHAPE[0]))
    watch(recorder.depth, DepthImage(1, depth))
    watch(recorder.color, 1, color)
    watch(recorder.phase, "register")
    watch(recorder.registration, made.registration())
    watch(recorder.phase, "execute")
    links = {f"link_{k}": np.eye(4) for k in range(10)}
    names = [f"joint_{k}" for k in range(7)]
    for i in range(SAMPLES):
        watch(recorder.frames, i, links)
        watch(recorder.joints, i, names, [0.1] * 7)
        watch(recorder.jaw, i, 0.02, 1.0)
        time.sleep(0.002)
    watch(recorder.execution, made.execution())
    began = time.perf_counter()
    recorder.stop(ExitStatus.SUCCESS)
    return watch, time.perf_counter() - began


def attachments(made: ModuleType):
    from logs.record.descriptions import gripper_attachment, robot_attachment
    from logs.record.mesh_attachment import mesh_attachment
    from reach.gripper import ParallelJawGripper

    gripper = gripper_attachment(ParallelJawGripper.yumi())
    return mesh_attachment(made.cube()), gripper, robot_attachment(made.robot())


def trial_costs(made: ModuleType, root: Path) -> dict[str, float]:
    rng = np.random.default_rng(0)
    depth = (0.7 + rng.normal(0, 5e-4, SHAPE)).astype(np.float32)
    color = rng.integers(0, 255, (*SHAPE, 3)).astype(np.uint8)
    color = (color // 8 + 100).astype(np.uint8)
    record_one(made, root / "warm", depth, color)
    cpu, longest, total, stop = [], [], [], []
    for n in range(10):
        began = time.process_time()
        watch, stopping = record_one(made, root / f"cost{n}", depth, color)
        cpu.append(time.process_time() - began)
        longest.append(watch.longest)
        total.append(watch.total)
        stop.append(stopping)
    began = time.process_time()
    for _ in range(SAMPLES):
        time.sleep(0.002)
    idle = time.process_time() - began
    size = (root / "cost0" / "trial.mcap").stat().st_size
    return {
        "cpu": round(float(np.median(cpu)) - idle, 4),
        "longest_call_wall": round(float(np.median(longest)), 4),
        "all_calls_wall": round(float(np.median(total)), 4),
        "stop_wall": round(float(np.median(stop)), 4),
        "record_mb": round(size / 1e6, 2),
        **view_cost(root / "cost0"),
    }


def view_cost(folder: Path) -> dict[str, float]:
    from logs.record.trial_record import read_record
    from logs.view.trial import derive_rrd

    derive_rrd(folder)
    results = {}
    for name, call in (("derive_view", derive_rrd), ("read_record", read_record)):
        began = time.process_time()
        for _ in range(5):
            call(folder)
        results[name] = round((time.process_time() - began) / 5, 4)
    results["view_mb"] = round((folder / "trial.rrd").stat().st_size / 1e6, 2)
    return results


def session_costs(root: Path, template: Path, count: int) -> dict[str, float]:
    """List and rebuild the index of a large session, whose records are copies of one."""
    from logs.session.index import list_takes, rebuild_index

    folder = large_session(root / "session", template, count)
    results = {"trials": float(count)}
    for name, call in (
        ("index_build", lambda: rebuild_index(folder)),
        ("list", lambda: list_takes(folder.path)),
    ):
        began, cpu = time.perf_counter(), time.process_time()
        call()
        results[f"{name}_wall"] = round(time.perf_counter() - began, 3)
        results[name] = round(time.process_time() - cpu, 3)
    with folder.open_journal() as journal:
        journal.append(ev.Noted(text="a change", operator="sim", source=ev.Source.OPERATOR_SIM))
    began = time.process_time()
    assert len(list_takes(folder.path)) == count
    results["list_after_a_change"] = round(time.process_time() - began, 3)
    return results


def large_session(path: Path, template: Path, count: int) -> SessionFolder:
    trials = tuple(
        PlannedEntry(number=n, trial_id=str(uuid.UUID(int=n)), grasp_id="g", object_name="o")
        for n in range(1, count + 1)
    )
    described = SessionDescriptor(
        created_ns=1, seed=0, config={}, trials=trials, fingerprints={}, simulated=True
    )
    folder = SessionFolder.create(path, described)
    by = {"operator": "sim", "source": ev.Source.OPERATOR_SIM}
    with folder.open_journal() as journal:
        journal._fsync = lambda descriptor: None  # noqa: SLF001 - only the set-up is hurried
        for trial in trials:
            take = folder.trial_folder(trial.trial_id)
            take.mkdir()
            (take / "trial.mcap").hardlink_to(template)
            relative = str((take / "trial.mcap").relative_to(folder.path))
            sensor = ev.SensorVerdict(lifted=True)
            one = {"trial_id": trial.trial_id, "take": 1}
            journal.append(ev.TrialStarted(**one))
            for phase in ev.Phase:
                journal.append(ev.PhaseEntered(**one, phase=phase))
            journal.append(ev.Executed(**one, record=relative, sensor=sensor))
            journal.append(ev.Labelled(**one, outcome=ev.Outcome.SUCCESS, **by))
            for model in ("reach", "point", "ellipse"):
                journal.append(ev.Scored(**one, model=model, version="1", value=0.5))
    return folder


def memory(made: ModuleType, root: Path, count: int) -> dict[str, float]:
    """Resident memory after a tenth of the trials and after all of them [MB]."""
    depth = np.full(SHAPE, 0.7, np.float32)
    found = {}
    for n in range(count):
        with TrialRecorder(root / "memory") as recorder:
            recorder.start(made.descriptor(made.cube()), attachments(made))
            recorder.depth(DepthImage(1, depth))
            for i in range(50):
                recorder.jaw(i, 0.02)
            recorder.phase("execute")
            recorder.stop(ExitStatus.SUCCESS)
        shutil.rmtree(root / "memory")
        if n + 1 in (count // 10, count):
            found[f"resident_mb_after_{n + 1}"] = round(resident_mb(), 1)
    found["peak_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)
    return found


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=2625)
    parser.add_argument("--memory", type=int, default=1000)
    chosen = parser.parse_args()
    made = load("sample_trial")
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary)
        result = {"memory": memory(made, root, chosen.memory)}
        result["trial"] = trial_costs(made, root)
        template = root / "cost0" / "trial.mcap"
        result["session"] = session_costs(root, template, chosen.trials)
    json.dump(result, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
