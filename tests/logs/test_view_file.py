"""A view's file costs nothing once it is written."""

import signal
import subprocess
import sys
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from logs.journal.state import PlannedEntry
from logs.session.folder import SessionDescriptor, SessionFolder
from logs.unfinished_view import unfinished_view
from logs.view.file import view_file

KILLED = """
import os, signal, sys
from pathlib import Path
import rerun as rr, rerun.blueprint as rrb
from logs.view.file import view_file
with view_file("reach-test", "r", Path(sys.argv[1]), rrb.Blueprint(rrb.Spatial3DView())) as view:
    view.log("points", rr.Points3D([[0, 0, 0]]))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def threads() -> int:
    return len(list(Path("/proc/self/task").iterdir()))


def write(path: Path, number: int) -> None:
    layout = rrb.Blueprint(rrb.Spatial3DView(origin="/"))
    with view_file("reach-test", f"view-{number}", path, layout) as recording:
        recording.log("points", rr.Points3D([[0.0, 0.0, number]]))


def test_a_day_of_views_leaves_no_threads_behind(tmp_path: Path) -> None:
    for number in range(3):
        write(tmp_path / "view.rrd", number)
    after_three = threads()
    for number in range(3, 20):
        write(tmp_path / "view.rrd", number)
    assert threads() <= after_three


def test_a_killed_writers_unfinished_view_goes_when_the_session_is_opened_again(
    tmp_path: Path,
) -> None:
    planned = PlannedEntry(number=1, trial_id="t1", grasp_id="g1", object_name="cube")
    described = SessionDescriptor(
        created_ns=1, seed=1, config={}, trials=(planned,), fingerprints={}, simulated=True
    )
    session = SessionFolder.create(tmp_path / "S", described)
    take = session.trial_folder("t1")
    take.mkdir(parents=True)
    killed = subprocess.run(
        [sys.executable, "-c", KILLED, str(take / "trial.rrd")], capture_output=True, check=False
    )
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    left = {path.suffix for path in take.iterdir()}
    assert left == {".part", ".rbl"}
    ours = unfinished_view(take / "trial.rrd")
    ours.write_bytes(b"being drawn")
    kept = take / "trial.mcap.part"  # a record that recovery salvages
    kept.write_bytes(b"record")
    session.open_journal().close()
    assert set(take.iterdir()) == {ours, kept}


def test_the_layout_is_inside_every_view(tmp_path: Path) -> None:
    path = tmp_path / "view.rrd"
    for number in range(10):
        write(path, number)
        reader = RrdReader(str(path))
        assert len(reader.recordings()) == 1
        assert len(reader.blueprints()) == 1
    assert [left.name for left in tmp_path.iterdir()] == ["view.rrd"]
