"""The comparison as it is printed: one line a model, references apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from logs.numbers import counted, number, signed, span

if TYPE_CHECKING:
    from rich.table import Table

HEADERS = ("model", "AP", "95 %", "AR", "F1", "MAE", "Brier", "s/grasp")
NARROW = (0, 0, 0, 1)
"""Padding: a space to the left, so that the tables fit into 80 columns."""
METRICS = ("ap", "ar", "f1", "mae", "brier")


def evaluation_table(content: Mapping[str, Any]) -> list[Table]:
    """The tables of an evaluation's JSON content."""
    marked = " - simulated labels" if content["simulated"] else ""
    title = (
        f"{counted(content['trials'], 'trial')} of {counted(content['grasps'], 'grasp')} on "
        f"{counted(len(content['objects']), 'object')}{marked}"
    )
    table = _table(title, HEADERS)
    table.caption, table.caption_justify = _caption(content), "left"
    references = set(content["references"])
    for name, row in content["models"].items():
        style = "dim" if name in references else None
        table.add_row(*_cells(name, row), style=style)
    tables = [table]
    if content["gains"]:
        tables.append(_gains_table(content["gains"]))
    tables.append(_majority_table(content))
    if "cross_validation" in content:
        tables.append(_cross_validation_table(content["cross_validation"]))
        tables.append(_gains_table(content["cross_validation"]["gains"]))
    return tables


def _table(title: str, headers: Sequence[str]) -> Table:
    """An empty table: names to the left, figures to the right."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(title=f"\n{title}", title_justify="left", box=SIMPLE_HEAD, padding=NARROW)
    for header in headers:
        named = header in ("model", "depth")
        table.add_column(header, justify="left" if named else "right", no_wrap=True)
    return table


def _gains_table(found: Sequence[Mapping[str, Any]]) -> Table:
    """The paper's finding: REACH recalls more than the point model, at no lower precision."""
    table = _table(
        "REACH above the point model; the paper found AR +.11 at no lower AP",
        ("model", "AR", "95 %", "AP", "95 %", "found"),
    )
    for gain in found:
        cells = [
            signed(gain["ar"]),
            span(gain["ar_interval"], with_sign=True) or "–",
            signed(gain["ap"]),
            span(gain["ap_interval"], with_sign=True) or "–",
            {True: "yes" if gain["certain"] else "yes?", False: "no", None: "–"}[
                gain["as_published"]
            ],
        ]
        table.add_row(gain["model"], *cells)
    return table


def _majority_table(content: Mapping[str, Any]) -> Table:
    """The same with one label a grasp."""
    table = _table(
        "One label a grasp: what most of its trials say",
        ("model", "AP", "AR", "F1", "MAE", "Brier"),
    )
    references = set(content["references"])
    for name, row in content["models"].items():
        numbers = (number(row["majority"][key]) for key in METRICS)
        table.add_row(name, *numbers, style="dim" if name in references else None)
    return table


def print_table(tables: list[Table]) -> None:
    """Print tables on standard output."""
    from rich.console import Console

    console = Console(width=None)
    for table in tables:
        console.print(table)


def _cells(name: str, row: Mapping[str, Any]) -> list[str]:
    return [
        name,
        number(row["ap"]),
        span(row["intervals"]["ap"]) or "–",
        *(number(row[key]) for key in METRICS[1:]),
        f"{row['seconds_per_grasp']:.2g}" if row["seconds_per_grasp"] else "–",
    ]


def _caption(content: Mapping[str, Any]) -> str:
    from logs.footnotes import ORACLE, footnotes

    error = content["pose_error"]
    text = (
        f"Means over objects. {content['interval_note']} Pose error {error['translation'] * 1e3:.2f} "
        f"mm, {error['rotation']:.4f} rad ({error['basis']})."
    )
    without = content["objects_without_positive"]
    if without:
        text += f" Left out of AP and AR, no trial lifted: {', '.join(without)}."
    for note, models in footnotes(content["models"], simulated=content["simulated"]).items():
        text += f" {', '.join(models)}: {note}."
    text += f" The {ORACLE}."
    return text


def _cross_validation_table(content: Mapping[str, Any]) -> Table:
    table = _table(
        f"Leave one object out, {content['draws']} parameter draws",
        ("model", "depth", "AP", "95 %", "AR", "F1", "MAE", "Brier"),
    )
    depth = {True: "saturated", False: "unsaturated", None: ""}
    for name, variants in content["models"].items():
        for row in variants:
            rest = (number(row[key]) for key in METRICS[1:])
            interval = span(row["intervals"]["ap"]) or "–"
            table.add_row(name, depth[row["saturated"]], number(row["ap"]), interval, *rest)
    if content["exempt"]:
        table.caption = f"Parameters not drawn: {', '.join(content['exempt'])}."
    return table


@contextmanager
def progress_bars() -> Iterator[Callable[[str, int, int], None]]:
    """One progress bar a model, on standard error."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TaskID,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description:>16}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    bars = Progress(*columns, console=Console(stderr=True), transient=True)
    tasks: dict[tuple[str, int], TaskID] = {}

    def report(name: str, done: int, total: int) -> None:
        bars.start()  # not before: bad input is told in one line
        key = (name, total)
        if key not in tasks:
            tasks[key] = bars.add_task(name, total=total)
        bars.update(tasks[key], completed=done)

    try:
        yield report
    finally:
        if tasks:
            bars.stop()
