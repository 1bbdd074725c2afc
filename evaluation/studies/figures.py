"""The figures of the studies: J over machines, and J under disturbances."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from ..reporting.figures import CAR, FLOOR, LOWEST_SCORE, line_styles, new_figure, styled
from ..reporting.tables import SCORES
from ..reporting.text import NOTHING, how_many, number, percent
from .results import StudyResults, Summary

_WORST_RATIO: Final = 4.0
"""Ratio of J at which the darkest color is reached."""
_TICKS: Final = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Of the color bar."""
_BRIGHT: Final = 2.4
"""Ratio from which on numbers are white."""


def lines_figure(results: StudyResults) -> Figure | None:
    """J and perceived J of each policy over the conditions, or None where nothing was driven.

    Panels of the normalized score stand beside them where the references are among the policies.
    """
    if not results.summaries:
        return None
    rows = [s.row for policies in results.summaries.values() for s in policies.values()]
    scored = any(row[name] is not None for row in rows for name in SCORES)
    columns = 2 if scored else 1
    with styled():
        figure = new_figure(3.0 + columns * max(5.0, 1.1 * len(results.conditions) + 2.0), 8.5)
        grid = figure.subplots(2, columns, sharex=True, squeeze=False)
        for axes, perceived in zip(grid[:, 0], (False, True), strict=True):
            _errors(axes, results, perceived)
        for axes, perceived in zip(grid[:, 1] if scored else (), (False, True), strict=False):
            _scores(axes, results, perceived)
        names = list(results.conditions)
        for axes in grid[-1]:
            axes.set_xlim(-0.3, len(names) - 0.7)
            axes.set_xticks(range(len(names)), names, rotation=20, ha="right")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside right center", fontsize=9)
        mean = f"Mean over {how_many(len(results.maneuvers), 'drive')}"
        title = f"How much machine does a controller need? {mean}"
        figure.suptitle(title, fontsize=12, x=0.01, ha="left")
    return figure


def _errors(axes: Axes, results: StudyResults, perceived: bool) -> None:
    _lines(axes, results, lambda s: s.perceived_cue_error if perceived else s.cue_error, FLOOR)
    axes.axhline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.set_yscale("log")
    axes.set_ylim(bottom=max(axes.get_ylim()[0], 0.8 * FLOOR))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_title("Perceived J" if perceived else "J at the cab; below 1 within the indifference zone")


def _scores(axes: Axes, results: StudyResults, perceived: bool) -> None:
    _lines(
        axes,
        results,
        lambda s: s.perceived_normalized_score if perceived else s.normalized_score,
        LOWEST_SCORE,
    )
    axes.axhline(0.0, color=CAR, linewidth=0.8)
    axes.axhline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.set_ylim(LOWEST_SCORE - 0.1, 1.25)
    about = "Perceived score" if perceived else "Normalized score"
    axes.set_title(f"{about}: 0 reference washout, 1 optimum")
    if not any(np.isfinite(line.get_ydata(orig=False)).any() for line in axes.get_lines()[:-2]):
        axes.text(0.5, 0.4, "its optimum is not among the policies", transform=axes.transAxes, ha="center")


def _lines(axes: Axes, results: StudyResults, value: Callable[[Summary], float | None], floor: float) -> None:
    """A line a policy; values below the floor lie on it, marked with a triangle that points down."""
    styles = line_styles(results.driven)
    below = False
    for policy in results.driven:
        numbers = [None if summary is None else value(summary) for summary in results.across(policy)]
        values = np.array([math.nan if v is None else v for v in numbers])
        low = values < floor
        shown = np.where(low, floor, values)
        axes.plot(range(len(values)), shown, label=policy, **styles[policy])
        color = styles[policy]["color"]
        for marker, chosen in (("o", ~low), ("v", low)):
            axes.plot(np.flatnonzero(chosen), shown[chosen], marker, markersize=5.0, color=color)
        below = below or bool(low.any())
    if below:
        axes.set_title(f"▾ below {floor:g}", loc="right", fontsize=7.5, fontweight="normal", color="#5d6878")


def heat_figure(results: StudyResults) -> Figure | None:
    """J by policy and condition, colored by J over that of the first condition.

    None where nothing was driven.
    """
    if not results.summaries:
        return None
    policies, names = list(results.driven), list(results.conditions)
    with styled():
        figure = new_figure(2.6 + 1.5 * len(names), 1.9 + 0.5 * len(policies))
        axes = figure.subplots()
        axes.grid(visible=False)
        scale = LogNorm(1.0 / _WORST_RATIO, _WORST_RATIO)
        cells = [results.across(policy) for policy in policies]
        ratios = [[math.nan if s is None or not s.ratio else s.ratio for s in row] for row in cells]
        image = axes.imshow(np.array(ratios), cmap="RdBu_r", norm=scale, aspect="auto", alpha=0.85)
        for i, row in enumerate(cells):
            for j, summary in enumerate(row):
                color = "white" if summary is not None and (summary.ratio or 1.0) > _BRIGHT else CAR
                text = _cell(summary, j == 0)
                axes.text(j, i, text, ha="center", va="center", fontsize=8, color=color)
        axes.set_xticks(range(len(names)), names)
        axes.set_yticks(range(len(policies)), policies)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        bar = figure.colorbar(image, ax=axes, label=f"J over that of {names[0]}", pad=0.01)
        bar.set_ticks(_TICKS, labels=[f"{tick:g}" for tick in _TICKS])
        bar.ax.yaxis.set_minor_formatter(NullFormatter())
        drives = how_many(len(results.maneuvers), "drive")
        axes.set_title(f"J, J over {names[0]}, time at a limit; mean over {drives}")
    return figure


def _cell(summary: Summary | None, first: bool) -> str:
    """Text of a cell."""
    if summary is None:
        return NOTHING
    ratio = "" if first or summary.ratio is None else f"×{summary.ratio:.2f}, "
    return f"{number(summary.cue_error)}\n{ratio}limits {percent(summary.metrics['at_limit'])}%"
