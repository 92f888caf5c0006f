"""The comparison as it is printed: one line a model, references apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from logs.numbers import counted, number, signed, span

if TYPE_CHECKING:
    from rich.table import Table

HEADERS = ("model", "AP", "95 %", "AR", "F1", "MAE", "Brier", "s/grasp")
METRICS = ("ap", "ar", "f1", "mae", "brier")


def evaluation_table(content: Mapping[str, Any]) -> list[Table]:
    """The tables of an evaluation's JSON content."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    marked = " - simulated labels" if content["simulated"] else ""
    title = (
        f"{counted(content['trials'], 'trial')} of {counted(content['grasps'], 'grasp')} on "
        f"{counted(len(content['objects']), 'object')}{marked}"
    )
    table = Table(title=title, title_justify="left", caption=_caption(content), box=SIMPLE_HEAD)
    for header in HEADERS:
        table.add_column(header, justify="left" if header == "model" else "right", no_wrap=True)
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


def _gains_table(found: Sequence[Mapping[str, Any]]) -> Table:
    """The paper's finding: REACH recalls more than the point model, at no lower precision."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title="The paper's finding: AR at least .11 above at no lower AP",
        title_justify="left",
        box=SIMPLE_HEAD,
    )
    for header in ("model", "against", "AR", "95 %", "AP", "95 %", "found"):
        named = header in ("model", "against")
        table.add_column(header, justify="left" if named else "right", no_wrap=not named)
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
        table.add_row(gain["model"], gain["rival"], *cells)
    return table


def _majority_table(content: Mapping[str, Any]) -> Table:
    """The same with one label a grasp."""
    from rich.table import Table

    table = Table(
        title="One label a grasp: lifted in more than half of its trials", title_justify="left"
    )
    for header in ("model", "AP", "AR", "F1", "MAE", "Brier"):
        table.add_column(header, justify="left" if header == "model" else "right", no_wrap=True)
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
    from rich.table import Table

    table = Table(
        title=f"Leave one object out, {content['draws']} parameter draws", title_justify="left"
    )
    for header in ("model", "depth", "AP", "AR", "F1", "MAE", "Brier"):
        table.add_column(header, justify="left" if header in ("model", "depth") else "right")
    depth = {True: "saturated", False: "unsaturated", None: ""}
    for name, variants in content["models"].items():
        for row in variants:
            numbers = (number(row[key]) for key in METRICS)
            table.add_row(name, depth[row["saturated"]], *numbers)
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
