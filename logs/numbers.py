"""Numbers of a comparison as text, the same in the terminal, on the page and in Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence


def counted(count: int, noun: str) -> str:
    """A number of things: `1 object`, `2 objects`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def number(value: float | None, digits: int = 3) -> str:
    """A figure, or a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}f}"


def signed(value: float | None, digits: int = 3) -> str:
    """A difference with its sign, or a dash where there is none."""
    return "–" if value is None else f"{value:+.{digits}f}"


def span(bounds: Sequence[float] | None, *, with_sign: bool = False) -> str:
    """An interval with two digits, rounded outward; empty where there is none.

    Rounded to the nearest it could claim more than is known: .996 to .999 would read 1.00 to 1.00.
    """
    if bounds is None:
        return ""
    low = math.floor(100.0 * bounds[0] + 1e-6) / 100.0
    high = math.ceil(100.0 * bounds[1] - 1e-6) / 100.0
    low, high = low + 0.0, high + 0.0  # no negative zero
    return f"{low:+.2f} to {high:+.2f}" if with_sign else f"{low:.2f} to {high:.2f}"
