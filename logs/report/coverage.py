"""How broad the plan was: approach angles, widths, offsets, and what the pads meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from logs.report.charts import MODEL_COLORS, figure, to_svg


@dataclass(frozen=True, slots=True)
class Bars:
    """A histogram: what is counted (with its unit), bin edges, counts (one fewer)."""

    title: str
    edges: tuple[float, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class PlanCoverage:
    """What the planned grasps cover.

    Args:
        grasps: how many.
        bars: histograms to draw side by side.
        contacts: pads by what their middle meets: face, edge, corner, miss.
    """

    grasps: int
    bars: tuple[Bars, ...]
    contacts: Mapping[str, int]

    @property
    def shares(self) -> dict[str, float]:
        """Share of the pads that meet each kind of place."""
        total = max(1, sum(self.contacts.values()))
        return {kind: count / total for kind, count in self.contacts.items()}


def coverage_svg(covered: PlanCoverage, name: str = "coverage") -> str:
    """One panel a histogram."""
    with figure((10.0, 2.3), panels=len(covered.bars)) as (canvas, panels):
        for axes, bars in zip(np.atleast_1d(panels), covered.bars, strict=True):
            edges = np.array(bars.edges)
            axes.bar(
                edges[:-1],
                bars.counts,
                width=np.diff(edges),
                align="edge",
                color=MODEL_COLORS["reach"],
                alpha=0.75,
            )
            axes.set_title(bars.title, fontsize=10)
            axes.set_ylabel("grasps")
        return to_svg(canvas, name)
