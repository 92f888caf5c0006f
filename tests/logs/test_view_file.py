"""A view's file costs nothing once it is written."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from logs.view.file import view_file


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


def test_the_layout_is_inside_every_view(tmp_path: Path) -> None:
    path = tmp_path / "view.rrd"
    for number in range(10):
        write(path, number)
        reader = RrdReader(str(path))
        assert len(reader.recordings()) == 1
        assert len(reader.blueprints()) == 1
    assert [left.name for left in tmp_path.iterdir()] == ["view.rrd"]
