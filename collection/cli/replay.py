"""`reach replay`: look at recorded trials."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

SESSION_VIEW = "session.rrd"
OPENED_WITH_SESSION = 12
"""So many trials, worst disagreements first, open in full beside the session's overview."""


def replay(
    session: Annotated[Path, typer.Argument(help="The session's folder.")],
    trial: Annotated[
        str | None, typer.Option(help="One trial: its number, id, or the id's beginning.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the recording to this .rrd file.")
    ] = None,
    no_viewer: Annotated[bool, typer.Option("--no-viewer", help="Open no window.")] = False,
    blind: Annotated[
        bool, typer.Option("--blind", help="Hide label, scores and contacts; needs --trial.")
    ] = False,
) -> None:
    """Open one or all trials in the Rerun viewer; missing views are derived again.

    Without --trial: an overview with the disagreements between label and model first, and the
    worst of them in full.

    - `reach replay sessions/monday`
    - `reach replay sessions/monday --trial 7`
    - `reach replay sessions/monday --save monday.rrd --no-viewer`
    """
    from logs.errors import ViewError
    from logs.viewer import show_recordings

    if blind and trial is None:
        raise ViewError("--blind hides what the overview is about; choose one trial with --trial")
    if save is not None and save.suffix != ".rrd":
        raise ViewError(f"--save {save}: a recording's name ends in .rrd")
    shown = _session(session) if trial is None else [_trial(session, trial, blind=blind)]
    if save is not None:
        _copy(shown[0], save)
        print(save)
    if not no_viewer:
        show_recordings(shown)
    elif save is None:
        print(shown[0])


def _trial(session: Path, wanted: str, *, blind: bool) -> Path:
    from logs.find_trial import find_take
    from logs.rerun_view import fresh_view

    return fresh_view(find_take(session, wanted), blind=blind)


def _session(session: Path) -> list[Path]:
    """The overview, and the full views of the worst disagreements; all views are made fresh."""
    from logs.index import list_takes
    from logs.rerun_view import view_path
    from logs.session_overview import overview
    from logs.session_view import write_session_view

    rows = list_takes(session)
    folders = [session / row.folder for row in rows if row.record in ("complete", "damaged")]
    made = set(_fresh_views(folders))
    first = write_session_view(session, session / SESSION_VIEW)
    worst = [view_path(session / item.row.folder) for item in overview(rows)]
    return [first, *[path for path in worst if path in made][:OPENED_WITH_SESSION]]


def _fresh_views(folders: Sequence[Path]) -> Iterator[Path]:
    """Derive what is missing or stale; a take that cannot be shown is told and left out."""
    from rich.console import Console
    from rich.progress import track

    from logs.errors import RecordError
    from logs.rerun_view import fresh_view

    console = Console(stderr=True)
    quiet = not console.is_terminal
    for folder in track(folders, "views", console=console, disable=quiet, transient=True):
        try:
            yield fresh_view(folder)
        except RecordError as error:
            print(f"{folder.name} cannot be shown: {error}", file=sys.stderr)


def _copy(view: Path, out: Path) -> None:
    from logs.errors import ViewError

    try:
        shutil.copyfile(view, out)
    except OSError as error:
        raise ViewError(f"cannot write {out}: {error}") from error
