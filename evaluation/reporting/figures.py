"""The figures of an evaluation: one a maneuver, and the benchmark as bars; and the one look of all figures.

Colors are those of Okabe and Ito, which everyone can tell apart.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.rcsetup import cycler
from matplotlib.ticker import FuncFormatter

from ...envs.platform.kernels import ACTUATORS
from ..benchmark.table import benchmark
from ..comparison import STILL, normalized_score
from ..metrics import CUE_AXES, Criteria, cab_motion, cue_error, tilt_rate
from ..results import Results
from ..trajectory import Floats, Trajectory
from .tables import SCORES, has_scores
from .text import fraction, how_many, number

CAR: Final = "#1a1a1a"
LIMIT: Final = "#a61e1e"
FLOOR: Final = 0.01
"""Least J on a logarithmic axis: what lies below is perfect to anyone, and is marked there."""
LOWEST_SCORE: Final = -1.0
"""Least normalized score that is drawn; what lies below is marked there."""
_COLORS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_DASHES: Final = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)))
_STILL_STYLE: Final = {"color": "#8a8a8a", "linestyle": (0, (2, 2)), "linewidth": 1.0}

RC: Final[Mapping[str, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#666666",
    "axes.grid": True,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=_COLORS),
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
    """Color and dash of each policy; the same for the same list, so that all figures agree."""
    moving = [name for name in policies if name != STILL]
    styles: dict[str, dict[str, Any]] = {STILL: dict(_STILL_STYLE)}
    for i, name in enumerate(moving):
        dash = _DASHES[(i // len(_COLORS)) % len(_DASHES)]
        styles[name] = {"color": _COLORS[i % len(_COLORS)], "linestyle": dash}
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
    with styled():
        figure.savefig(buffer, format="png")
    return buffer.getvalue()


_CUES = (
    ("Specific force x (surge)", "m/s²", 1.0),
    ("Specific force y (sway)", "m/s²", 1.0),
    ("Specific force z + g (heave)", "m/s²", 1.0),
    ("Roll rate", "deg/s", np.degrees(1.0)),
    ("Pitch rate", "deg/s", np.degrees(1.0)),
    ("Yaw rate", "deg/s", np.degrees(1.0)),
)
_LEGS = slice(2, 8)
_LINE = 0.075
"""Height of a number beside the panels, as a share of a panel's."""
_MOST = 8
"""Policies that a figure shows; lines of more cannot be told apart."""
_NAMES_A_LINE = 12
"""Names of policies in a line of the caption."""

Drives = Mapping[str, Trajectory]
Styles = Mapping[str, Mapping[str, Any]]


def maneuver_figure(
    drives: Drives, policies: list[str] | None = None, criteria: Criteria | None = None
) -> Figure:
    """The figure of a maneuver: cues of car and simulator, tilt, travel, legs and limits, for each policy.

    Of more than eight policies it shows the references of the score and the best; its caption names the rest.

    Args:
        drives: Trajectory of each policy (at least one), all of the same cues.
        policies: All policies of the evaluation, so that each keeps its color from figure to figure, as far
            as all are shown.
        criteria: Thresholds to draw.
    """
    criteria = criteria or Criteria()
    shown = shown_policies(drives, criteria)
    others = [name for name in drives if name not in shown]
    styles = line_styles(shown if others else policies or list(drives))
    drives = {name: drives[name] for name in shown}
    with styled():
        figure = new_figure(13.0, 14.0)
        grid = figure.subplots(5, 3, sharex=True)
        for i, axes in enumerate(grid[:2].flat):
            _cue(axes, drives, styles, i)
        _tilt(grid[2], drives, styles, criteria)
        _travel(grid[3], drives, styles)
        _legs(grid[4, 0], drives, styles)
        _limit_activity(grid[4, 1], drives, styles)
        _error(grid[4, 2], drives, styles, criteria)
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        first = next(iter(drives.values()))
        title = f"{first.maneuver} (car {first.car}, motion base {first.platform})"
        figure.suptitle(title, fontsize=13, x=0.01, ha="left")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        columns = min(len(labels), 7)
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=9)
        if others:
            lines = [", ".join(others[i : i + _NAMES_A_LINE]) for i in range(0, len(others), _NAMES_A_LINE)]
            caption = "Shown: the references and the best. Numbers of the others are in the tables:\n"
            legend.set_title(caption + ",\n".join(lines), FontProperties(size=8.5))
    return figure


def shown_policies(drives: Drives, criteria: Criteria) -> list[str]:
    """The policies a figure shows: all, or of more than eight the references and the best by J."""
    if len(drives) <= _MOST:
        return list(drives)
    errors = {name: float(np.mean(cue_error(*cab_motion(drive), criteria))) for name, drive in drives.items()}
    references = [
        name for name in (criteria.references.baseline, criteria.references.optimum) if name in drives
    ]
    best = [name for name in sorted(errors, key=errors.__getitem__) if name not in references]
    chosen = {*references, *best[: _MOST - len(references)]}
    return [*references, *(name for name in best if name in chosen)]


def _label(axes: Axes, title: str, unit: str) -> None:
    axes.set_title(title)
    axes.set_ylabel(unit)
    axes.margins(x=0.0)


def _cue(axes: Axes, drives: Drives, styles: Styles, i: int) -> None:
    title, unit, factor = _CUES[i]
    for name, drive in drives.items():
        axes.plot(drive.time, factor * cab_motion(drive)[1][:, i], label=name, **styles[name])
    car = next(iter(drives.values()))
    axes.plot(car.time, factor * cab_motion(car)[0][:, i], color=CAR, linewidth=1.6, label="car", zorder=1.9)
    _widen(axes, 1.0 if CUE_AXES[i].startswith("f") else 5.0)
    _label(axes, title, unit)


def _widen(axes: Axes, least: float) -> None:
    """Keep at least this range in view, so that rounding or tiny motion does not fill a panel."""
    low, high = axes.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def _tilt(row: Any, drives: Drives, styles: Styles, criteria: Criteria) -> None:
    def curves(
        axes: Axes, title: str, unit: str, signal: Callable[[Trajectory], Floats], least: float
    ) -> None:
        for name, drive in drives.items():
            axes.plot(drive.time, np.degrees(signal(drive)), **styles[name])
        _widen(axes, least)
        _label(axes, title, unit)

    curves(row[0], "Hexapod roll", "deg", lambda drive: drive.hexapod[:, 3], 2.0)
    curves(row[1], "Hexapod pitch", "deg", lambda drive: drive.hexapod[:, 4], 2.0)
    curves(row[2], "Tilt rate beyond the car's own", "deg/s", tilt_rate, 0.0)
    row[2].set_ylim(0.0, max(row[2].get_ylim()[1], 1.3 * np.degrees(criteria.tilt_rate)))
    row[2].axhline(np.degrees(criteria.tilt_rate), color=LIMIT, linewidth=0.9, linestyle=(0, (4, 2)))


def _travel(row: Any, drives: Drives, styles: Styles) -> None:
    for axes, i, title, unit in (
        (row[0], 0, "Carriage x", "m"),
        (row[1], 1, "Carriage y", "m"),
        (row[2], 8, "Turntable", "deg"),
    ):
        factor = np.degrees(1.0) if unit == "deg" else 1.0
        for name, drive in drives.items():
            axes.plot(drive.time, factor * drive.positions[:, i], **styles[name])
        _widen(axes, 0.5 * factor)
        _limits(axes, drives, slice(i, i + 1), factor, unit)
        _label(axes, title, unit)


def _legs(axes: Axes, drives: Drives, styles: Styles) -> None:
    for name, drive in drives.items():
        color = styles[name]["color"]
        lowest, highest = drive.legs.min(axis=1), drive.legs.max(axis=1)
        axes.fill_between(drive.time, lowest, highest, color=color, alpha=0.18, linewidth=0.0)
        axes.plot(drive.time, lowest, drive.time, highest, **{**styles[name], "linewidth": 0.9})
    _widen(axes, 0.1)
    _limits(axes, drives, _LEGS, 1.0, "m")
    _label(axes, "Legs, shortest to longest of the six", "m from neutral")


def _limits(axes: Axes, drives: Drives, actuators: slice, factor: float, unit: str) -> None:
    """Limits of actuators that share them, if there are any."""
    table = next(iter(drives.values())).limits
    low, high = table.position_min[actuators].max(), table.position_max[actuators].min()
    if not (np.isfinite(low) and np.isfinite(high) and low < 0.0 < high):
        return
    positions = [drive.positions[:, actuators] for drive in drives.values()]
    used = max(float(max(p.max() / high, p.min() / low)) for p in positions)
    limit_lines(axes, factor * low, factor * high, used, unit)


def _limit_activity(axes: Axes, drives: Drives, styles: Styles) -> None:
    """For each policy the number of actuators at a limit."""
    for name, drive in drives.items():
        axes.plot(
            drive.time, np.count_nonzero(drive.limits_active, axis=1), **styles[name], drawstyle="steps-post"
        )
    axes.set_ylim(-0.2, len(ACTUATORS) + 0.2)
    axes.set_yticks(range(0, len(ACTUATORS) + 1, 3))
    _label(axes, "Actuators at a limit", f"of {len(ACTUATORS)}")


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


def _error(axes: Axes, drives: Drives, styles: Styles, criteria: Criteria) -> None:
    """The cue error gathered so far; its last value is J, and beside it the normalized score."""
    ends: dict[str, float] = {}
    for name, drive in drives.items():
        error = np.cumsum(cue_error(*cab_motion(drive), criteria)) / len(drive)
        axes.plot(drive.time, error, **styles[name])
        ends[name] = float(error[-1])
    baseline, optimum = (
        ends.get(name) for name in (criteria.references.baseline, criteria.references.optimum)
    )
    axes.set_ylim(bottom=0.0)
    heights = _spread([end / axes.get_ylim()[1] for end in ends.values()], _LINE)
    for (name, end), height in zip(ends.items(), heights, strict=True):
        score = normalized_score(end, baseline, optimum)
        text = f"{end:.2f}" if score is None else f"{end:.2f} ({score:.2f})"
        style = {"color": styles[name]["color"], "fontsize": 8, "va": "center"}
        axes.annotate(text, (1.01, height), xycoords="axes fraction", annotation_clip=False, **style)
    scores = "" if baseline is None or optimum is None else " (normalized score)"
    _label(axes, f"Cue error so far, to J{scores}", "J")


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
