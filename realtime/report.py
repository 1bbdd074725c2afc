"""What a controller or its client counted and timed, as JSON and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Final, Protocol

from ..envs.provenance import hardware
from ..envs.settings import configuration
from ..evaluation.reporting.text import NOTHING, TextTable, print_table, table_console
from ..evaluation.saved import Headed
from .timing import QUANTILES, Histogram, Pace, TimingSummary
from .watchdog import State

SCHEMA: Final = 1
"""Version of the file; a reader refuses others."""


@configuration
class LoopReport(Headed):
    """A run of the controller, or of its client.

    Args:
        hardware: What it ran on.
        duration: From the first period to the last, s.
        periods: That were made.
        overrun: That were not over when the next should have begun.
        skipped: That were left out, as an earlier one took so long.
        packets: That came, by what became of them.
        states: By state of the controller: its steps of 10 ms; of a client, the set-points that came.
        timings: By name, see docs/loop.md.
        faults: What the policy raised; or what was wrong with the set-points.
    """

    what = "the report of a loop"
    version = SCHEMA

    hardware: str
    duration: float
    periods: int
    overrun: int
    skipped: int
    packets: dict[str, int]
    timings: dict[str, TimingSummary]
    states: dict[str, int] = field(default_factory=dict)
    faults: tuple[str, ...] = ()


class Timed(Protocol):
    """Who ran at a pace: a server or a client."""

    timings: dict[str, Histogram]
    pace: Pace
    duration: float


def report_of(
    words: Sequence[str],
    who: Timed,
    periods: int,
    packets: dict[str, int],
    states: Mapping[State, int],
    faults: Sequence[str],
) -> LoopReport:
    """The report of a run.

    Args:
        words: The command line.
        who: Ran.
        periods: That were made.
        packets: By what became of them.
        states: By state of the controller.
        faults: In words.
    """
    return LoopReport(
        **LoopReport.head(words),
        hardware=hardware("cpu"),
        duration=who.duration,
        periods=periods,
        overrun=who.pace.overrun,
        skipped=who.pace.skipped,
        packets=packets,
        states={state.name.lower(): count for state, count in states.items()},
        timings={name: histogram.summary() for name, histogram in who.timings.items()},
        faults=tuple(faults),
    )


def timing_table(report: LoopReport) -> TextTable:
    """The timings, in microseconds."""
    header = ("time, us", "count", "mean", *(name.replace("_", ".") for name in QUANTILES), "max")
    rows = [
        (name, str(found.count), *(_microseconds(getattr(found, key)) for key in ("mean", *QUANTILES, "max")))
        for name, found in report.timings.items()
    ]
    return TextTable("Timings", header, tuple(rows))


def lines_of(report: LoopReport, counted_in: str) -> list[str]:
    """What was counted, in words; what did not happen is left out.

    Args:
        report: The report.
        counted_in: What its ``states`` count.
    """
    missed = report.overrun + report.skipped
    share = missed / max(report.periods + report.skipped, 1)
    counted = ", ".join(
        f"{name.replace('_', ' ')} {count}" for name, count in report.packets.items() if count
    )
    states = ", ".join(f"{name} {count}" for name, count in report.states.items() if count)
    lines = [
        f"{report.periods} periods in {report.duration:.1f} s; deadlines missed: {missed} "
        f"({100.0 * share:.4f} %), {report.overrun} late and {report.skipped} left out",
        f"packets: {counted or 'none'}",
    ]
    return [*lines, *([f"{counted_in}: {states}"] if states else []), *report.faults]


def tell(report: LoopReport, counted_in: str, file: Path | None) -> None:
    """Print a report, and write it where a file is named.

    Args:
        report: The report.
        counted_in: What its ``states`` count.
        file: JSON.
    """
    console = table_console()
    for line in lines_of(report, counted_in):
        console.print(line, highlight=False, markup=False)
    print_table(console, timing_table(report))
    if file is not None:
        report.save_json(file)


def _microseconds(seconds: float | None) -> str:
    return NOTHING if seconds is None else f"{1e6 * seconds:.1f}"
