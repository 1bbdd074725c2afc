"""Report of a run of the real-time loop: counts and timings, as JSON and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Final

from ..envs.provenance import hardware
from ..envs.settings import configuration
from ..evaluation.reporting.text import NOTHING, TextTable, print_table, table_console
from ..evaluation.results import Headed
from .client import Client
from .server import Server
from .timing import QUANTILES, TimingSummary
from .watchdog import State

SCHEMA: Final = 1
"""Version of the file; a reader refuses others."""


@configuration
class LoopReport(Headed):
    """A run of the controller, or of its test client.

    Args:
        hardware: Processor and system.
        duration: From the first period to the last, s.
        periods: Number of periods.
        overrun: Periods that were not over when the next should have begun.
        skipped: Skipped periods, since an earlier one took too long.
        packets: Packets received, by kind.
        states: Counts by state: time steps of a controller, set-points received by a client.
        timings: By name, see :mod:`~.server` and :class:`~.client.Client`.
        faults: Errors that the policy raised, or limits that set-points exceeded.
        guard: Faults of the cues that a controller's guard found, by kind; see :mod:`~.guard`.
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
    guard: dict[str, int] = field(default_factory=dict)


def report_of(
    words: Sequence[str],
    run: Server | Client,
    periods: int,
    packets: dict[str, int],
    states: Mapping[State, int],
    faults: Sequence[str],
    guard: Mapping[str, int] | None = None,
) -> LoopReport:
    """The report of a run."""
    return LoopReport(
        **LoopReport.head(words),
        hardware=hardware("cpu"),
        duration=run.duration,
        periods=periods,
        overrun=run.pace.overrun,
        skipped=run.pace.skipped,
        packets=packets,
        states={state.name.lower(): count for state, count in states.items()},
        timings={name: histogram.summary() for name, histogram in run.timings.items()},
        faults=tuple(faults),
        guard=dict(guard or {}),
    )


def summary_lines(report: LoopReport, unit: str) -> list[str]:
    """The counts in words; zeros are not shown."""
    missed = report.overrun + report.skipped
    percent = 100.0 * missed / max(report.periods + report.skipped, 1)
    packets = ", ".join(f"{name.replace('_', ' ')} {n}" for name, n in report.packets.items() if n)
    states = ", ".join(f"{name} {n}" for name, n in report.states.items() if n)
    lines = [
        f"{report.periods} periods in {report.duration:.1f} s; deadlines missed: {missed} ({percent:.4f} %), "
        f"{report.overrun} late and {report.skipped} skipped",
        f"packets: {packets or 'none'}",
    ]
    found = ", ".join(f"{name} {n}" for name, n in report.guard.items() if n)
    lines += [f"{unit}: {states}"] if states else []
    lines += [f"faults of the cues: {found}"] if found else []
    return [*lines, *report.faults]


def timing_table(report: LoopReport) -> TextTable:
    """The timings, in microseconds."""
    columns = ("mean", *QUANTILES, "max")
    rows = []
    for name, summary in report.timings.items():
        seconds = [getattr(summary, column) for column in columns]
        rows.append(
            (name, str(summary.count), *(NOTHING if s is None else f"{1e6 * s:.1f}" for s in seconds))
        )
    header = ("time, us", "count", *(column.replace("_", ".") for column in columns))
    return TextTable("Timings", header, tuple(rows))


def show(report: LoopReport, unit: str, file: Path | None) -> None:
    """Print a report, and write it where a file is named.

    Args:
        report: The report.
        unit: Of its ``states``.
        file: JSON.
    """
    console = table_console()
    for line in summary_lines(report, unit):
        console.print(line, highlight=False, markup=False)
    print_table(console, timing_table(report))
    if file is not None:
        report.save_json(file)
