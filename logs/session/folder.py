"""The session folder: what is planned and with which set-up, and where everything lies.

The folder appears by one rename with `session.json`, the plan and the journal's first line
inside: a kill at any moment leaves no session or one that can be resumed.
"""

from __future__ import annotations

import errno
import os
import shutil
import time
import uuid
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError, model_validator

from logs.durable import sync_directory, write_durably
from logs.errors import NotASessionError, SessionChangedError, SessionExistsError
from logs.journal.events import Entry, SessionCreated, SessionOpened, Source
from logs.journal.file import JOURNAL_NAME, Journal, encode_entry, read_journal
from logs.journal.lock import SessionLock
from logs.journal.state import PlannedEntry, SessionState
from logs.trial_folder import TRIALS, take_folder
from logs.unfinished_view import remove_abandoned_views

SESSION_NAME = "session.json"
PLAN_NAME = "plan.json"
ACCEPTABLE_CHANGES = ("calibration", "camera", "robot")


class SessionDescriptor(BaseModel):
    """The content of session.json: resolved, complete, and never written again.

    Args:
        schema_version: of this file; a release refuses a session of another one.
        session_id: uuid of the session.
        created_ns: nanoseconds since the epoch.
        seed: every random number of the session derives from it.
        config: the resolved configuration (station, options).
        trials: the planned order.
        fingerprints: digest per part of the set-up whose change matters: robot, camera,
            calibration, plan.
        versions: package versions.
        git_commit: commit of this software, if it runs from a repository.
        simulated: True if the station is simulated.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_version: Literal[1] = 1
    session_id: str = Field(default_factory=lambda: str(uuid.uuid4()))
    created_ns: int
    seed: int
    config: dict[str, JsonValue]
    trials: tuple[PlannedEntry, ...]
    fingerprints: dict[str, str]
    versions: dict[str, str] = {}
    git_commit: str | None = None
    simulated: bool

    @model_validator(mode="after")
    def _trials_are_distinct(self) -> SessionDescriptor:
        ids = [trial.trial_id for trial in self.trials]
        if len(set(ids)) != len(ids):
            raise ValueError("two planned trials share one trial_id")
        return self


@dataclass(frozen=True, slots=True, eq=False)
class SessionFolder:
    """An existing session folder."""

    path: Path
    descriptor: SessionDescriptor

    @classmethod
    def create(
        cls,
        path: Path,
        session: SessionDescriptor | Mapping[str, JsonValue],
        files: Mapping[str, str | bytes] | None = None,
    ) -> SessionFolder:
        """Make a session's folder appear, whole.

        Args:
            path: where; nothing may be there yet.
            session: content of session.json.
            files: further files by name, such as plan.json or objects/cube.ply.

        Raises:
            SessionExistsError: if something is there.
        """
        if not isinstance(session, SessionDescriptor):
            session = SessionDescriptor.model_validate(session)
        if path.exists():
            raise SessionExistsError(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove_unfinished(path)
        temporary = path.parent / f".{path.name}.new-{os.getpid()}"
        temporary.mkdir()
        try:
            _fill(temporary, session, files or {})
            os.rename(temporary, path)
        except BaseException as error:
            shutil.rmtree(temporary, ignore_errors=True)
            if isinstance(error, OSError) and error.errno in (errno.ENOTEMPTY, errno.EEXIST):
                raise SessionExistsError(path) from error  # another process was faster
            raise
        sync_directory(path.parent)
        return cls(path, session)

    @classmethod
    def open(cls, path: Path) -> SessionFolder:
        """Read session.json.

        Raises:
            NotASessionError: if the folder holds none, or an unreadable one.
        """
        described = path / SESSION_NAME
        try:
            return cls(path, SessionDescriptor.model_validate_json(described.read_bytes()))
        except (FileNotFoundError, NotADirectoryError) as error:
            raise NotASessionError(
                f"{path} is no session folder (no {SESSION_NAME} in it)"
            ) from error
        except OSError as error:
            raise NotASessionError(f"{described} cannot be read: {error.strerror}") from error
        except ValidationError as error:
            raise NotASessionError(_unreadable(described, error)) from error

    @property
    def journal_path(self) -> Path:
        """The journal file."""
        return self.path / JOURNAL_NAME

    @property
    def plan_path(self) -> Path:
        """The full plan."""
        return self.path / PLAN_NAME

    @property
    def trials(self) -> Path:
        """Folder of the recorded trials."""
        return self.path / TRIALS

    def trial_folder(self, trial_id: str, take: int = 1) -> Path:
        """Where a take of a planned trial is recorded: `trials/0007_<uuid>[_take2]`."""
        number = next(t.number for t in self.descriptor.trials if t.trial_id == trial_id)
        return take_folder(self.path, number, trial_id, take)

    def lock(self) -> SessionLock:
        """Become the one writer without opening the journal: for recovery."""
        return SessionLock(self.path)

    def open_journal(self, *, clock: Callable[[], int] = time.time_ns) -> Journal:
        """Become the one writer of events; clears away what killed writers of views left."""
        remove_abandoned_views(self.path)
        return Journal(self.journal_path, clock=clock)

    def read_state(self) -> SessionState:
        """The state as of now; a writer may be at work."""
        return SessionState.fold(self.descriptor.trials, read_journal(self.journal_path))


def open_segment(
    journal: Journal,
    state: SessionState,
    fingerprints: Mapping[str, str],
    *,
    operator: str,
    source: Source,
    accept: Collection[str] = (),
) -> Entry:
    """Start or resume a session: check the set-up, and log who opened it and with what.

    Args:
        journal: the open journal.
        state: fold of its entries; the new entry is applied to it.
        fingerprints: digests of today's set-up.
        operator: name of the operator.
        source: a person or the simulated operator.
        accept: parts of the set-up whose change opens a new segment.

    Raises:
        SessionChangedError: if a part changed that is not accepted; names what.
    """
    before = state.fingerprints
    changed = {
        name: (before.get(name), fingerprints.get(name))
        for name in sorted(set(before) | set(fingerprints))
        if before and before.get(name) != fingerprints.get(name)
    }
    accepted = set(accept) & set(ACCEPTABLE_CHANGES)
    refused = {name: pair for name, pair in changed.items() if name not in accepted}
    if refused:
        raise SessionChangedError(refused, ACCEPTABLE_CHANGES)
    segment = state.segment + 1 if changed or not before else state.segment
    event = SessionOpened(
        segment=segment,
        fingerprints=dict(fingerprints),
        accepted=tuple(sorted(changed)),
        operator=operator,
        source=source,
    )
    entry = journal.append(event)
    state.apply(entry)
    return entry


def _unreadable(described: Path, error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(map(str, first["loc"]))
    if first["type"] == "json_invalid":
        return (
            f"{described} is torn ({first['msg']}): restore it from a copy; it is written once, and"
            f" what was recorded lies untouched in {TRIALS}/ and {JOURNAL_NAME}"
        )
    return f"{described}: {where or 'content'}: {first['msg']}"


def _fill(folder: Path, session: SessionDescriptor, files: Mapping[str, str | bytes]) -> None:
    first = Entry(
        seq=1, time_ns=session.created_ns, event=SessionCreated(session_id=session.session_id)
    )
    contents: dict[str, str | bytes] = {
        **files,
        SESSION_NAME: session.model_dump_json(indent=1) + "\n",
        JOURNAL_NAME: encode_entry(first),
    }
    for name, content in contents.items():
        (folder / name).parent.mkdir(exist_ok=True)
        write_durably(folder / name, content)
    (folder / TRIALS).mkdir()
    sync_directory(folder)


def _remove_unfinished(path: Path) -> None:
    """Remove what a killed process left while it created this same session."""
    for leftover in path.parent.glob(f".{path.name}.new-*"):
        owner = leftover.name.rpartition("-")[2]
        if owner.isdigit() and not Path(f"/proc/{owner}").exists():
            shutil.rmtree(leftover, ignore_errors=True)
