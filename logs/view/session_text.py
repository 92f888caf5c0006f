"""The words of a session's view: a line a trial, and a table of contents."""

from __future__ import annotations

from collections.abc import Sequence

from logs.view.session_overview import OverviewRow
from logs.view.text import escaped

UNLABELED = "not labeled"


def headline(shown: OverviewRow, model: str | None) -> str:
    """A trial in one line.

    Args:
        shown: the trial.
        model: whose score is told.
    """
    row = shown.row
    told = [f"{row.number:04d} {row.object_name}: {outcome_of(shown)}"]
    if model is not None and model in row.scores:
        told.append(f"{model} says {row.scores[model]:.2f}")
    if shown.wrong:
        told.append(f"{len(shown.wrong)} of {len(row.scores)} models disagree")
    return "; ".join(told)


def outcome_of(shown: OverviewRow) -> str:
    """A trial's outcome in words."""
    row = shown.row
    reason = f", {row.reason.replace('_', ' ')}" if row.reason else ""
    return f"{row.outcome}{reason}" if row.outcome else UNLABELED


def contents(name: str, shown: Sequence[OverviewRow], model: str | None) -> str:
    """How to browse, and where each object and each outcome begins, as Markdown.

    Args:
        name: of the session.
        shown: its trials.
        model: whose disagreements come first.
    """
    first = f"the largest disagreements of *{escaped(model)}* first" if model else "by number"
    wrong = sum(model in item.wrong for item in shown)
    labeled = sum(item.row.outcome is not None for item in shown)
    lines = [
        f"### {escaped(name)}: {len(shown)} trials",
        f"*{escaped(model)}* disagrees with {wrong} of {labeled} labels." if model else "",
        f"A step is a trial, {first}. Click a line of the list to go to its trial. The menu at"
        " the bottom left chooses another order: *trial*, *by_object*, *by_outcome*.",
        _table("object", "by_object", shown, [item.row.object_name for item in shown], model),
        _table("outcome", "by_outcome", shown, [outcome_of(item) for item in shown], model),
    ]
    return "\n\n".join(line for line in lines if line)


def _table(
    title: str,
    timeline: str,
    shown: Sequence[OverviewRow],
    groups: Sequence[str],
    model: str | None,
) -> str:
    lines = [
        f"| {title} | trials | success | disagree | steps in *{timeline}* |",
        "|---|---|---|---|---|",
    ]
    members: dict[str, list[OverviewRow]] = {}
    for item, group in zip(shown, groups, strict=True):
        members.setdefault(group, []).append(item)
    for group, items in sorted(members.items()):
        places = [item.places[timeline] for item in items]
        success = sum(item.row.outcome == "success" for item in items)
        wrong = sum(model in item.wrong for item in items)
        span = f"{min(places)} to {max(places)}" if len(places) > 1 else f"{places[0]}"
        lines.append(f"| {escaped(group)} | {len(items)} | {success} | {wrong} | {span} |")
    return "\n".join(lines)
