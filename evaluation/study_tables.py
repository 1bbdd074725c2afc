"""The tables of a study."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape

from .counted import print_troubles
from .share import Share
from .study_results import StudyResults, Summary
from .tables import SHARE_HEADER, has_shares, share_cells
from .text_table import NOTHING, TextTable, degrees, fraction, number, percent, print_table
from .words import how_many


def matrix_table(results: StudyResults, title: str, ratios: bool) -> TextTable:
    """J of every policy that was driven under every condition.

    Args:
        results: The study.
        title: Above the table.
        ratios: Whether J over that under the first condition stands beside it.
    """
    rows = []
    for policy in results.driven:
        cells = [_cell(results, condition, policy, ratios) for condition in results.conditions]
        rows.append((policy, *cells))
    about = f"{title}: J, mean over {how_many(len(results.maneuvers), 'drive')}"
    return TextTable(about, ("policy", *results.conditions), tuple(rows))


def _cell(results: StudyResults, condition: str, policy: str, ratios: bool) -> str:
    found = results.summaries.get(condition, {}).get(policy)
    if found is None:
        return "left out" if policy in results.left_out.get(condition, {}) else NOTHING
    first = condition == next(iter(results.conditions))
    if not ratios or first or found.ratio is None:
        return number(found.cue_error)
    return f"{number(found.cue_error)} (×{found.ratio:.2f})"


def share_tables(results: StudyResults) -> list[TextTable]:
    """Share of the gap of every policy under every condition, of J and of the perceived J, if there is any.

    A share is of the gap under its own condition.
    """
    kinds = (("Share of the gap", False), ("Perceived share of the gap", True))
    made = [_share_table(results, title, perceived) for title, perceived in kinds]
    return [table for table in made if any(set(row[1:]) != {NOTHING} for row in table.rows)]


def _share_table(results: StudyResults, title: str, perceived: bool) -> TextTable:
    rows = []
    for policy in results.driven:
        found = [results.summaries.get(condition, {}).get(policy) for condition in results.conditions]
        shares = [None if s is None else s.perceived_share if perceived else s.share for s in found]
        rows.append((policy, *(fraction(share) for share in shares)))
    return TextTable(title, ("policy", *results.conditions), tuple(rows))


def condition_table(results: StudyResults, condition: str) -> TextTable:
    """Every policy under one condition, best first; those left out are missing."""
    found = results.summaries.get(condition, {})
    gaps = {name: Share(s.share, s.perceived_share) for name, s in found.items()}
    shown = has_shares(gaps.values())
    order = sorted(found, key=lambda name: found[name].cue_error)
    header = (
        "policy",
        "J",
        "perceived J",
        *(SHARE_HEADER if shown else ()),
        f"J over {next(iter(results.conditions))}",
        "false cues %",
        "tilt rate peak deg/s",
        "at a limit %",
        "worst drive %",
    )
    rows = (_row(name, found[name], share_cells(gaps[name]) if shown else ()) for name in order)
    title = f"{condition}: {results.conditions[condition]}"
    return TextTable(title, header, tuple(rows), (0,) if order else ())


def _row(name: str, s: Summary, shares: tuple[str, ...]) -> tuple[str, ...]:
    return (
        name,
        number(s.cue_error),
        number(s.perceived_cue_error),
        *shares,
        NOTHING if s.ratio is None else f"{s.ratio:.2f}",
        percent(s.false_cues),
        degrees(s.tilt_rate_peak),
        percent(s.at_limit),
        percent(s.most_limited),
    )


def print_study(console: Console, results: StudyResults, title: str, ratios: bool) -> None:
    """Show a table a condition, the matrices of J and shares, and what was counted, left out or failed."""
    for condition in results.conditions:
        print_table(console, condition_table(results, condition))
    for table in (matrix_table(results, title, ratios), *share_tables(results)):
        print_table(console, table)
    counted = [
        (policy, f"{condition} {maneuver}", found)
        for condition, policies in results.notes.items()
        for policy, drives in policies.items()
        for maneuver, found in drives.items()
    ]
    print_troubles(console, counted)
    for line in results.told_left_out():
        console.print(f"[bold]left out[/bold] {escape(line)}", highlight=False)
    for failure in results.failures:
        who = ", ".join(part for part in (failure.condition, failure.policy, failure.maneuver) if part)
        console.print(
            f"[bold red]failed[/bold red] {escape(who)}: {escape(failure.message)}", highlight=False
        )
