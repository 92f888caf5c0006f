"""A session's trials in the order in which they deserve a look: disagreements first."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from logs.index import IndexRow
from logs.view_contacts import PREFERRED

TIMELINES = ("disagreement", "trial", "by_object", "by_outcome")
"""Orders to browse in; each counts from 1."""
PREDICTS_SUCCESS = 0.5


@dataclass(frozen=True, slots=True)
class OverviewRow:
    """One trial of the overview.

    Args:
        row: the take that counts.
        places: place in each of TIMELINES, from 1.
        disagreement: distance of the model's score from the label, in [0, 1]; None without
            label or score.
        wrong: the model named the other outcome.
    """

    row: IndexRow
    places: Mapping[str, int]
    disagreement: float | None
    wrong: bool


def judging_model(rows: Sequence[IndexRow]) -> str | None:
    """The model whose disagreements come first: the area contact model if it scored anything."""
    models = sorted({model for row in rows for model in row.scores})
    return PREFERRED if PREFERRED in models else next(iter(models), None)


def overview(takes: Sequence[IndexRow]) -> list[OverviewRow]:
    """The trials that count, disagreements first."""
    rows = [row for row in takes if row.counts and row.record != "missing"]
    model = judging_model(rows)
    gaps = {row.trial_id: disagreement(row, model) for row in rows}

    def by_disagreement(row: IndexRow) -> tuple[float, int]:
        gap = gaps[row.trial_id]
        return (2.0 if gap is None else -gap, row.number)

    keys: dict[str, Callable[[IndexRow], tuple[float | str, ...]]] = {
        "disagreement": by_disagreement,
        "trial": lambda row: (row.number,),
        "by_object": lambda row: (row.object_name, row.outcome or "~", row.number),
        "by_outcome": lambda row: (row.outcome or "~", row.object_name, row.number),
    }
    places: dict[str, dict[str, int]] = {row.trial_id: {} for row in rows}
    for timeline in TIMELINES:
        for place, row in enumerate(sorted(rows, key=keys[timeline]), start=1):
            places[row.trial_id][timeline] = place
    return [
        OverviewRow(row, places[row.trial_id], gaps[row.trial_id], _wrong(gaps[row.trial_id]))
        for row in sorted(rows, key=by_disagreement)
    ]


def disagreement(row: IndexRow, model: str | None) -> float | None:
    """Distance of a model's score from the label, in [0, 1]."""
    value = row.scores.get(model) if model else None
    if value is None or row.outcome is None:
        return None
    return abs(value - (row.outcome == "success"))


def _wrong(gap: float | None) -> bool:
    return gap is not None and gap > PREDICTS_SUCCESS


def headline(shown: OverviewRow) -> str:
    """A trial in one line."""
    row = shown.row
    outcome = row.outcome or "not labeled"
    reason = f" ({row.reason.replace('_', ' ')})" if row.reason else ""
    scores = ", ".join(f"{model} {value:.2f}" for model, value in row.scores.items())
    mark = "disagrees: " if shown.wrong else ""
    return f"{mark}{row.number:04d} {row.object_name}, {outcome}{reason}; {scores or 'no scores'}"
