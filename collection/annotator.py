"""Scores labelled takes and draws their views, in a process beside the session.

Predictions are made after the label, so that nobody at the station could have seen one before.
The journal is told first; the annotation files mirror its events.
"""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from logs.events import Entry, Scored
from logs.mirror import AnnotationMirror

if TYPE_CHECKING:
    from collection.scoring import Prediction
    from labeling.controller import SessionController
    from logs.mirrored_journal import MirroredJournal
    from logs.session import SessionFolder
    from logs.state import TakeState
    from reach.pose_error import PoseError

BACKLOG = 12
"""Takes that may wait for their scores before the session waits for them."""


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    trial_id: str
    take: int
    folder: Path
    predictions: Future[list[Prediction]]


class Annotator:
    """Annotates takes in the background; a context manager that finishes them at its end.

    Args:
        session: the session.
        controller: the session's writer.
        journal: the controller's journal.
        models: names of the models that score each take.
        pose_error: of the station, beside registration's own.
    """

    def __init__(
        self,
        session: SessionFolder,
        controller: SessionController,
        journal: MirroredJournal,
        models: Sequence[str],
        pose_error: PoseError,
    ) -> None:
        self._session = session
        self._controller = controller
        self._journal = journal
        self._models = tuple(models)
        self._pose_error = pose_error
        self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("forkserver"))
        self._waiting: deque[_Waiting] = deque()
        self._views: list[Future[None]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.finish()
        self._pool.shutdown(wait=kind is None, cancel_futures=True)

    def lacks(self, take: TakeState) -> bool:
        """Whether a take has not got all its scores."""
        return any(name not in take.scores for name in self._models)

    def annotate(self, trial_id: str, take: TakeState) -> None:
        """Annotate a labelled take soon: the scores it lacks, then its view."""
        assert take.record is not None
        folder = (self._session.path / take.record).parent
        missing = [name for name in self._models if name not in take.scores]
        job = self._pool.submit(_score, folder, missing, self._pose_error)
        self._waiting.append(_Waiting(trial_id, take.take, folder, job))
        while len(self._waiting) > BACKLOG:
            self._store(self._waiting.popleft())
        self.collect()

    def collect(self) -> None:
        """Store the predictions that are ready."""
        while self._waiting and self._waiting[0].predictions.done():
            self._store(self._waiting.popleft())
        done = [view for view in self._views if view.done()]
        self._views = [view for view in self._views if view not in done]
        for view in done:
            view.result()

    def finish(self, progress: Callable[[int], None] | None = None) -> None:
        """Wait until every take is annotated; `progress` hears how many are left."""
        while self._waiting:
            if progress is not None:
                progress(len(self._waiting))
            self._store(self._waiting.popleft())
        for view in self._views:
            view.result()
        self._views.clear()

    def _store(self, waiting: _Waiting) -> None:
        for prediction in waiting.predictions.result():
            entry = self._controller.record(
                scored_event(waiting.trial_id, waiting.take, prediction)
            )
            mirror_score(self._journal.mirror, entry, prediction)
        self._journal.wait_mirrored()  # the view shows the label, too
        self._views.append(self._pool.submit(_derive_view, waiting.folder))


def scored_event(trial_id: str, take: int, prediction: Prediction) -> Scored:
    """A prediction as the journal holds it."""
    details: dict[str, Any] = {
        "seconds": prediction.score.seconds,
        "parameters": dict(prediction.parameters),
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


def _score(folder: Path, models: Sequence[str], pose_error: PoseError) -> list[Prediction]:
    from collection.scoring import score_take

    return score_take(folder, models, pose_error)


def _derive_view(folder: Path) -> None:
    from logs.rerun_view import derive_rrd

    derive_rrd(folder)
