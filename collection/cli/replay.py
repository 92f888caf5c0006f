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
    web: Annotated[
        bool, typer.Option("--web", help="Serve it to a browser, for work over SSH.")
    ] = False,
    model: Annotated[
        str | None, typer.Option(help="Whose disagreements with the labels come first.")
    ] = None,
    blind: Annotated[
        bool, typer.Option("--blind", help="Hide label, scores and contacts; needs --trial.")
    ] = False,
) -> None:
    """Open one or all trials in the Rerun viewer; missing views are derived again.

    Without --trial: an overview with the disagreements between label and model first, and the
    worst of them in full.

    - `reach replay sessions/monday`
    - `reach replay sessions/monday --trial 7`
    - `reach replay sessions/monday --model reach-robust`
    - `reach replay sessions/monday --web`
    - `reach replay sessions/monday --save monday.rrd --no-viewer`
    """
    from collection.targets import check_files
    from logs.errors import ViewError
    from logs.view.viewer import show_recordings

    if blind and trial is None:
        raise ViewError("--blind hides what the overview is about; choose one trial with --trial")
    if model is not None and trial is not None:
        raise ViewError("--model orders the overview; it says nothing of one trial (--trial)")
    if web and no_viewer:
        raise ViewError("--web opens the viewer in a browser, --no-viewer opens none; choose one")
    if save is not None and save.suffix != ".rrd":
        raise ViewError(f"--save {save}: a recording's name ends in .rrd")
    check_files([save])
    shown = _session(session, model) if trial is None else [_trial(session, trial, blind=blind)]
    if save is not None:
        _copy(shown[0], save)
        print(save)
    if web:
        _serve(shown)
    elif not no_viewer:
        show_recordings(shown)
    elif save is None:
        print(shown[0])


def _trial(session: Path, wanted: str, *, blind: bool) -> Path:
    from logs.session.find_trial import find_take
    from logs.view.trial import fresh_view

    return fresh_view(find_take(session, wanted), blind=blind)


def _session(session: Path, model: str | None) -> list[Path]:
    """The overview, and the full views of the worst disagreements; all views are made fresh."""
    from logs.session.index import list_takes
    from logs.view.session import write_session_view
    from logs.view.session_overview import counting, judging_model, overview
    from logs.view.trial import view_path

    rows = list_takes(session)
    judge = judging_model(counting(rows), model)
    folders = [session / row.folder for row in rows if row.record in ("complete", "damaged")]
    made = set(_fresh_views(folders))
    first = write_session_view(session, session / SESSION_VIEW, judge)
    worst = [view_path(session / item.row.folder) for item in overview(rows, judge)]
    return [first, *[path for path in worst if path in made][:OPENED_WITH_SESSION]]


def _fresh_views(folders: Sequence[Path]) -> Iterator[Path]:
    """Derive what is missing or stale; a take that cannot be shown is told and left out."""
    from rich.console import Console
    from rich.progress import track

    from logs.errors import RecordError
    from logs.view.trial import fresh_view

    console = Console(stderr=True)
    quiet = not console.is_terminal
    for folder in track(folders, "views", console=console, disable=quiet, transient=True):
        try:
            yield fresh_view(folder)
        except RecordError as error:
            print(f"{folder.name} cannot be shown: {error}", file=sys.stderr)


def _serve(shown: Sequence[Path]) -> None:
    """Serve recordings to a browser until Ctrl-C, or until the SSH session is closed."""
    import os
    import signal
    from contextlib import suppress

    from logs.view.viewer import WebViewer

    for ending in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ending, signal.default_int_handler)  # so that the server ends with us
    with suppress(KeyboardInterrupt), WebViewer(shown) as viewer:
        address = viewer.address
        print(f"open {address.link}")
        print(f"from another machine, first: {address.tunnel(os.environ)}")
        print("end with Ctrl-C", flush=True)
        viewer.wait()


def _copy(view: Path, out: Path) -> None:
    from logs.errors import ViewError

    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(view, out)
    except OSError as error:
        raise ViewError(f"cannot write {out}: {error}") from error
