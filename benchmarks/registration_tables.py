"""The registration benchmark's rows, and the tables that are printed of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

CATEGORIES = {
    "nearly round": ("round_superellipsoid", "near_sphere", "lemon"),
    "told by a small key": (
        "keyed_cylinder",
        "slotted_cylinder",
        "flatted_shaft",
        "bumped_torus",
        "notched_nut",
        "eccentric_disc",
        "near_cube",
        "keyed_gear",
        "mug",
    ),
}
"""By how a part's name begins; all others are ordinary."""
ALIKE = {"structured-light": 2e-3, "stereo": 4e-3}
"""Surfaces closer than this are the strict measure's same surface [m]."""


@dataclass(frozen=True)
class Row:
    """One method on one image."""

    method: str
    sensor: str
    part: str
    category: str
    case: int
    refused: bool
    accepted: bool
    unasked: bool
    adds: bool
    strict: bool
    surface: float
    rotation: float
    translation: float
    margin: float
    cost: float
    within90: bool
    seconds: float


def category(name: str) -> str:
    """Category of a part by its name."""
    for kind, beginnings in CATEGORIES.items():
        if name.startswith(beginnings):
            return kind
    return "ordinary"


def print_methods(rows: Sequence[Row], sensor: str, ours: Collection[str]) -> None:
    """All methods, all parts together."""
    print(
        f"{sensor}\n{'method':42s} ADD-S strict  mm   deg  p50 ms p95 ms"
        "  right acc. wrong acc. in 90%"
    )
    for method in dict.fromkeys(row.method for row in rows):
        mine = [row for row in rows if row.method == method and row.sensor == sensor]
        right = [row for row in mine if row.strict]
        seconds = np.array([row.seconds for row in mine]) * 1e3
        line = (
            f"{method:42s} {_share([row.adds for row in mine])} "
            f"{_share([row.strict for row in mine])} "
            f"{1e3 * np.median([row.translation for row in mine]):5.2f} "
            f"{np.degrees(np.median([row.rotation for row in mine])):5.2f} "
            f"{np.median(seconds):6.0f} {np.quantile(seconds, 0.95):6.0f}"
        )
        if method in ours:
            line += (
                f"     {_share([row.accepted for row in right])}"
                f"      {sum(row.accepted and not row.strict for row in mine):3d}"
                f"    {_share([row.within90 for row in right if row.accepted])}"
            )
        print(line)


def print_categories(rows: Sequence[Row], sensor: str, ours: Collection[str]) -> None:
    """Ours, by category of part: who is asked about, and what is wrong when nobody is."""
    print(f"{'method, category':62s} cases strict right acc. unasked wrong acc. unasked off")
    for method in ours:
        for kind in ("ordinary", *CATEGORIES):
            mine = [r for r in rows if (r.method, r.sensor, r.category) == (method, sensor, kind)]
            if not mine:
                continue
            print(
                f"{method + ', ' + kind:62s} {len(mine):5d} {_share([r.strict for r in mine])} "
                f"    {_share([r.accepted for r in mine if r.strict])} "
                f"  {_share([r.unasked for r in mine])} "
                f"      {sum(r.accepted and not r.strict for r in mine):4d} "
                f"       {sum(r.unasked and r.surface > ALIKE[sensor] for r in mine):4d}"
            )


def print_parts(rows: Sequence[Row], sensor: str, ours: Collection[str]) -> None:
    """Ours, part by part, all modes together."""
    print(f"{'part':24s} cases strict right acc. wrong acc. asked refused")
    mine = [row for row in rows if row.sensor == sensor and row.method in ours]
    for name in dict.fromkeys(row.part for row in mine):
        own = [row for row in mine if row.part == name]
        print(
            f"{name:24s} {len(own):5d} {_share([row.strict for row in own])}     "
            f"{_share([row.accepted for row in own if row.strict])}"
            f"      {sum(row.accepted and not row.strict for row in own):4d} "
            f"{sum(not row.accepted and not row.refused for row in own):5d} "
            f"{sum(row.refused for row in own):7d}"
        )


def _share(flags: Sequence[bool]) -> str:
    return f"{100 * np.mean(flags):5.1f}" if flags else "    -"
