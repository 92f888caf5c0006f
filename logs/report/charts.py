"""Charts as SVG text that stands in a page: its ink follows the page, light or dark."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_INK = "#010203"
"""Drawn with, then replaced by the page's text color."""
STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 10.0,
    "text.color": _INK,
    "axes.labelcolor": _INK,
    "axes.edgecolor": _INK,
    "axes.titlecolor": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "legend.frameon": False,
    "grid.color": _INK,
    "grid.alpha": 0.12,
    "grid.linewidth": 0.5,
    "axes.grid": True,
    "axes.axisbelow": True,
}
MODEL_COLORS = {
    "reach": "#2563eb",
    "point": "#ea7317",
    "ellipse": "#8b5cf6",
    "settled": "#0d9f6e",
    "dynamic": "#c2255c",
    "constant": "#94a3b8",
    "overlap": "#a98467",
    "oracle": "#7b8794",
}
SUCCESS_COLOR, FAILURE_COLOR = "#0d9f6e", "#d9480f"


@contextmanager
def figure(size: tuple[float, float], panels: int = 1) -> Iterator[Any]:
    """A matplotlib figure with panels side by side, in the page's style.

    Args:
        size: width and height [inches].
        panels: number of axes.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=size, layout="constrained")
        axes = canvas.subplots(1, panels, squeeze=False)[0]
        yield canvas, (axes[0] if panels == 1 else list(axes))


def to_svg(canvas: Any, name: str) -> str:
    """The figure as an `<svg>` element; ids are distinct for distinct names.

    The same figure gives the same text.
    """
    import matplotlib as mpl

    stream = io.StringIO()
    with mpl.rc_context({**STYLE, "svg.hashsalt": name}):
        canvas.savefig(stream, format="svg", dpi=160, metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :].strip()
    text = text.replace(_INK, "currentColor")
    text = text.replace(' id="', f' id="{name}-').replace("url(#", f"url(#{name}-")
    return text.replace('xlink:href="#', f'xlink:href="#{name}-')


def color_of(model: str) -> str:
    """A model's color; its robust variant has the same one."""
    return MODEL_COLORS.get(model.removesuffix("-robust"), "#475569")


def dashes_of(model: str) -> Any:
    """Robust models and the oracle are drawn solid, nominal models and references dashed."""
    return "-" if model.endswith("-robust") or model in ("dynamic", "oracle") else (0, (4, 2))
