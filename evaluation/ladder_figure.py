"""The ladder as bars: J of every policy, and its share of the gap."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from .figure_style import CAR, FLOOR, LOWEST_SHARE, new_figure, png, styled
from .ladder import Rung, rungs
from .results import Results
from .text_table import fraction, number
from .words import how_many

_COLOURS: Final = ("#0072b2", "#e69f00")
_NAMES: Final = ("J (at the cab)", "perceived J")
_HALF: Final = 0.19
"""Half the distance of a policy's two bars."""


def ladder_figure(results: Results) -> bytes | None:
    """A PNG of the ladder, or None with fewer than two policies to compare.

    The right panel is there where the references of the share are among the policies.
    """
    found = rungs(results)
    if len(found) < 2:
        return None
    has_share = any(r.standing.share is not None or r.standing.perceived_share is not None for r in found)
    with styled():
        figure = new_figure(11.0 if has_share else 7.0, 1.3 + 0.42 * len(found))
        panels = figure.subplots(1, 2 if has_share else 1, sharey=True, squeeze=False)[0]
        _errors(panels[0], found)
        if has_share:
            _shares(panels[1], found)
        panels[0].set_yticks(range(len(found)), [rung.policy for rung in found])
        panels[0].invert_yaxis()
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=9)
        title = f"The ladder of controllers, means over {how_many(found[0].standing.maneuvers, 'drive')}"
        where = f"car {results.provenance.car}, motion base {results.provenance.platform}"
        figure.suptitle(f"{title} ({where})", fontsize=11, x=0.01, ha="left")
        return png(figure)


def _errors(axes: Axes, found: list[Rung]) -> None:
    values = [[r.standing.cue_error for r in found], [r.standing.perceived_cue_error for r in found]]
    least = max(FLOOR, min((v for row in values for v in row if v > 0.0), default=1.0))
    for i, row in enumerate(values):
        _bars(axes, i, [max(v, least) for v in row])
        for k, value in enumerate(row):
            cut = "◂ " if value < least else ""
            _tell(axes, max(value, least), k, i, f"{cut}{number(value)}")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(0.6 * least, 2.5 * max(least, *(max(row) for row in values)))
    axes.set_title("Mean J (logarithmic; below 1 within what a driver minds)")
    axes.axvline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.grid(axis="y", visible=False)


def _shares(axes: Axes, found: list[Rung]) -> None:
    for i, row in enumerate([[r.standing.share for r in found], [r.standing.perceived_share for r in found]]):
        _bars(axes, i, [0.0 if v is None else max(v, LOWEST_SHARE) for v in row])
        for k, value in enumerate(row):
            if value is not None:
                cut = "◂ " if value < LOWEST_SHARE else ""
                _tell(axes, max(value, LOWEST_SHARE), k, i, f"{cut}{fraction(value)}")
    axes.set_xlim(LOWEST_SHARE - 0.25, 1.25)
    axes.axvline(0.0, color=CAR, linewidth=0.8)
    axes.axvline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
    axes.set_title("Share of the gap: 0 tuned washout, 1 optimum")
    axes.grid(axis="y", visible=False)


def _bars(axes: Axes, i: int, values: list[float]) -> Any:
    rows = np.arange(len(values)) + (2 * i - 1) * _HALF
    return axes.barh(rows, values, height=1.8 * _HALF, color=_COLOURS[i], label=_NAMES[i])


def _tell(axes: Axes, value: float, k: int, i: int, text: str) -> None:
    """The number at the end of a bar."""
    left = value < 0.0
    axes.annotate(
        text,
        (value, k + (2 * i - 1) * _HALF),
        xytext=(-3 if left else 3, 0),
        textcoords="offset points",
        ha="right" if left else "left",
        va="center",
        fontsize=7.5,
        color="#444444",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
    )
