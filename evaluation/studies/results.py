"""What a study found, over the drives that every pair finished; as JSON and CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.markup import escape

from ...envs.settings import configuration, to_dict
from ..comparison import Share, shares
from ..metrics import Criteria, Metrics
from ..reporting.tables import SHARE_HEADER, has_shares, share_cells
from ..reporting.text import NOTHING, TextTable, degrees, fraction, how_many, number, percent, print_table
from ..results import save_rows
from ..saved import Headed
from ..suite import print_troubles

SCHEMA: Final = 1
"""Version of ``study.json``."""


@configuration
class StudyFailure:
    """A drive without a result.

    Args:
        condition: Under which it was tried.
        policy: Whose it is; None where the maneuver itself could not be made.
        maneuver: That was driven.
        message: What went wrong.
    """

    condition: str
    policy: str | None
    maneuver: str
    message: str


@configuration
class Summary:
    """One policy under one condition, over the drives that every pair finished.

    Args:
        cue_error: Mean J.
        perceived_cue_error: Mean perceived J.
        share: Of the gap between the references under this condition; None where one is missing.
        perceived_share: The same of the perceived J.
        ratio: Mean J over that under the first condition; None where that is missing or 0.
        false_cues: Mean share of time with a false cue.
        tilt_rate_peak: Largest of all drives, rad/s.
        at_limit: Mean share of time with any actuator at any limit.
        most_limited: Largest share of time at a limit of a drive.
    """

    cue_error: float
    perceived_cue_error: float
    share: float | None
    perceived_share: float | None
    ratio: float | None
    false_cues: float
    tilt_rate_peak: float
    at_limit: float
    most_limited: float


@configuration
class StudyResults(Headed):
    """A study: ``study.json``.

    Args:
        conditions: One line about each condition, by name; the first is what others are compared with.
        policies: Names.
        maneuvers: In the means.
        summaries: By condition and policy.
        left_out: By condition and policy: why it was not driven there.
        failures: Drives without a result.
        metrics: By condition, policy and maneuver.
        notes: What policies counted, by condition, policy and maneuver, where they did.
        criteria: The thresholds the metrics were measured with.
    """

    what = "a study"
    version = SCHEMA

    conditions: dict[str, str]
    policies: tuple[str, ...]
    maneuvers: tuple[str, ...]
    summaries: dict[str, dict[str, Summary]]
    left_out: dict[str, dict[str, str]]
    failures: tuple[StudyFailure, ...]
    metrics: dict[str, dict[str, dict[str, Metrics]]]
    notes: dict[str, dict[str, dict[str, dict[str, str]]]]
    criteria: Criteria

    @property
    def driven(self) -> tuple[str, ...]:
        """Policies with a result under any condition; the rest was left out or failed everywhere."""
        found = {policy for policies in self.summaries.values() for policy in policies}
        return tuple(policy for policy in self.policies if policy in found)

    def told_left_out(self) -> list[str]:
        """A line for each policy and reason why it was left out, with the conditions where not under all."""
        reasons: dict[tuple[str, str], list[str]] = {}
        for condition, policies in self.left_out.items():
            for policy, reason in policies.items():
                reasons.setdefault((policy, reason), []).append(condition)
        return [
            f"{policy}{'' if len(under) == len(self.conditions) else ', ' + ', '.join(under)}: {reason}"
            for (policy, reason), under in reasons.items()
        ]

    def save_csv(self, path: Path) -> None:
        """Write ``study.csv``: a row a condition and policy, with the reason where it was left out."""
        save_rows(list(self._rows()), path)

    def _rows(self) -> Iterator[Mapping[str, Any]]:
        empty = dict.fromkeys(Summary.__dataclass_fields__)
        for condition in self.conditions:
            for policy in self.policies:
                found = self.summaries.get(condition, {}).get(policy)
                numbers = empty if found is None else to_dict(found)
                reason = self.left_out.get(condition, {}).get(policy)
                yield {"condition": condition, "policy": policy, **numbers, "left_out": reason}


def common_maneuvers(metrics: Mapping[str, Mapping[str, Mapping[str, Metrics]]]) -> tuple[str, ...]:
    """Maneuvers that every pair finished that finished any."""
    pairs = [drives for policies in metrics.values() for drives in policies.values() if drives]
    return tuple(name for name in (pairs[0] if pairs else ()) if all(name in drives for drives in pairs))


def summarize(
    metrics: Mapping[str, Mapping[str, Mapping[str, Metrics]]], criteria: Criteria | None = None
) -> dict[str, dict[str, Summary]]:
    """Each policy under each condition, over the common maneuvers.

    Args:
        metrics: By condition, policy and maneuver; the first condition is what others are compared with.
        criteria: For the references of the share.
    """
    common = common_maneuvers(metrics)
    if not common:
        return {}
    nominal: dict[str, float] = {}
    found: dict[str, dict[str, Summary]] = {}
    for i, (condition, policies) in enumerate(metrics.items()):
        chosen = {name: [drives[m] for m in common] for name, drives in policies.items() if drives}
        errors = {name: _mean([m.cue_error for m in drives]) for name, drives in chosen.items()}
        nominal = errors if i == 0 else nominal
        found[condition] = _condition(chosen, errors, nominal, criteria or Criteria())
    return found


def _condition(
    drives: Mapping[str, list[Metrics]],
    errors: Mapping[str, float],
    nominal: Mapping[str, float],
    criteria: Criteria,
) -> dict[str, Summary]:
    perceived = {name: _mean([m.perceived_cue_error for m in each]) for name, each in drives.items()}
    gap = shares(errors, perceived, criteria.references)
    return {
        name: Summary(
            cue_error=errors[name],
            perceived_cue_error=perceived[name],
            share=gap[name].cue_error,
            perceived_share=gap[name].perceived_cue_error,
            ratio=errors[name] / nominal[name] if nominal.get(name) else None,
            false_cues=_mean([m.false_cues for m in each]),
            tilt_rate_peak=max(m.tilt_rate_peak for m in each),
            at_limit=_mean([m.at_limit for m in each]),
            most_limited=max(m.at_limit for m in each),
        )
        for name, each in drives.items()
    }


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


# The tables of a study.


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
