"""The tables of an evaluation, for a terminal and a report. Metrics declare the tables they stand in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

from rich.console import Console
from rich.markup import escape

from ..agreement import LEAST_POLICIES, agreement
from ..comparison import NormalizedScore, common_drives
from ..metrics import (
    CUE_AXES,
    METRICS,
    OF_AXIS,
    ActuatorMetrics,
    AxisMetrics,
    Metrics,
    Table,
    declared,
    over_drives,
)
from ..results import Results
from ..suite import print_troubles
from .text import (
    NOTHING,
    TextTable,
    degrees,
    fraction,
    how_many,
    is_missing,
    number,
    percent,
    print_note,
    print_table,
)

if TYPE_CHECKING:
    import pandas as pd

SCORES: Final = {
    "normalized_score": "normalized score",
    "perceived_normalized_score": "perceived score",
}
"""Columns of the normalized scores and their headers; shown where any policy has a score."""


Cell = Callable[[Mapping[str, Any]], str]
"""The text of a cell from the row of a frame."""


def policy_table(title: str, frame: pd.DataFrame, table: Table, more: Mapping[str, Cell] = {}) -> TextTable:
    """A table with a row a policy; the one with the lowest J is stressed.

    Args:
        title: Above it.
        frame: Rows in SI units: ``policy`` and metrics by name; scores and worst axis where there are any.
        table: The metrics that declare this table are its columns.
        more: Further columns by header.
    """
    columns: dict[str, Cell] = {"policy": lambda row: row["policy"]}
    metrics = {one.title: _metric_cell(name) for name, one in METRICS.items() if table in one.tables}
    # J and the perceived J stand first, their scores beside them.
    for header in list(metrics)[:2]:
        columns[header] = metrics.pop(header)
    if has_scores(frame):
        columns |= {header: _score_cell(name) for name, header in SCORES.items()}
    if "worst_axis" in frame:
        columns["worst axis"] = _worst_axis
    columns |= {**metrics, **more}
    records: list[Any] = frame.to_dict("records")
    rows = [tuple(cell(row) for cell in columns.values()) for row in records]
    best = (int(frame["cue_error"].argmin()),) if rows else ()
    return TextTable(title, tuple(columns), tuple(rows), best)


def _metric_cell(name: str) -> Cell:
    return lambda row: METRICS[name].display.text(row[name])


def _score_cell(name: str) -> Cell:
    return lambda row: fraction(row[name])


def _worst_axis(row: Mapping[str, Any]) -> str:
    part = row["worst_axis_part"]
    return NOTHING if is_missing(part) else f"{row['worst_axis']} ({part:.0%})"


def has_scores(frame: pd.DataFrame) -> bool:
    """Whether any policy has a normalized score: a pair of references is among the policies."""
    return any(name in frame and frame[name].notna().any() for name in SCORES)


def maneuver_table(
    maneuver: str, drives: Mapping[str, Metrics], scores: Mapping[str, NormalizedScore] | None = None
) -> TextTable:
    """The headline metrics of each policy on one maneuver, best first."""
    import pandas as pd

    rows = []
    for policy in sorted(drives, key=lambda name: drives[name].cue_error):
        m, score = drives[policy], (scores or {}).get(policy, NormalizedScore())
        part = m.axes[m.worst_axis].cue_error / m.cue_error if m.cue_error > 0.0 else None
        rows.append(
            {name: getattr(m, name) for name in METRICS}
            | {
                "policy": policy,
                "normalized_score": score.cue_error,
                "perceived_normalized_score": score.perceived_cue_error,
                "worst_axis": m.worst_axis,
                "worst_axis_part": part,
            }
        )
    more: dict[str, Cell] = {"most travel %": lambda row: _most_travel(drives[row["policy"]])}
    return policy_table(maneuver, pd.DataFrame(rows), "drive", more)


def _most_travel(metrics: Metrics) -> str:
    """The largest share of an actuator's travel, and which actuator it is."""
    shares = {name: use.stroke_share or 0.0 for name, use in metrics.actuators.items()}
    if all(use.stroke_share is None for use in metrics.actuators.values()):
        return NOTHING
    name = max(shares, key=shares.__getitem__)
    return f"{percent(shares[name])} {name if shares[name] else ''}".strip()


def axis_table(maneuver: str, drives: Mapping[str, Metrics]) -> TextTable:
    """Every axis of every policy on one maneuver."""
    shown = [one for one in declared(AxisMetrics) if one.header]
    rows = []
    for policy, metrics in drives.items():
        for axis in CUE_AXES:
            force = axis.startswith("f")
            of_axis = number if force else degrees
            cells = [
                (of_axis if one.display is OF_AXIS else one.display.text)(
                    getattr(metrics.axes[axis], one.name)
                )
                for one in shown
            ]
            rows.append((f"{policy} {axis}", "m/s²" if force else "deg/s", *cells))
    header = ("policy and axis", "unit", *(one.title for one in shown))
    return TextTable(f"{maneuver}: axes", header, tuple(rows))


def machine_table(maneuver: str, drives: Mapping[str, Metrics]) -> TextTable:
    """Use of every actuator by every policy on one maneuver."""
    actuators = list(next(iter(drives.values())).actuators)
    rows = []
    for name, metrics in drives.items():
        for one in declared(ActuatorMetrics):
            if one.header:
                values = [getattr(metrics.actuators[actuator], one.name) for actuator in actuators]
                rows.append((f"{name}, {one.title}", *map(one.display.text, values)))
    return TextTable(f"{maneuver}: use of the machine", ("policy", *actuators), tuple(rows))


def notes_table(maneuver: str, notes: Mapping[str, Mapping[str, str]]) -> TextTable:
    """What each policy counted on one maneuver."""
    rows = [(policy, name, text) for policy, counts in notes.items() for name, text in counts.items()]
    return TextTable(f"{maneuver}: counts of the policies", ("policy", "of", "counted"), tuple(rows))


def feel_table(maneuver: str, drives: Mapping[str, Metrics]) -> TextTable:
    """What people feel of each policy on one maneuver, best J first."""
    rows = {policy: {name: getattr(m, name) for name in METRICS} for policy, m in drives.items()}
    return _feel_table(f"{maneuver}: what people feel", rows)


def _feel_table(title: str, rows: Mapping[str, Mapping[str, Any]]) -> TextTable:
    import pandas as pd

    order = sorted(rows, key=lambda policy: rows[policy]["cue_error"])
    frame = pd.DataFrame([{"policy": policy, **rows[policy]} for policy in order], dtype=object)
    return policy_table(title, frame, "feel")


def feel_tables(results: Results) -> list[TextTable]:
    """What people feel over the drives that every policy finished, and whether it agrees with J.

    The second is missing where there are too few policies for an order.
    """
    common = common_drives(results.maneuvers)
    if not common:
        return []
    policies = list(next(iter(common.values())))
    rows = {policy: over_drives([drives[policy] for drives in common.values()]) for policy in policies}
    table = _feel_table(f"What people feel, over {how_many(len(common), 'drive')}", rows)
    return [table, *([agreement_table(results)] if len(policies) >= LEAST_POLICIES else [])]


def agreement_table(results: Results) -> TextTable:
    """Rank correlations of each metric of what people feel with J about the order of the policies."""
    rows = []
    for row in agreement(results.maneuvers).to_dict("records"):
        name = METRICS[row["metric"]].header
        rows.append(
            (
                name if row["reading"] == "value" else f"{name}, {row['reading']}",
                *(fraction(row[column]) for column in ("spearman", "kendall", "lowest")),
                row["lowest_on"] if row["drives"] else NOTHING,
                fraction(row["spearman_overall"]),
                str(row["drives"]),
            )
        )
    header = ("order by", "Spearman", "Kendall", "lowest", "on", "Spearman over all drives", "drives")
    return TextTable("Agreement with J about the order of the policies", header, tuple(rows))


def matrix_table(results: Results) -> TextTable:
    """J by maneuver and policy."""
    return _by_maneuver("J by maneuver", results, "cue_error", number)


def score_table(results: Results) -> TextTable:
    """Normalized score by maneuver and policy; without rows where none is defined."""
    return _by_maneuver("Normalized score by maneuver", results, "normalized_score", fraction)


def _by_maneuver(title: str, results: Results, column: str, text: Callable[[Any], str]) -> TextTable:
    frame = results.frame()
    header = ("maneuver", *results.policies)
    if frame.empty:
        return TextTable(title, header, ())
    pivot = frame.pivot(index="maneuver", columns="policy", values=column)
    pivot = pivot.reindex(index=list(results.maneuvers), columns=results.policies)
    pivot = pivot.astype(float).dropna(how="all")
    rows = [(maneuver, *map(text, row)) for maneuver, row in zip(pivot.index, pivot.to_numpy(), strict=True)]
    return TextTable(title, header, tuple(rows))


def _all_of(results: Results) -> str:
    """What means over the suite are over, in words."""
    count = min((score.maneuvers for score in results.scores), default=len(results.maneuvers))
    return "One drive" if count == 1 else f"All {count} drives"


def suite_table(results: Results) -> TextTable:
    """The policies over the suite, best first; a motion scale other than 1 stands in the title."""
    scored = any(
        s.normalized_score is not None or s.perceived_normalized_score is not None for s in results.scores
    )
    rows = [
        (
            s.policy,
            number(s.cue_error),
            number(s.perceived_cue_error),
            *((fraction(s.normalized_score), fraction(s.perceived_normalized_score)) if scored else ()),
            f"{s.wins} of {s.maneuvers}",
            s.worst_maneuver,
        )
        for s in results.scores
    ]
    scores = SCORES.values() if scored else ()
    header = ("policy", "mean J", "mean perceived J", *scores, "best on", "worst maneuver")
    return TextTable(_all_of(results) + at_scale(results), header, tuple(rows), (0,))


def at_scale(results: Results) -> str:
    """The motion scale of results for a title; empty where it is neutral."""
    scale = results.provenance.scale
    return "" if scale.neutral else f", motion scale {scale}"


def print_results(console: Console, results: Results, feel: bool = False) -> None:
    """Show a table a maneuver, the suite, the verdicts, wrong solves, skipped policies and failures.

    Args:
        console: Where.
        results: What.
        feel: Whether what people feel is shown, too.
    """
    for maneuver, drives in results.maneuvers.items():
        title, scores = maneuver + at_scale(results), results.normalized_scores.get(maneuver)
        print_table(console, maneuver_table(title, drives, scores))
        if feel:
            print_table(console, feel_table(title, drives))
    if results.scores:
        print_table(console, suite_table(results))
    for table in feel_tables(results) if feel else []:
        print_table(console, table)
    for verdict in results.verdicts:
        everywhere = verdict.maneuver == "all"
        name = f"Over {_all_of(results).lower()}" if everywhere else verdict.maneuver
        console.print(f"[bold]{escape(name)}[/bold]: {escape(' '.join(verdict.sentences))}", highlight=False)
    counted = [
        (policy, maneuver, counts)
        for maneuver, policies in results.notes.items()
        for policy, counts in policies.items()
    ]
    print_troubles(console, counted)
    for policy, reason in results.skipped.items():
        print_note(console, "skipped", f"{policy}: {reason}")
    for failure in results.failures:
        what = f"{failure.maneuver}, {failure.policy}" if failure.policy else failure.maneuver
        print_note(console, "failed", f"{what}: {failure.message}")
