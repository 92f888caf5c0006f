"""Finding recorded trials to label again."""

from __future__ import annotations

from typing import Final

from pydantic import BaseModel, ConfigDict

from labeling.display.view import View, label_view, to_judge, trial_view
from logs.journal.events import LabelEvent, Outcome
from logs.journal.state import SessionState, TakeState, TrialState
from logs.prediction import predicts_success

DISAGREEMENT: Final = "disagreement"


class Filter(BaseModel):
    """Which trials to list; every given part must hold.

    Args:
        object: name of the object.
        outcome: `success`, `failure`, or `unlabelled`.
        margin_below: registration margin (to the best rival pose) below this.
        disagrees_with: name of a model whose score is on the other side of one half than the
            operator's blind label; a verdict on such a trial is not blind.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    object: str | None = None
    outcome: str | None = None
    margin_below: float | None = None
    disagrees_with: str | None = None

    @property
    def tells_verdicts(self) -> bool:
        """True if the list tells what the verdicts on its trials are."""
        return self.outcome is not None or self.disagrees_with is not None

    @property
    def found_by(self) -> str | None:
        """The name under which a verdict notes how its trial was found."""
        return DISAGREEMENT if self.disagrees_with else None


def review_list(state: SessionState, wanted: Filter, *, second: str | None) -> list[View]:
    """The executed trials that match, in planned order.

    Args:
        state: the session.
        wanted: what to list.
        second: the name of a second operator, to whom only their own verdicts are shown, and only
            trials that they may judge: labeled, and by somebody else.
    """
    return [
        _item(trial, take, take.label if second is None else take.second_labels.get(second))
        for trial in state.trials.values()
        if (take := executed_take(trial) if second is None else to_judge(trial, second))
        if matches(trial, take, wanted)
    ]


def executed_take(trial: TrialState) -> TakeState | None:
    """The take that counts, unless the trial is skipped."""
    return None if trial.skipped else trial.valid_take


def matches(trial: TrialState, take: TakeState, wanted: Filter) -> bool:
    """True if a trial is among the wanted ones."""
    if wanted.object is not None and trial.planned.object_name != wanted.object:
        return False
    label = take.label
    outcome = label.outcome.value if label else "unlabelled"
    if wanted.outcome is not None and outcome != wanted.outcome:
        return False
    if wanted.margin_below is not None and not _margin_below(take, wanted.margin_below):
        return False
    return wanted.disagrees_with is None or disagrees(take, wanted.disagrees_with)


def disagrees(take: TakeState, model: str) -> bool:
    """True if a model's score and the blind label are on different sides."""
    label = take.blind_label or take.label
    score = take.scores.get(model)
    if label is None or score is None:
        return False
    return predicts_success(score.value) != (label.outcome is Outcome.SUCCESS)


def models_scored(state: SessionState) -> tuple[str, ...]:
    """Names of the models that scored any trial."""
    names = {
        model for trial in state.trials.values() for take in trial.takes for model in take.scores
    }
    return tuple(sorted(names))


def _margin_below(take: TakeState, limit: float) -> bool:
    registration = take.info.get("registration", take.info)
    margin = registration.get("margin") if isinstance(registration, dict) else None
    return isinstance(margin, (int, float)) and margin < limit


def _item(trial: TrialState, take: TakeState, shown: LabelEvent | None) -> View:
    return {
        **trial_view(trial, take),
        "label": label_view(shown),
        "needs_label": trial.needs_label,
    }
