"""One look for every figure: colours that everyone can tell apart (Okabe and Ito), light grid, units."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from .verdict import STILL

CAR: Final = "#1a1a1a"
LIMIT: Final = "#a61e1e"
FLOOR: Final = 0.01
"""Least J on a logarithmic axis: what lies below is perfect to anyone, and is marked there."""
LOWEST_SHARE: Final = -1.0
"""Least share of the gap that is drawn; what lies below is marked there."""
_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_DASHES: Final = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)))
_STILL_STYLE: Final = {"color": "#8a8a8a", "linestyle": (0, (2, 2)), "linewidth": 1.0}

RC: Final[Mapping[str, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#666666",
    "axes.grid": True,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=_COLOURS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "figure.dpi": 110,
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "savefig.facecolor": "white",
    "xtick.color": "#444444",
    "xtick.labelsize": 8,
    "ytick.color": "#444444",
    "ytick.labelsize": 8,
}
"""Settings of matplotlib; see :func:`styled`."""


def styled() -> AbstractContextManager[None]:
    """Within this context figures are drawn in the style; nothing global changes for good."""
    settings: Any = dict(RC)
    return mpl.rc_context(settings)


def new_figure(width: float, height: float, **layout: Any) -> Figure:
    """An empty figure of a size in inches that belongs to no global state; draw it within :func:`styled`."""
    figure = Figure(figsize=(width, height), layout="constrained", **layout)
    FigureCanvasAgg(figure)
    return figure


def line_styles(policies: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Colour and dash of each policy; the same for the same list, so that all figures agree."""
    moving = [name for name in policies if name != STILL]
    styles: dict[str, dict[str, Any]] = {STILL: dict(_STILL_STYLE)}
    for i, name in enumerate(moving):
        dash = _DASHES[(i // len(_COLOURS)) % len(_DASHES)]
        styles[name] = {"color": _COLOURS[i % len(_COLOURS)], "linestyle": dash}
    return {name: styles[name] for name in policies}


def limit_lines(axes: Axes, low: float, high: float, used: float, unit: str, shown_from: float = 0.4) -> None:
    """Draw limits where the motion comes near them; elsewhere say beside the title where they are.

    Args:
        axes: Where to draw.
        low: Lower limit, in the unit of the axes.
        high: Upper limit.
        used: Share of the limits in use.
        unit: Of the axes, for the note.
        shown_from: Least share at which the lines are drawn, so that small motions stay readable.
    """
    if used >= shown_from:
        for limit in (low, high):
            axes.axhline(limit, color=LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))
        return
    span = f"±{high:.3g}" if abs(low + high) < 1e-9 * abs(high) else f"{low:.3g} to {high:.3g}"
    axes.set_title(f"limit {span} {unit}", loc="right", color=LIMIT, fontsize=7.5, fontweight="normal")


def png(figure: Figure) -> bytes:
    """The figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
