"""The comparison as a Markdown page: the paper's Table 1 on these labels, beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from statistics import median
from typing import Any

from logs.footnotes import ORACLE, footnotes, shared_with_engine
from logs.numbers import number, signed, span
from logs.report.paper import PAPER_TABLE

METRICS = ("ap", "ar", "f1", "mae", "brier")
SHOWN_PER_OBJECT = ("point", "reach", "reach-robust", "settled-robust", "overlap")


def table_page(content: Mapping[str, Any], command: str) -> str:
    """Make the page.

    Args:
        content: what `reach evaluate --json` writes.
        command: that makes the page again.

    Returns:
        Markdown text.
    """
    from jinja2 import Environment, StrictUndefined

    template = resources.files("logs.report").joinpath("table_page.md").read_text(encoding="utf-8")
    environment = Environment(
        undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False, trim_blocks=True
    )
    environment.filters |= {
        "number": number,
        "span": _bracketed,
        "signed": signed,
        "percent": _percent,
    }
    notes = footnotes(content["models"], simulated=content["simulated"])
    text = environment.from_string(template).render(
        content=content,
        command=command,
        metrics=METRICS,
        rows=_rows(content, notes),
        notes=list(notes),
        oracle=ORACLE,
        shared=shared_with_engine(content["models"], simulated=content["simulated"]),
        lifted=_lifted(content),
        held_out=_held_out_rows(content.get("cross_validation")),
        shown=[name for name in SHOWN_PER_OBJECT if name in content["models"]],
    )
    return text.rstrip() + "\n"


def _rows(content: Mapping[str, Any], notes: Mapping[str, list[str]]) -> list[dict[str, Any]]:
    """The table's lines: name with its footnote's number, whether a reference, figures, paper."""
    marks = {name: number for number, names in enumerate(notes.values(), 1) for name in names}
    return [
        {
            "name": name + (f" [{marks[name]}]" if name in marks else ""),
            "reference": name in content["references"],
            "figures": row,
            "paper": PAPER_TABLE.get(name),
        }
        for name, row in content["models"].items()
    ]


def _held_out_rows(protocol: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Lines of the cross-validation; the paper's figures beside the treatment that it used."""
    if protocol is None:
        return []
    depth = {True: "saturated", False: "unsaturated", None: "none"}
    return [
        {
            "name": name,
            "depth": depth[row["saturated"]],
            "figures": row,
            "chosen": _chosen(row["objects"].values()),
            "paper": None if row["saturated"] else PAPER_TABLE.get(name),
        }
        for name, variants in protocol["models"].items()
        for row in variants
    ]


def _chosen(held_out: Any) -> str:
    """Median and range of each parameter over the choices, one choice an object."""
    values: dict[str, list[float]] = {}
    for one in held_out:
        for name, value in one["parameters"].items():
            values.setdefault(name, []).append(value)
    return ", ".join(
        f"{name} {median(found):.2g} ({min(found):.2g} to {max(found):.2g})"
        for name, found in values.items()
    )


def _lifted(content: Mapping[str, Any]) -> float:
    """Share of all trials that ended stably lifted."""
    objects = content["objects"].values()
    share: float = sum(o["success_rate"] * o["trials"] for o in objects) / content["trials"]
    return share


def _bracketed(bounds: Sequence[float] | None, *, with_sign: bool = False) -> str:
    """A space and an interval in parentheses, or nothing."""
    text = span(bounds, with_sign=with_sign)
    return f" ({text})" if text else ""


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %"
