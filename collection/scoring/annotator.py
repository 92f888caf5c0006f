"""Scores labeled takes and draws their views, in a process beside the session.

Predictions are made after the label, so that nobody at the station could have seen one before.
The journal is told first; the annotation files mirror its events.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

from logs.errors import LogError
from logs.journal.events import Entry, Scored
from logs.session.mirror import AnnotationMirror
from logs.trial_folder import VIEW_NAME
from reach.sources import source_digest

if TYPE_CHECKING:
    from collection.scoring.predictions import Prediction
    from labeling.control.controller import SessionController
    from logs.journal.state import TakeState
    from logs.session.folder import SessionFolder
    from logs.session.mirrored_journal import MirroredJournal
    from reach.pose_error import PoseError

_Result = TypeVar("_Result")

LOOK_PERIOD = 0.2
"""Seconds between looks at whether the session is to end, while scores are waited for."""


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    trial_id: str
    take: int
    folder: Path
    predictions: Future[list[Prediction]]


class Annotator:
    """Annotates takes in the background; a context manager.

    Nobody waits for it before `finish`, and what it cannot do fails no session. Leaving is quick
    and gives up what is not done: whoever resumes the session gets it then.

    Args:
        session: the session.
        controller: the session's writer.
        journal: the controller's journal.
        models: names of the models that score each take.
        pose_error: of the station, beside registration's own.
        say: tells the operator what could not be done.
        quiet: a console owns the terminal: the process beside writes nothing to it.
    """

    def __init__(
        self,
        session: SessionFolder,
        controller: SessionController,
        journal: MirroredJournal,
        models: Sequence[str],
        pose_error: PoseError,
        say: Callable[[str], None],
        quiet: bool = False,
    ) -> None:
        self._session = session
        self._controller = controller
        self._journal = journal
        self._models = tuple(models)
        self._pose_error = pose_error
        self._say = say
        context = multiprocessing.get_context("forkserver")
        lifeline, self._lifeline = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            1, context, initializer=_end_with_session, initargs=(lifeline, quiet)
        )
        self._waiting: deque[_Waiting] = deque()
        self._views: list[Future[None]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lifeline.close()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def lacks(self, take: TakeState) -> bool:
        """Whether a take has not got all its scores, or no view."""
        assert take.record is not None
        view = (self._session.path / take.record).with_name(VIEW_NAME)
        return bool(self._missing(take)) or not view.exists()

    def annotate(self, trial_id: str, take: TakeState) -> None:
        """Annotate a labeled take soon: the scores it lacks, then its view."""
        assert take.record is not None
        folder = (self._session.path / take.record).parent
        job = self._submit(_score, folder, self._missing(take), self._pose_error)
        if job is not None:
            self._waiting.append(_Waiting(trial_id, take.take, folder, job))
        self.collect()

    def collect(self) -> None:
        """Store the predictions that are ready."""
        while self._waiting and self._waiting[0].predictions.done():
            self._store(self._waiting.popleft())
        done = [view for view in self._views if view.done()]
        self._views = [view for view in self._views if view not in done]
        for view in done:
            self._result(view, "a view was not drawn")

    def finish(self, progress: Callable[[int], None]) -> None:
        """Wait until every take is annotated, or the session is to end.

        Args:
            progress: hears how many takes are left.
        """
        told = 0
        while (self._waiting or self._views) and not self._controller.ending:
            if len(self._waiting) not in (0, told):
                told = len(self._waiting)
                progress(told)
            oldest: Future[Any] = self._waiting[0].predictions if self._waiting else self._views[0]
            wait([oldest], LOOK_PERIOD)
            self.collect()
        if self._waiting:
            self._say(f"takes without scores yet: {len(self._waiting)}; --resume scores them")

    def _missing(self, take: TakeState) -> list[str]:
        return [name for name in self._models if name not in take.scores]

    def _store(self, waiting: _Waiting) -> None:
        for prediction in self._result(waiting.predictions, "a take was not scored") or ():
            entry = self._controller.record(
                scored_event(waiting.trial_id, waiting.take, prediction)
            )
            with suppress(LogError):  # the journal has it; recovery writes the file
                mirror_score(self._journal.mirror, entry, prediction)
        self._journal.wait_mirrored()  # the view shows the label, too
        view = self._submit(_derive_view, waiting.folder)
        if view is not None:
            self._views.append(view)

    def _submit(self, call: Callable[..., _Result], *arguments: object) -> Future[_Result] | None:
        try:
            return self._pool.submit(call, *arguments)
        except BrokenProcessPool as error:
            self._say(f"{arguments[0]}: neither scored nor drawn in this sitting ({error})")
            return None

    def _result(self, job: Future[_Result], failed: str) -> _Result | None:
        try:
            return job.result()
        except Exception as error:  # whatever it was: the trial is recorded and labeled
            self._say(f"{failed}: {type(error).__name__}: {error}")
            return None


def scored_event(trial_id: str, take: int, prediction: Prediction) -> Scored:
    """A prediction as the journal holds it."""
    details: dict[str, Any] = {
        "seconds": prediction.score.seconds,
        "parameters": dict(prediction.parameters),
        "sources": source_digest(),
        **prediction.score.details,
    }
    return Scored(
        trial_id=trial_id,
        take=take,
        model=prediction.model,
        version=prediction.version,
        value=prediction.score.value,
        details=details,
    )


def mirror_score(mirror: AnnotationMirror, entry: Entry, prediction: Prediction) -> None:
    """Write a stored prediction's annotation file, contacts included."""
    mirror.note(
        entry,
        patches=prediction.patches,
        parameters={name: str(value) for name, value in prediction.parameters.items()},
        seconds=prediction.score.seconds,
        explanation=str(prediction.score.details.get("reason", "")),
    )


def _end_with_session(lifeline: Connection, quiet: bool) -> None:
    """In the process beside: leave at once when the session does, or when it was killed."""
    if quiet:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)

    def watch() -> None:
        with suppress(EOFError):
            lifeline.recv()
        os._exit(0)

    threading.Thread(target=watch, name="session watch", daemon=True).start()


def _score(folder: Path, models: Sequence[str], pose_error: PoseError) -> list[Prediction]:
    if not models:  # only its view is missing
        return []
    from collection.scoring.predictions import score_take

    return score_take(folder, models, pose_error)


def _derive_view(folder: Path) -> None:
    from logs.view.trial import derive_rrd

    derive_rrd(folder)
