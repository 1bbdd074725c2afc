"""The figures of the benchmark: intervals by policy, and performance profiles over drives."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from ..reporting.figures import CAR, line_styles, new_figure, styled
from ..reporting.text import how_many, number
from .results import BenchmarkResults
from .statistics import profile

PER_PANEL: Final = 6
"""Most policies in a panel."""
_THRESHOLDS: Final = np.geomspace(0.01, 100.0, 81)
_WIDTH: Final = 4.2
_ORDER: Final = ("now", "controls", "road")


def groups_of(results: BenchmarkResults, platform: str) -> list[tuple[str, list[str]]]:
    """Policies by what they know, at most :data:`PER_PANEL` in a group."""
    policies = results.platforms[platform]

    def rank(policy: str) -> tuple[int, str]:
        known = policies[policy].information
        return (_ORDER.index(known) if known in _ORDER else len(_ORDER), known)

    found = []
    for (_, known), same in groupby(sorted(policies, key=rank), key=rank):
        names = list(same)
        count = -(-len(names) // PER_PANEL)
        size = -(-len(names) // count)
        found += [(known, names[k : k + size]) for k in range(0, len(names), size)]
    return found


def interval_figure(results: BenchmarkResults, platform: str) -> Figure:
    """Mean J of each policy with its interval, median and worst tenth; a column a split."""
    return _grid(results, platform, _intervals, shared=True, height=lambda names: 0.55 + 0.3 * len(names))


def profile_figure(results: BenchmarkResults, platform: str) -> Figure:
    """Share of drives with a J up to each value, with its band; a column a split."""
    return _grid(results, platform, _profiles, shared=False, height=lambda names: 2.3)


_Panel = Callable[[Axes, BenchmarkResults, str, str, "list[str]"], None]


def _grid(
    results: BenchmarkResults,
    platform: str,
    draw: _Panel,
    shared: bool,
    height: Callable[[list[str]], float],
) -> Figure:
    splits = [split.name for split in results.splits]
    groups = groups_of(results, platform)
    heights = [height(names) for _, names in groups]
    with styled():
        figure = new_figure(2.0 + _WIDTH * len(splits), 1.0 + sum(heights))
        grid = figure.subplots(
            len(groups),
            len(splits),
            squeeze=False,
            sharex="col" if shared else False,
            gridspec_kw={"height_ratios": heights},
        )
        for row, (known, names) in zip(grid, groups, strict=True):
            for axes, split in zip(row, splits, strict=True):
                draw(axes, results, platform, split, names)
                axes.set_xscale("log")
                axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                axes.xaxis.set_minor_formatter(NullFormatter())
                axes.axvline(1.0, color=CAR, linewidth=0.8, linestyle=(0, (4, 2)))
            row[0].set_ylabel(f"knows: {known}")
            for axes in row[1:]:
                axes.tick_params(labelleft=False)
        for axes, one in zip(grid[0], results.splits, strict=True):
            axes.set_title(f"{one.name}, {how_many(len(one.drives), 'drive')}")
        for axes in grid[-1]:
            axes.set_xlabel("J")
    return figure


def _intervals(axes: Axes, results: BenchmarkResults, platform: str, split: str, names: list[str]) -> None:
    summaries = results.of_split(platform, split)
    styles = line_styles(names)
    for k, name in enumerate(names):
        if name not in summaries:
            continue
        one, color = summaries[name], styles[name]["color"]
        mean = one.mean
        if mean.low is not None and mean.high is not None:
            axes.plot([mean.low, mean.high], [k, k], color=color, linewidth=5.0, alpha=0.35)
        axes.plot(mean.value, k, "o", color=color, markersize=6.0, label="mean, 95 % interval")
        axes.plot(one.median.value, k, "|", color=color, markersize=11.0, markeredgewidth=2.0)
        axes.plot(one.worst_tenth.value, k, ">", color=color, markersize=5.0)
        axes.annotate(
            number(mean.value), (mean.value, k), (0, 6), textcoords="offset points", ha="center", fontsize=7
        )
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.75)


def _profiles(axes: Axes, results: BenchmarkResults, platform: str, split: str, names: list[str]) -> None:
    styles = line_styles(names)
    for name in names:
        result = results.platforms[platform][name]
        finished = result.finished(split)
        if not finished:
            continue
        share, low, high = profile(result.values(split, "cue_error", finished), _THRESHOLDS)
        axes.plot(_THRESHOLDS, share, label=name, **styles[name])
        axes.fill_between(_THRESHOLDS, low, high, color=styles[name]["color"], alpha=0.15, linewidth=0.0)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlim(_THRESHOLDS[0], _THRESHOLDS[-1])
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0%}"))
    if split == results.splits[-1].name and axes.lines:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8)
