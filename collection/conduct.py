"""Conducts a session from the command line: checks, creates or resumes, runs, sums up."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError
from rich.console import Console

from collection.errors import OptionsError
from collection.options import SessionOptions, Sitting
from collection.setup import (
    Setup,
    fingerprints,
    make_setup,
    read_setup,
    same_station,
)
from logs.journal.events import Source
from logs.journal.state import SessionState
from logs.session.folder import ACCEPTABLE_CHANGES, SessionFolder, open_segment
from reach.errors import ReachError, UnknownNameError

if TYPE_CHECKING:
    from collection.station import Station
    from labeling.controller import SessionController
    from logs.session.mirrored_journal import MirroredJournal


@dataclass(frozen=True, slots=True)
class Conduct:
    """What `reach collect` was asked.

    Args:
        out: the session's folder.
        given: the options that were given, by name.
        resume: continue the session in `out`.
        accepted: parts of the set-up that may have changed.
        sitting: who labels, and where the console listens.
        report: whether to write the report at the end.
        as_json: print the summary as JSON, and nothing else, on standard output.
    """

    out: Path
    given: Mapping[str, Any]
    resume: bool
    accepted: tuple[str, ...]
    sitting: Sitting
    report: bool
    as_json: bool


def conduct(asked: Conduct) -> None:
    """Run a new session, or the rest of one.

    Raises:
        ReachError: bad input (nothing was written), or a station that needs a person.
    """
    terminal = Console(stderr=asked.as_json)
    if asked.resume:
        folder, setup, station = _reopen(asked)
    else:
        folder, setup, station = _create(asked, terminal)
    with station:
        _run(asked, folder, setup, station, terminal)


def show_plan(asked: Conduct) -> None:
    """Print what a session would do; nothing moves and nothing is written.

    Raises:
        ReachError: bad input, as if the session were to run.
    """
    from collection.plan_table import pose_table, trial_table

    if asked.resume:
        raise OptionsError(
            "--dry-run shows what a new session would do; `reach status` tells what is left of this"
        )
    options, station = _checked(asked)
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


def resolve(given: Mapping[str, Any]) -> SessionOptions:
    """The options with their defaults.

    Raises:
        OptionsError: a missing or impossible value, named.
    """
    if not given.get("objects"):
        from collection.objects import OBJECT_NAMES

        raise OptionsError(
            f"--objects is missing: name built-in objects or mesh files, or `all`;"
            f" built-in: {', '.join(OBJECT_NAMES)}"
        )
    try:
        return SessionOptions(**given)
    except ValidationError as error:
        first = error.errors()[0]
        name = str(first["loc"][0]).replace("_", "-")
        told = first["msg"].removeprefix("Value error, ")
        given_value = first["input"]
        typed = ",".join(given_value) if isinstance(given_value, tuple) else given_value
        raise OptionsError(f"--{name} {typed!r}: {told}") from error


def _create(asked: Conduct, terminal: Console) -> tuple[SessionFolder, Setup, Station]:
    options, station = _checked(asked)
    with terminal.status("planning"):
        setup = make_setup(options, station)
    folder = SessionFolder.create(asked.out, setup.descriptor(station), setup.files())
    return folder, setup, station


def _checked(asked: Conduct) -> tuple[SessionOptions, Station]:
    """What a new session is asked to be, if that can be.

    Raises:
        ReachError: it cannot; nothing was written.
    """
    from logs.errors import SessionExistsError

    options = resolve(asked.given)
    if asked.accepted:
        raise OptionsError("--accept-change goes with --resume")
    if asked.out.exists():
        raise SessionExistsError(asked.out)
    station = _load(options)
    _check_operator(options, station, asked.sitting)
    return options, station


def _reopen(asked: Conduct) -> tuple[SessionFolder, Setup, Station]:
    folder = SessionFolder.open(asked.out)
    setup = read_setup(folder)
    for name in asked.accepted:
        if name not in ACCEPTABLE_CHANGES:
            raise UnknownNameError("change", name, ACCEPTABLE_CHANGES)
    planned = setup.options.model_dump()
    for name in (
        "objects",
        "grasps",
        "repeats",
        "seed",
        "session",
        "mesh_unit",
        "models",
        "min_probability",
    ):
        if name in asked.given and asked.given[name] != planned[name]:
            raise OptionsError(
                f"--{name.replace('_', '-')} {asked.given[name]!r} differs from the session's"
                f" {planned[name]!r}: a session keeps its plan; start another with --out"
            )
    changed = {k: asked.given[k] for k in ("station", "operator") if k in asked.given}
    options = setup.options.model_copy(update=changed)
    station = _load(options)
    same_station(station, setup, asked.out)
    _check_operator(options, station, asked.sitting)
    return folder, replace(setup, options=options, station_text=station.text), station


def _load(options: SessionOptions) -> Station:
    from collection.station import load_station

    return load_station(options.station, seed=options.seed)


def _check_operator(options: SessionOptions, station: Station, sitting: Sitting) -> None:
    from collection.terminal_operator import has_terminal

    if options.operator == "auto" and station.simulation is None:
        raise OptionsError(
            f"--operator auto looks at a simulation's truth, and station {options.station!r} is"
            " real; choose web or terminal"
        )
    if options.operator == "terminal" and not has_terminal():
        raise OptionsError(
            "--operator terminal needs a terminal, and this process has none; choose web, and"
            " `reach console LINK` where there is one"
        )
    if options.operator != "auto":
        sitting.access()  # refuses an address that others could reach


def _run(
    asked: Conduct, folder: SessionFolder, setup: Setup, station: Station, terminal: Console
) -> None:
    from collection.ending import stop_station
    from labeling.controller import SessionController
    from logs.disk import trials_left
    from logs.session.mirror import AnnotationMirror
    from logs.session.mirrored_journal import MirroredJournal
    from logs.session.recovery import recover_session

    if asked.resume:
        for finding in recover_session(folder.path).findings:
            terminal.print(f"{finding.place}: {finding.text}", markup=False)
    stored = folder.open_journal()
    state = SessionState.fold(folder.descriptor.trials, stored.entries)
    journal = MirroredJournal(stored, AnnotationMirror(folder, stored.entries))
    controller = SessionController(
        journal,
        state,
        stop=lambda: stop_station(station),
        trials_left=lambda: trials_left(folder.trials),
    )
    auto = setup.options.operator == "auto"
    status: Literal["finished", "ended", "failed"] = "failed"
    reason = ""
    try:
        open_segment(
            stored,
            state,
            fingerprints(station, setup.plan),
            operator=asked.sitting.person,
            source=Source.OPERATOR_SIM if auto else Source.OPERATOR,
            accept=asked.accepted,
        )
        _lead(asked.sitting, folder, setup, station, controller, journal, terminal)
        whole = state.next_work() is None and not controller.ending
        status = "finished" if whole else "ended"
    except ReachError as error:
        reason = str(error)
        raise
    except KeyboardInterrupt:
        status, reason = "ended", "interrupted"
        raise
    finally:
        controller.close(status, reason)
    _sum_up(asked, folder, terminal)


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
    from collection.annotator import Annotator
    from collection.ending import ending_on_signals
    from collection.operators import WebConsole, simulated_operator
    from collection.progress import SessionProgress
    from collection.session import Session
    from collection.terminal_operator import TerminalOperator
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
    from collection.summary import summarize, summary_table

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
    terminal.print(f"replay   reach replay {folder.path}", markup=False, highlight=False)
    if written is not None:
        terminal.print(f"report   {written}", markup=False, highlight=False)


def _write_report(asked: Conduct, folder: SessionFolder, terminal: Console) -> Path | None:
    state = folder.read_state()
    finished = state.closed is not None and state.closed.status == "finished"
    if not (asked.report and finished and state.counts().labelled):
        return None
    from collection.reporting import write_report

    page = folder.path / "report.html"
    if not terminal.is_terminal:
        terminal.print("writing the report")
    with terminal.status("writing the report"):
        write_report([folder.path], page)
    return page
