"""A session's trials in the order in which they deserve a look: disagreements first."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from logs.errors import ViewError
from logs.prediction import predicts_success
from logs.session.index_table import IndexRow
from reach.models.names import JUDGES

TIMELINES = ("disagreement", "trial", "by_object", "by_outcome")
"""Orders to browse in; each counts from 1."""


@dataclass(frozen=True, slots=True)
class OverviewRow:
    """One trial of the overview.

    Args:
        row: the take that counts.
        places: place in each of TIMELINES, from 1.
        disagreement: distance of the judging model's score from the label, in [0, 1]; None
            without label or score.
        wrong: models that named the other outcome.
    """

    row: IndexRow
    places: Mapping[str, int]
    disagreement: float | None
    wrong: tuple[str, ...]


def judging_model(rows: Sequence[IndexRow], wanted: str | None = None) -> str | None:
    """The model whose disagreements come first; None if nothing was scored.

    Raises:
        ViewError: if the wanted model scored nothing.
    """
    models = sorted({model for row in rows for model in row.scores})
    if wanted is not None and wanted not in models:
        raise ViewError(f"no trial has a score of {wanted!r}; valid: {', '.join(models) or 'none'}")
    return next((m for m in (wanted, *JUDGES, *models) if m in models), None)


def counting(takes: Sequence[IndexRow]) -> list[IndexRow]:
    """The takes that count and have a record."""
    return [row for row in takes if row.counts and row.record != "missing"]


def overview(takes: Sequence[IndexRow], model: str | None = None) -> list[OverviewRow]:
    """The trials that count, disagreements first.

    Args:
        takes: of the session.
        model: the judging model.
    """
    rows = counting(takes)
    gaps = {row.trial_id: disagreement(row, model) for row in rows}

    def by_disagreement(row: IndexRow) -> tuple[float, float, int]:
        gap = gaps[row.trial_id]
        return (2.0 if gap is None else -gap, -_mean_disagreement(row), row.number)

    keys: dict[str, Callable[[IndexRow], tuple[float | str, ...]]] = {
        "disagreement": by_disagreement,
        "trial": lambda row: (row.number,),
        "by_object": lambda row: (row.object_name, *_outcome_order(row), row.number),
        "by_outcome": lambda row: (*_outcome_order(row), row.object_name, row.number),
    }
    places: dict[str, dict[str, int]] = {row.trial_id: {} for row in rows}
    for timeline in TIMELINES:
        for place, row in enumerate(sorted(rows, key=keys[timeline]), start=1):
            places[row.trial_id][timeline] = place
    return [
        OverviewRow(row, places[row.trial_id], gaps[row.trial_id], _wrong(row))
        for row in sorted(rows, key=by_disagreement)
    ]


def disagreement(row: IndexRow, model: str | None) -> float | None:
    """Distance of a model's score from the label, in [0, 1]."""
    value = row.scores.get(model) if model else None
    if value is None or row.outcome is None:
        return None
    return abs(value - (row.outcome == "success"))


def _mean_disagreement(row: IndexRow) -> float:
    """Of all models: among equals, what misled most of them comes first."""
    gaps = [gap for model in row.scores if (gap := disagreement(row, model)) is not None]
    return sum(gaps) / len(gaps) if gaps else 0.0


def _outcome_order(row: IndexRow) -> tuple[str, str]:
    return (row.outcome or "~", row.reason or "")  # not yet labeled: last


def _wrong(row: IndexRow) -> tuple[str, ...]:
    if row.outcome is None:
        return ()
    label = row.outcome == "success"
    return tuple(m for m, value in row.scores.items() if predicts_success(value) != label)
