"""Conducts a session from the command line: opens it, runs it, sums it up."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Literal

from rich.console import Console

from collection.errors import OptionsError
from collection.session.opening import Conduct, checked, create_session, reopen_session
from collection.session.options import Sitting
from collection.session.setup import Setup, fingerprints, make_setup
from logs.journal.events import Source
from logs.journal.state import SessionState
from logs.session.folder import SessionFolder, open_segment
from reach.errors import ReachError

if TYPE_CHECKING:
    from collection.station.station import Station
    from labeling.control.controller import SessionController
    from logs.session.mirrored_journal import MirroredJournal


def conduct(asked: Conduct) -> None:
    """Run a new session, or the rest of one.

    Raises:
        ReachError: bad input (nothing was written), or a station that needs a person.
    """
    terminal = Console(stderr=asked.as_json)
    if asked.resume:
        folder, setup, station = reopen_session(asked)
    else:
        folder, setup, station = create_session(asked, terminal)
    _run(asked, folder, setup, station, terminal)
    _sum_up(asked, folder, terminal)


def show_plan(asked: Conduct) -> None:
    """Print what a session would do; nothing moves and nothing is written.

    Raises:
        ReachError: bad input, as if the session were to run.
    """
    from collection.plan.table import pose_table, trial_table

    if asked.resume:
        raise OptionsError(
            "--dry-run shows what a new session would do; `reach status` tells what is left of this"
        )
    options, station = checked(asked)
    setup = make_setup(options, station)
    if asked.as_json:
        print(setup.plan.to_json())
        return
    terminal = Console()
    terminal.print(pose_table(setup.plan, setup.objects.values()))
    terminal.print(trial_table(setup.plan))
    for part in setup.plan.objects:
        for note in part.notes:
            terminal.print(f"{part.name}: {note}", markup=False)


def _run(
    asked: Conduct, folder: SessionFolder, setup: Setup, station: Station, terminal: Console
) -> None:
    from collection.session.ending import stop_station
    from labeling.control.controller import SessionController
    from logs.disk import trials_left
    from logs.session.mirror import AnnotationMirror
    from logs.session.mirrored_journal import MirroredJournal
    from logs.session.recovery import recover_session

    if asked.resume:
        for finding in recover_session(folder.path).findings:
            terminal.print(f"{finding.place}: {finding.text}", markup=False)
    # The session's writer first: who is refused here has not spoken to the robot of the other.
    with folder.open_journal() as stored, station:
        state = SessionState.fold(folder.descriptor.trials, stored.entries)
        journal = MirroredJournal(stored, AnnotationMirror(folder, stored.entries))
        controller = SessionController(
            journal,
            state,
            stop=lambda: stop_station(station),
            trials_left=lambda: trials_left(folder.trials),
        )
        with _closing(controller, state):
            open_segment(
                stored,
                state,
                fingerprints(station, setup.plan),
                operator=asked.sitting.person,
                source=(
                    Source.OPERATOR_SIM if setup.options.operator == "auto" else Source.OPERATOR
                ),
                accept=asked.accepted,
            )
            _lead(asked.sitting, folder, setup, station, controller, journal, terminal)


@contextmanager
def _closing(controller: SessionController, state: SessionState) -> Iterator[None]:
    """Write into the journal how the session ended, and why if it failed."""
    status: Literal["finished", "ended", "failed"] = "failed"
    reason = ""
    try:
        yield
        whole = state.next_work() is None and not controller.ending
        status = "finished" if whole else "ended"
    except ReachError as error:
        reason = str(error)
        raise
    except KeyboardInterrupt:
        status, reason = "ended", "interrupted"
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise
    finally:
        controller.close(status, reason)


def _lead(
    sitting: Sitting,
    folder: SessionFolder,
    setup: Setup,
    station: Station,
    controller: SessionController,
    journal: MirroredJournal,
    terminal: Console,
) -> None:
    """Bring loop, operator, annotator and progress together, until the session ends."""
    from collection.scoring.annotator import Annotator
    from collection.session.ending import ending_on_signals
    from collection.session.operators import WebConsole, simulated_operator
    from collection.session.progress import SessionProgress
    from collection.session.session import Session
    from collection.session.terminal_operator import TerminalOperator
    from collection.trial import TrialContext

    options, described = setup.options, folder.descriptor
    web = WebConsole(controller, setup, folder, sitting, simulated=described.simulated)
    context = TrialContext(
        described.session_id,
        folder.path,
        described.seed,
        station,
        setup.plan,
        setup.objects,
        described.versions,
        None if options.operator == "auto" else web.offer_overlay,
    )
    with ExitStack() as stack:
        progress = stack.enter_context(SessionProgress(controller, terminal))
        annotator = stack.enter_context(
            Annotator(
                folder,
                controller,
                journal,
                options.models,
                station.config.pose_error.total(),
                progress.say,
                quiet=options.operator == "terminal",
            )
        )
        session = Session(
            context,
            controller,
            annotator,
            folder.trial_folder,
            options.attempts,
            attended=options.operator != "auto",
            say=progress.say,
        )
        stack.enter_context(ending_on_signals(controller, station, progress.say))
        session.annotate_earlier()
        if options.operator == "auto":
            stack.enter_context(simulated_operator(controller, station, setup))
            session.run()
        elif options.operator == "terminal":
            link = stack.enter_context(web.serve())
            TerminalOperator(controller, sitting.actor(), link, progress).lead(session.run)
        else:
            link = stack.enter_context(web.serve())
            progress.say(f"console   {link}")
            progress.say("or over SSH: reach console LINK")
            session.run()
        annotator.finish(progress.scoring)


def _sum_up(asked: Conduct, folder: SessionFolder, terminal: Console) -> None:
    from collection.session.summary import summarize, summary_table

    state = folder.read_state()
    rows = summarize(state)
    written = _write_report(asked, folder, terminal)
    if asked.as_json:
        counts = asdict(state.counts())
        facts = {
            "session": str(folder.path),
            "simulated": folder.descriptor.simulated,
            "report": None if written is None else str(written),
            "objects": [{**asdict(row), "success_rate": row.success_rate} for row in rows],
        }
        json.dump({**counts, **facts}, sys.stdout)
        print()
        return
    terminal.print(summary_table(rows, simulated=folder.descriptor.simulated))
    terminal.print(f"session  {folder.path}", markup=False, highlight=False)
    terminal.print(
        f"replay   reach replay {quote(str(folder.path))}", markup=False, highlight=False
    )
    if written is not None:
        terminal.print(f"report   {written}", markup=False, highlight=False)


def _write_report(asked: Conduct, folder: SessionFolder, terminal: Console) -> Path | None:
    state = folder.read_state()
    finished = state.closed is not None and state.closed.status == "finished"
    if not (asked.report and finished and state.counts().labelled):
        return None
    from collection.analysis.reporting import write_report

    page = folder.path / "report.html"
    if not terminal.is_terminal:
        terminal.print("writing the report")
    with terminal.status("writing the report"):
        write_report([folder.path], page)
    return page
