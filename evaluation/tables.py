"""The tables of an evaluation, as rows of text that a terminal and a report share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .metrics import CUE_AXES, Metrics
from .results import Results

NOTHING: Final = "–"
"""Shown where a metric is undefined."""


@dataclass(frozen=True)
class TextTable:
    """A table of text.

    Args:
        title: Above it.
        header: Names of the columns; the first holds names, the others numbers.
        rows: Cells.
        best: Indices of the rows to stress.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    best: tuple[int, ...] = ()


def number(value: float | None, digits: int = 3) -> str:
    """A number with significant digits."""
    if value is None:
        return NOTHING
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        decimals = digits - 1 - (math.floor(math.log10(abs(value))) if value else 0)
        return f"{value:.{max(0, min(decimals, digits))}f}"
    return f"{value:.{digits - 1}e}"


def percent(share: float | None) -> str:
    """A share in percent."""
    return NOTHING if share is None else f"{100.0 * share:.1f}"


def degrees(value: float | None) -> str:
    """An angle or rate in degrees."""
    return NOTHING if value is None else f"{math.degrees(value):.2f}"


def microseconds(value: float | None) -> str:
    """A time in microseconds."""
    return NOTHING if value is None else f"{1e6 * value:.0f}"


def largest_stroke(metrics: Metrics) -> tuple[str, float | None]:
    """The actuator that uses most of its travel, and the share."""
    shares = {
        name: use.stroke_share for name, use in metrics.actuators.items() if use.stroke_share is not None
    }
    if not shares:
        return NOTHING, None
    name = max(shares, key=lambda key: shares[key])
    return name, shares[name]


def maneuver_table(maneuver: str, drives: Mapping[str, Metrics]) -> TextTable:
    """The headline metrics of each policy on one maneuver, best first."""
    header = (
        "policy",
        "J",
        "perceived J",
        "worst axis",
        "false cues %",
        "missing %",
        "tilt rate peak deg/s",
        "at a limit %",
        "most travel %",
        "clipped %",
        "step µs",
    )
    order = sorted(drives, key=lambda name: drives[name].cue_error)
    return TextTable(maneuver, header, tuple(_headline(name, drives[name]) for name in order), (0,))


def _headline(name: str, m: Metrics) -> tuple[str, ...]:
    actuator, share = largest_stroke(m)
    part = m.axes[m.worst_axis].cue_error / m.cue_error if m.cue_error > 0.0 else None
    return (
        name,
        number(m.cue_error),
        number(m.perceived_cue_error),
        NOTHING if part is None else f"{m.worst_axis} ({part:.0%})",
        percent(m.false_cues),
        percent(m.missing_cues),
        degrees(m.tilt_rate_peak),
        percent(m.at_limit),
        f"{percent(share)} {actuator}" if share else percent(share),
        percent(m.clipped),
        microseconds(m.step_time_mean),
    )


def axis_table(maneuver: str, drives: Mapping[str, Metrics]) -> TextTable:
    """Every axis of every policy on one maneuver."""
    header = (
        "policy and axis",
        "RMSE",
        "unit",
        "normalised",
        "correlation",
        "delay s",
        "false %",
        "missing %",
        "part of J",
        "perceived RMSE",
        "perceived part",
    )
    rows = [_axis_row(name, axis, drives[name]) for name in drives for axis in CUE_AXES]
    return TextTable(f"{maneuver}: axes", header, tuple(rows))


def _axis_row(name: str, axis: str, metrics: Metrics) -> tuple[str, ...]:
    m = metrics.axes[axis]
    force = axis.startswith("f")
    shown = number if force else degrees
    return (
        f"{name} {axis}",
        shown(m.rmse),
        "m/s²" if force else "deg/s",
        number(m.nrmse),
        number(m.correlation),
        NOTHING if m.delay is None else f"{m.delay:+.3f}",
        percent(m.false_cues),
        percent(m.missing_cues),
        number(m.cue_error),
        shown(m.perceived_rmse),
        number(m.perceived_cue_error),
    )


def machine_table(maneuver: str, drives: Mapping[str, Metrics]) -> TextTable:
    """Stroke in percent of the limit and share of time at a limit, per actuator."""
    actuators = list(next(iter(drives.values())).actuators)
    rows = []
    for name, metrics in drives.items():
        used = [metrics.actuators[actuator] for actuator in actuators]
        rows.append((f"{name}, stroke % of the limit", *(percent(use.stroke_share) for use in used)))
        rows.append((f"{name}, time at a limit %", *(percent(use.at_limit) for use in used)))
    return TextTable(f"{maneuver}: use of the machine", ("policy", *actuators), tuple(rows))


def matrix_table(results: Results) -> TextTable:
    """J by maneuver and policy."""
    policies = results.policies
    rows = [
        (maneuver, *(number(drives[name].cue_error) if name in drives else NOTHING for name in policies))
        for maneuver, drives in results.maneuvers.items()
    ]
    return TextTable("J by maneuver", ("maneuver", *policies), tuple(rows))


def standings_table(results: Results) -> TextTable:
    """The policies over the suite, best first."""
    rows = [
        (
            s.policy,
            number(s.cue_error),
            number(s.perceived_cue_error),
            f"{s.wins} of {s.maneuvers}",
            s.worst_maneuver,
        )
        for s in results.standings
    ]
    header = ("policy", "mean J", "mean perceived J", "best on", "worst maneuver")
    return TextTable("The whole suite", header, tuple(rows), (0,))


def print_table(console: Console, table: TextTable) -> None:
    """Show a table on a terminal."""
    shown = Table(title=escape(table.title), title_justify="left", title_style="bold", header_style="dim")
    for i, name in enumerate(table.header):
        shown.add_column(escape(name), justify="left" if i == 0 else "right")
    for i, row in enumerate(table.rows):
        shown.add_row(*(escape(cell) for cell in row), style="bold" if i in table.best else "")
    console.print(shown)


def print_results(console: Console, results: Results) -> None:
    """Show a table a maneuver, the summary of the suite, the verdicts and the failures."""
    for maneuver, drives in results.maneuvers.items():
        print_table(console, maneuver_table(maneuver, drives))
    if results.standings:
        print_table(console, standings_table(results))
    for verdict in results.verdicts:
        name = "Over the whole suite" if verdict.maneuver == "all" else verdict.maneuver
        console.print(f"[bold]{escape(name)}[/bold]: {escape(' '.join(verdict.sentences))}", highlight=False)
    for failure in results.failures:
        what = f"{failure.maneuver}, {failure.policy}" if failure.policy else failure.maneuver
        console.print(
            f"[bold red]failed[/bold red] {escape(what)}: {escape(failure.message)}", highlight=False
        )
