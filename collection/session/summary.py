"""A session in one table: object by object, what happened and what each model predicted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from logs.journal.events import Outcome

if TYPE_CHECKING:
    from rich.table import Table

    from logs.journal.state import SessionState, TakeState

ROBUST = "-robust"


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """One object's trials, or all of them.

    Args:
        name: of the object, or `all`.
        trials: labelled trials.
        successes: how many were stably lifted.
        predictions: each model's mean score over the labelled trials it scored.
    """

    name: str
    trials: int
    successes: int
    predictions: dict[str, float]

    @property
    def success_rate(self) -> float | None:
        """Share of successes; None without a labeled trial."""
        return self.successes / self.trials if self.trials else None


def summarize(state: SessionState) -> list[SummaryRow]:
    """One row an object, in the plan's order of first appearance, then one for all."""
    takes: dict[str, list[TakeState]] = {}
    for trial in state.order:
        own = takes.setdefault(trial.planned.object_name, [])
        if trial.status == "labelled" and trial.valid_take is not None:
            own.append(trial.valid_take)
    rows = [_row(name, own) for name, own in takes.items()]
    return [*rows, _row("all", [take for own in takes.values() for take in own])]


def summary_table(rows: Iterable[SummaryRow], *, simulated: bool) -> Table:
    """The rows as a table for the terminal, narrow enough for 80 columns."""
    from rich import box
    from rich.table import Table

    rows = list(rows)
    bases = list(dict.fromkeys(_base(name) for row in rows for name in row.predictions))
    title = "Simulated trials: labels and outcomes come from MuJoCo" if simulated else None
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1))
    table.caption = "percent lifted, and what each model predicted: nominal/robust"
    table.add_column("object", no_wrap=True, max_width=22)
    for heading in ("trials", "lifted", *bases):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        if row.name == "all":
            table.add_section()
        pairs = [_pair(row.predictions, base) for base in bases]
        table.add_row(row.name, str(row.trials), _percent(row.success_rate), *pairs)
    return table


def _base(model: str) -> str:
    return model.removesuffix(ROBUST)


def _pair(predictions: dict[str, float], base: str) -> str:
    found = [predictions.get(base), predictions.get(base + ROBUST)]
    return "/".join(_percent(value) for value in found)


def _row(name: str, takes: list[TakeState]) -> SummaryRow:
    scores: dict[str, list[float]] = {}
    for take in takes:
        for model, scored in take.scores.items():
            scores.setdefault(model, []).append(scored.value)
    return SummaryRow(
        name,
        trials=len(takes),
        successes=sum(
            take.label is not None and take.label.outcome is Outcome.SUCCESS for take in takes
        ),
        predictions={model: sum(values) / len(values) for model, values in scores.items()},
    )


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.0f}"
