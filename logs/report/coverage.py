"""How broad the plan was: approach angles, widths, offsets, and what the pads meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from logs.report.charts import MODEL_COLORS, figure, to_svg


@dataclass(frozen=True, slots=True)
class Histogram:
    """Counts of values between edges; one more edge than counts, SI units."""

    edges: tuple[float, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class PlanCoverage:
    """What planned grasps cover.

    Args:
        grasps: how many.
        approach_angle: between approach and straight down [rad].
        width: of the part between the parents' contacts [m].
        offset: of the pads' center from the parents' [m].
        contacts: pads (two a grasp) by what their middle meets: face, edge, corner or miss.
    """

    grasps: int
    approach_angle: Histogram
    width: Histogram
    offset: Histogram
    contacts: Mapping[str, int]

    @property
    def shares(self) -> dict[str, float]:
        """Share of the pads that meet each kind of place."""
        total = max(1, sum(self.contacts.values()))
        return {str(kind): count / total for kind, count in self.contacts.items()}


def coverage_svg(covered: PlanCoverage, name: str = "coverage") -> str:
    """One panel a histogram."""
    panels = (
        ("approach angle [deg]", covered.approach_angle, np.degrees(1.0)),
        ("width [mm]", covered.width, 1e3),
        ("jitter offset [mm]", covered.offset, 1e3),
    )
    with figure((10.0, 2.3), panels=len(panels)) as (canvas, drawn):
        for axes, (title, histogram, scale) in zip(drawn, panels, strict=True):
            edges = np.array(histogram.edges) * scale
            axes.bar(
                edges[:-1],
                histogram.counts,
                width=np.diff(edges),
                align="edge",
                color=MODEL_COLORS["reach"],
                alpha=0.75,
            )
            axes.set_title(title, fontsize=10)
            axes.set_ylabel("grasps")
        return to_svg(canvas, name)
