"""The figures of the studies: J over machines, and J under disturbances."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

from .figure_style import CAR, line_styles, new_figure, png, styled
from .study_results import StudyResults, Summary
from .text_table import number

_WORST_RATIO: Final = 4.0
"""Ratio of J at which the darkest colour is reached."""
_TICKS: Final = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Of the colour bar."""
_BRIGHT: Final = 2.4
"""Ratio from which on numbers are white."""


def lines_figure(results: StudyResults) -> bytes | None:
    """A PNG of J and perceived J of each policy over the conditions, or None where nothing was driven."""
    if not results.summaries:
        return None
    with styled():
        figure = new_figure(max(8.0, 1.5 * len(results.conditions) + 5.0), 8.5)
        top, bottom = figure.subplots(2, 1, sharex=True)
        _lines(top, results, False)
        _lines(bottom, results, True)
        top.set_title("J at the cab (logarithmic; below 1 within what a driver minds)")
        bottom.set_title("Perceived J")
        bottom.set_xticks(range(len(results.conditions)), list(results.conditions), rotation=20, ha="right")
        figure.legend(*top.get_legend_handles_labels(), loc="outside right center", fontsize=9)
        title = f"How much machine does a controller need? Mean over {len(results.maneuvers)} drives"
        figure.suptitle(title, fontsize=12, x=0.01, ha="left")
        return png(figure)


def _lines(axes: Axes, results: StudyResults, perceived: bool) -> None:
    styles = line_styles(results.policies)
    for policy in results.policies:
        values = []
        for condition in results.conditions:
            found = results.summaries.get(condition, {}).get(policy)
            values.append(
                math.nan if found is None else found.perceived_cue_error if perceived else found.cue_error
            )
        axes.plot(range(len(values)), values, marker="o", markersize=4.5, label=policy, **styles[policy])
    axes.axhline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(-0.3, len(results.conditions) - 0.7)


def heat_figure(results: StudyResults) -> bytes | None:
    """A PNG of J by policy and condition, coloured by J over that of the first condition.

    None where nothing was driven.
    """
    if not results.summaries:
        return None
    policies, names = list(results.policies), list(results.conditions)
    with styled():
        figure = new_figure(2.6 + 1.5 * len(names), 1.9 + 0.5 * len(policies))
        axes = figure.subplots()
        axes.grid(visible=False)
        scale = LogNorm(1.0 / _WORST_RATIO, _WORST_RATIO)
        image = axes.imshow(_ratios(results), cmap="RdBu_r", norm=scale, aspect="auto", alpha=0.85)
        for i, policy in enumerate(policies):
            for j, condition in enumerate(names):
                found = results.summaries.get(condition, {}).get(policy)
                colour = "white" if found is not None and (found.ratio or 1.0) > _BRIGHT else CAR
                text = _told(found, j == 0)
                axes.text(j, i, text, ha="center", va="center", fontsize=8, color=colour)
        axes.set_xticks(range(len(names)), names)
        axes.set_yticks(range(len(policies)), policies)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        bar = figure.colorbar(image, ax=axes, label=f"J over that of {names[0]}", pad=0.01)
        bar.set_ticks(_TICKS, labels=[f"{tick:g}" for tick in _TICKS])
        bar.ax.yaxis.set_minor_formatter(NullFormatter())
        axes.set_title(f"J, J over {names[0]}, time at a limit; mean over {len(results.maneuvers)} drives")
        return png(figure)


def _ratios(results: StudyResults) -> NDArray[np.float64]:
    """(policies, conditions) J over that under the first condition; NaN where there is none."""
    rows = [
        [results.summaries.get(condition, {}).get(policy) for condition in results.conditions]
        for policy in results.policies
    ]
    return np.array([[math.nan if s is None or not s.ratio else s.ratio for s in row] for row in rows])


def _told(found: Summary | None, first: bool) -> str:
    """What stands in a cell."""
    if found is None:
        return "–"
    ratio = "" if first or found.ratio is None else f"×{found.ratio:.2f}, "
    return f"{number(found.cue_error)}\n{ratio}limits {found.at_limit:.1%}"
