"""The figures of an evaluation: one a maneuver, and the benchmark as bars; and the one look of all figures.

Colors are those of Okabe and Ito, which everyone can tell apart.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from matplotlib.ticker import FuncFormatter

from ...envs.storage import write_bytes
from ..benchmark.table import benchmark
from ..comparison import STILL, normalized_score
from ..metrics import Criteria
from ..results import Results
from ..trajectory import Floats
from .signals import (
    COLORS,
    MOST_SHOWN,
    PANELS,
    Drives,
    Panel,
    gathered_error,
    in_order,
    looks,
    shown_at_first,
)
from .tables import SCORES, has_scores
from .text import fraction, how_many, number

CAR: Final = "#1a1a1a"
LIMIT: Final = "#a61e1e"
FLOOR: Final = 0.01
"""Least J on a logarithmic axis: what lies below is perfect to anyone, and is marked there."""
LOWEST_SCORE: Final = -1.0
"""Least normalized score that is drawn; what lies below is marked there."""

RC: Final[Mapping[str, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#666666",
    "axes.grid": True,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=COLORS),
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
    "pdf.fonttype": 42,
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
    """Color and dash of each policy; the same for the same list, so that all figures agree."""
    return {
        name: {
            "color": color,
            "linestyle": (0, tuple(0.7 * length for length in dash)) if dash else "-",
            **({"linewidth": 1.0} if name == STILL else {}),
        }
        for name, (color, dash) in looks(policies).items()
    }


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
        for limit in filter(np.isfinite, (low, high)):
            axes.axhline(limit, color=LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))
        return
    span = f"±{high:.3g}" if abs(low + high) < 1e-9 * abs(high) else f"{low:.3g} to {high:.3g}"
    axes.set_title(f"limit {span} {unit}", loc="right", color=LIMIT, fontsize=7.5, fontweight="normal")


def save_figure(figure: Figure, stem: Path) -> None:
    """Write ``stem.pdf``, which stays sharp at any size, and ``stem.png`` of 300 dots an inch."""
    for suffix in ("pdf", "png"):
        buffer = io.BytesIO()
        with styled():
            figure.savefig(buffer, format=suffix, dpi=300)
        write_bytes(stem.with_name(f"{stem.name}.{suffix}"), buffer.getvalue())


def png(figure: Figure) -> bytes:
    """The figure as PNG."""
    buffer = io.BytesIO()
    with styled():
        figure.savefig(buffer, format="png")
    return buffer.getvalue()


_COLUMN: Final = 3.5
"""Width of a column of a paper, inches."""
_PANELS: Final = ("f_x", "f_y", "w_z", "tilt_rate", "legs", "gathered")
"""Panels of a figure for print; the report has them all."""
_LINE: Final = 0.2
"""Height of a label beside a panel, as a share of the panel's."""
_PRINT: Final = {
    "axes.labelsize": 7,
    "axes.titlesize": 7.5,
    "lines.linewidth": 1.0,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
}
_LABEL: Final = 6.5
"""Size of the labels, points."""

Styles = Mapping[str, Mapping[str, Any]]


def maneuver_figure(
    drives: Drives,
    policies: Sequence[str] | None = None,
    criteria: Criteria | None = None,
    panels: Sequence[str] = _PANELS,
) -> Figure:
    """The figure of a maneuver for one column of a paper, with labels beside the lines.

    Of more than four policies it shows the references of the score and the best by J.

    Args:
        drives: Trajectory of each policy (at least one), all of the same cues.
        policies: The policies to show, as far as they were driven, if there are at most four.
        criteria: Thresholds to draw.
        panels: Names of the panels, of :data:`~.signals.PANELS`, from top to bottom.
    """
    criteria = criteria or Criteria()
    given = [name for name in policies or () if name in drives]
    shown = given if 0 < len(given) <= MOST_SHOWN else shown_policies(drives, criteria)
    styles = line_styles(shown)
    drives = {name: drives[name] for name in shown}
    chosen = [next(panel for panel in PANELS if panel.name == name) for name in panels]
    with styled(), mpl.rc_context(cast(Any, _PRINT)):
        figure = new_figure(_COLUMN, 0.4 + 1.1 * len(chosen))
        column = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
        for axes, panel in zip(column, chosen, strict=True):
            _panel(axes, panel, drives, styles, criteria)
        for axes, panel in zip(column, chosen, strict=True):
            if panel.name == "gathered":
                _label_errors(axes, drives, styles, criteria)
            elif axes is column[0]:
                _label_lines(axes, panel, drives, styles, criteria)
        column[-1].set_xlabel("time (s)")
        first = next(iter(drives.values()))
        title = f"{first.maneuver} (car {first.car}, motion base {first.platform})"
        figure.suptitle(title, fontsize=8, x=0.01, ha="left")
    return figure


def shown_policies(drives: Drives, criteria: Criteria) -> list[str]:
    """The policies a figure shows: at most four, the references of the score and the best by J."""
    errors = {name: float(gathered_error(drive, criteria)[-1]) for name, drive in drives.items()}
    return shown_at_first(in_order(errors, criteria))


def _panel(axes: Axes, panel: Panel, drives: Drives, styles: Styles, criteria: Criteria) -> None:
    for name, drive in drives.items():
        values = panel.signal(drive, criteria)
        steps: dict[str, Any] = {"drawstyle": "steps-post"} if panel.levels else {}
        if values.ndim == 2:
            color = styles[name]["color"]
            axes.fill_between(drive.time, *values.T, color=color, alpha=0.12, linewidth=0.0)
        for column in np.atleast_2d(values.T):
            axes.plot(drive.time, column, label=name, **styles[name], **steps)
    first = next(iter(drives.values()))
    if panel.car is not None:
        axes.plot(first.time, panel.car(first, criteria), color=CAR, linewidth=1.4, label="car", zorder=1.9)
    if panel.logarithmic:
        axes.set_yscale("log")
    else:
        _widen(axes, panel.least)
    if panel.from_zero:
        axes.set_ylim(bottom=0.0)
    axes.set_title(panel.title)
    axes.set_ylabel(panel.unit)
    axes.margins(x=0.0)
    if panel.limits is not None:
        low, high = panel.limits(first, criteria)
        used = max(_used(panel.signal(drive, criteria), low, high) for drive in drives.values())
        if panel.from_zero:
            axes.set_ylim(0.0, max(axes.get_ylim()[1], 1.3 * high))
            limit_lines(axes, low, high, 1.0, panel.unit)
        elif np.isfinite(high):
            limit_lines(axes, low, high, used, panel.unit)


def _used(values: Floats, low: float, high: float) -> float:
    """Largest share of the way to a limit."""
    return float(max(np.nanmax(values) / high, np.nanmin(values) / low if np.isfinite(low) else 0.0))


def _widen(axes: Axes, least: float) -> None:
    """Keep at least this range in view, so that rounding or tiny motion does not fill a panel."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def _label_errors(axes: Axes, drives: Drives, styles: Styles, criteria: Criteria) -> None:
    """Beside the end of each line the policy, its J and its normalized score."""
    ends = {name: float(gathered_error(drive, criteria)[-1]) for name, drive in drives.items()}
    references = criteria.references
    baseline, optimum = ends.get(references.baseline), ends.get(references.optimum)
    labels = {}
    for name, end in ends.items():
        score = normalized_score(end, baseline, optimum)
        labels[name] = f"{name}\n{end:.2f}" if score is None else f"{name}\n{end:.2f} ({score:.2f})"
    colors = {name: styles[name]["color"] for name in ends}
    _annotate(axes, ends, labels, colors, 2.0 * _LINE)


def _label_lines(axes: Axes, panel: Panel, drives: Drives, styles: Styles, criteria: Criteria) -> None:
    """Beside the end of each line its policy."""
    ends = {
        name: float(np.atleast_2d(panel.signal(drive, criteria).T)[-1, -1]) for name, drive in drives.items()
    }
    colors = {name: styles[name]["color"] for name in ends}
    if panel.car is not None:
        ends["car"], colors["car"] = float(panel.car(next(iter(drives.values())), criteria)[-1]), CAR
    _annotate(axes, ends, {name: name for name in ends}, colors, _LINE)


def _annotate(
    axes: Axes, ends: Mapping[str, float], labels: Mapping[str, str], colors: Mapping[str, str], line: float
) -> None:
    low, high = axes.get_ylim()
    heights = _spread([(end - low) / (high - low) for end in ends.values()], line)
    for (name, end), height in zip(ends.items(), heights, strict=True):
        axes.annotate(
            labels[name],
            xy=(1.0, (end - low) / (high - low)),
            xytext=(1.06, height),
            xycoords="axes fraction",
            textcoords="axes fraction",
            annotation_clip=False,
            color=_darker(colors[name]),
            fontsize=_LABEL,
            linespacing=0.95,
            va="center",
            arrowprops={
                "arrowstyle": "-",
                "color": colors[name],
                "linewidth": 0.5,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )


def _darker(color: str) -> tuple[float, float, float]:
    """A color for text on white."""
    red, green, blue = to_rgb(color)
    return 0.75 * red, 0.75 * green, 0.75 * blue


def _spread(heights: list[float], least: float) -> list[float]:
    """Heights from 0 to 1, moved as far as they must be to lie apart, in the same order, and none above 1."""
    moved: dict[int, float] = {}
    order = sorted(range(len(heights)), key=heights.__getitem__)
    for i in order:
        moved[i] = max(heights[i], max(moved.values(), default=-1.0) + least)
    highest = 1.0
    for i in reversed(order):
        moved[i] = min(moved[i], highest)
        highest = moved[i] - least
    return [moved[i] for i in range(len(heights))]


_BAR_COLORS: Final = ("#0072b2", "#e69f00")
_NAMES: Final = ("J (at the cab)", "perceived J")
_HALF: Final = 0.19
"""Half the distance of a policy's two bars."""


def benchmark_figure(results: Results) -> Figure | None:
    """The benchmark as bars: J of every policy and its normalized score; None with fewer than two policies.

    The right panel is there where the references of the score are among the policies.
    """
    rows = benchmark(results)
    if len(rows) < 2:
        return None
    scored = has_scores(rows)
    with styled():
        figure = new_figure(11.0 if scored else 7.0, 1.3 + 0.42 * len(rows))
        panels = figure.subplots(1, 2 if scored else 1, sharey=True, squeeze=False)[0]
        _error_bars(panels[0], [rows["cue_error"].tolist(), rows["perceived_cue_error"].tolist()])
        if scored:
            _score_bars(panels[1], [rows[name].astype(float).tolist() for name in SCORES])
        panels[0].set_yticks(range(len(rows)), rows["policy"].tolist())
        panels[0].invert_yaxis()
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=9)
        drives = how_many(int(rows["maneuvers"].iloc[0]), "drive")
        where = f"car {results.provenance.car}, motion base {results.provenance.platform}"
        title = f"Benchmark of the controllers, means over {drives} ({where})"
        figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    return figure


def _error_bars(axes: Axes, values: list[list[float]]) -> None:
    least = max(FLOOR, min((v for row in values for v in row if v > 0.0), default=1.0))
    for i, row in enumerate(values):
        _bars(axes, i, row, least, number)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(0.6 * least, 2.5 * max(least, *(max(row) for row in values)))
    axes.set_title("Mean J (logarithmic; below 1 within the indifference zone)")
    axes.axvline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.grid(axis="y", visible=False)


def _score_bars(axes: Axes, values: list[list[float]]) -> None:
    for i, row in enumerate(values):
        _bars(axes, i, row, LOWEST_SCORE, fraction)
    axes.set_xlim(LOWEST_SCORE - 0.25, 1.25)
    axes.axvline(0.0, color=CAR, linewidth=0.8)
    axes.axvline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.set_title("Normalized score: 0 reference washout, 1 optimum")
    axes.grid(axis="y", visible=False)


def _bars(axes: Axes, i: int, values: list[float], least: float, text: Callable[[float], str]) -> None:
    """One bar a policy with its number at the end; a value below the least ends there and is marked."""
    rows = np.arange(len(values)) + (2 * i - 1) * _HALF
    ends = [0.0 if np.isnan(value) else max(value, least) for value in values]
    axes.barh(rows, ends, height=1.8 * _HALF, color=_BAR_COLORS[i], label=_NAMES[i])
    for row, value, end in zip(rows, values, ends, strict=True):
        if not np.isnan(value):
            axes.annotate(
                f"{'◂ ' if value < least else ''}{text(value)}",
                (end, row),
                xytext=(-3 if end < 0.0 else 3, 0),
                textcoords="offset points",
                ha="right" if end < 0.0 else "left",
                va="center",
                fontsize=7.5,
                color="#444444",
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            )
