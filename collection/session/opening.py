"""Opens the session that `reach collect` was asked for: a new one, or one begun earlier."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from collection.errors import OptionsError
from collection.session.options import SessionOptions, Sitting
from collection.session.setup import Setup, make_setup, read_setup, same_station
from logs.session.folder import ACCEPTABLE_CHANGES, SessionFolder
from reach.errors import UnknownNameError

if TYPE_CHECKING:
    from rich.console import Console

    from collection.station.station import Station


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


def create_session(asked: Conduct, terminal: Console) -> tuple[SessionFolder, Setup, Station]:
    """Plan a new session and make its folder.

    Raises:
        ReachError: it cannot be; nothing was written.
    """
    options, station = checked(asked)
    with terminal.status("planning"):
        setup = make_setup(options, station)
    folder = SessionFolder.create(asked.out, setup.descriptor(station), setup.files())
    return folder, setup, station


def checked(asked: Conduct) -> tuple[SessionOptions, Station]:
    """What a new session is asked to be, if that can be.

    Raises:
        ReachError: it cannot; nothing was written.
    """
    from logs.errors import SessionExistsError

    options = _resolve(asked.given)
    if asked.accepted:
        raise OptionsError("--accept-change goes with --resume")
    if asked.out.exists():
        raise SessionExistsError(asked.out)
    station = _load(options)
    _check_operator(options, station, asked.sitting)
    return options, station


def reopen_session(asked: Conduct) -> tuple[SessionFolder, Setup, Station]:
    """Open a session that was begun earlier.

    Raises:
        ReachError: what is asked now differs from its plan or its station.
    """
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
    from collection.station.station import load_station

    return load_station(options.station, seed=options.seed)


def _check_operator(options: SessionOptions, station: Station, sitting: Sitting) -> None:
    from collection.session.terminal_operator import has_terminal

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


def _resolve(given: Mapping[str, Any]) -> SessionOptions:
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
