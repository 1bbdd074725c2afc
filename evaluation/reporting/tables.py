"""The tables of an evaluation, as rows of text that a terminal and a report share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from rich.console import Console
from rich.markup import escape

from ..comparison import Share
from ..metrics import CUE_AXES, Metrics
from ..results import Results
from ..suite import print_troubles
from .text import NOTHING, TextTable, degrees, fraction, microseconds, number, percent, print_table

SHARE_HEADER: Final = ("share of the gap", "perceived share")
"""Columns of :func:`share_cells`."""


def largest_stroke(metrics: Metrics) -> tuple[str, float | None]:
    """The actuator that uses most of its travel, and the share."""
    shares = {
        name: use.stroke_share for name, use in metrics.actuators.items() if use.stroke_share is not None
    }
    if not shares:
        return NOTHING, None
    name = max(shares, key=lambda key: shares[key])
    return name, shares[name]


def share_cells(share: Share) -> tuple[str, str]:
    """Cells under :data:`SHARE_HEADER`."""
    return fraction(share.cue_error), fraction(share.perceived_cue_error)


def has_shares(shares: Iterable[Share]) -> bool:
    """Whether any share is defined: both references are among the policies."""
    return any(share != Share() for share in shares)


def maneuver_table(
    maneuver: str, drives: Mapping[str, Metrics], shares: Mapping[str, Share] | None = None
) -> TextTable:
    """The headline metrics of each policy on one maneuver, best first.

    Args:
        maneuver: For the title.
        drives: Metrics by policy.
        shares: Share of the gap by policy; its columns are left out where none is defined.
    """
    shown = shares if shares and has_shares(shares.values()) else None
    header = (
        "policy",
        "J",
        "perceived J",
        *(SHARE_HEADER if shown else ()),
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
    rows = (_headline(name, drives[name], share_cells(shown[name]) if shown else ()) for name in order)
    return TextTable(maneuver, header, tuple(rows), (0,))


def _headline(name: str, m: Metrics, shares: tuple[str, ...]) -> tuple[str, ...]:
    actuator, share = largest_stroke(m)
    part = m.axes[m.worst_axis].cue_error / m.cue_error if m.cue_error > 0.0 else None
    return (
        name,
        number(m.cue_error),
        number(m.perceived_cue_error),
        *shares,
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
        "normalized",
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


def notes_table(maneuver: str, notes: Mapping[str, Mapping[str, str]]) -> TextTable:
    """What each policy counted on one maneuver."""
    rows = [(policy, name, text) for policy, found in notes.items() for name, text in found.items()]
    return TextTable(f"{maneuver}: what policies counted", ("policy", "of", "counted"), tuple(rows))


def matrix_table(results: Results) -> TextTable:
    """J by maneuver and policy."""
    policies = results.policies
    rows = [
        (maneuver, *(number(drives[name].cue_error) if name in drives else NOTHING for name in policies))
        for maneuver, drives in results.maneuvers.items()
    ]
    return TextTable("J by maneuver", ("maneuver", *policies), tuple(rows))


def share_table(results: Results) -> TextTable:
    """Share of the gap by maneuver and policy; without rows where no share is defined."""
    policies = results.policies
    rows = [
        (maneuver, *(fraction(shares[name].cue_error if name in shares else None) for name in policies))
        for maneuver, shares in results.shares.items()
        if has_shares(shares.values())
    ]
    return TextTable("Share of the gap by maneuver", ("maneuver", *policies), tuple(rows))


def standings_table(results: Results) -> TextTable:
    """The policies over the suite, best first."""
    gaps = {s.policy: Share(s.share, s.perceived_share) for s in results.standings}
    shown = has_shares(gaps.values())
    rows = [
        (
            s.policy,
            number(s.cue_error),
            number(s.perceived_cue_error),
            *(share_cells(gaps[s.policy]) if shown else ()),
            f"{s.wins} of {s.maneuvers}",
            s.worst_maneuver,
        )
        for s in results.standings
    ]
    shares = SHARE_HEADER if shown else ()
    header = ("policy", "mean J", "mean perceived J", *shares, "best on", "worst maneuver")
    return TextTable("The whole suite", header, tuple(rows), (0,))


def print_results(console: Console, results: Results) -> None:
    """Show a table a maneuver, the summary, the verdicts, what went wrong in solves, and failures."""
    for maneuver, drives in results.maneuvers.items():
        print_table(console, maneuver_table(maneuver, drives, results.shares.get(maneuver)))
    if results.standings:
        print_table(console, standings_table(results))
    for verdict in results.verdicts:
        name = "Over the whole suite" if verdict.maneuver == "all" else verdict.maneuver
        console.print(f"[bold]{escape(name)}[/bold]: {escape(' '.join(verdict.sentences))}", highlight=False)
    counted = [
        (policy, maneuver, found)
        for maneuver, policies in results.notes.items()
        for policy, found in policies.items()
    ]
    print_troubles(console, counted)
    for policy, reason in results.left_out.items():
        console.print(f"[bold]left out[/bold] {escape(policy)}: {escape(reason)}", highlight=False)
    for failure in results.failures:
        what = f"{failure.maneuver}, {failure.policy}" if failure.policy else failure.maneuver
        console.print(
            f"[bold red]failed[/bold red] {escape(what)}: {escape(failure.message)}", highlight=False
        )
