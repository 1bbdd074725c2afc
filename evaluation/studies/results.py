"""Results of a study: policies under several conditions, such as machines or disturbances.

Means are over the drives that every pair of policy and condition finished. They are written as ``study.json``
and ``study.csv`` and shown as tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from ...envs.settings import configuration, renamed
from ..comparison import STILL, normalized_scores
from ..metrics import METRICS, Criteria, Metrics, over_drives
from ..reporting.tables import SCORES, Cell, policy_table
from ..reporting.text import NOTHING, TextTable, fraction, how_many, number, percent, print_note, print_table
from ..results import Headed, save_frame
from ..suite import print_troubles

SCHEMA: Final = 2
"""Version of ``study.json``; version 1 is read, too."""


@configuration
class StudyFailure:
    """A drive without a result.

    Args:
        condition: Name of the condition.
        policy: Name of the policy; None where the maneuver itself could not be made.
        maneuver: Name of the maneuver.
        message: The reason.
    """

    condition: str
    policy: str | None
    maneuver: str
    message: str


@configuration
class Summary:
    """One policy under one condition, over the drives that every pair finished.

    Args:
        metrics: Each metric over the drives, as it declares; see ``metrics.over_drives``.
        normalized_score: Of the mean J under this condition; None where a reference is missing.
        perceived_normalized_score: The same of the perceived J.
        ratio: Mean J over that under the first condition; None where that is missing or 0.
        most_limited: Largest share of time at a limit of a drive.
    """

    metrics: dict[str, float | None]
    normalized_score: float | None
    perceived_normalized_score: float | None
    ratio: float | None
    most_limited: float

    @property
    def cue_error(self) -> float:
        """Mean J."""
        return self.metrics["cue_error"] or 0.0

    @property
    def perceived_cue_error(self) -> float:
        """Mean perceived J."""
        return self.metrics["perceived_cue_error"] or 0.0

    @property
    def row(self) -> dict[str, float | None]:
        """Every number by name, in SI units."""
        others = ("normalized_score", "perceived_normalized_score", "ratio", "most_limited")
        return {**self.metrics, **{name: getattr(self, name) for name in others}}


@configuration
class StudyResults(Headed):
    """A study: ``study.json``.

    Args:
        conditions: One line about each condition, by name; the first is what others are compared with.
        policies: Names.
        maneuvers: In the means.
        summaries: By condition and policy.
        failures: Drives without a result.
        metrics: By condition, policy and maneuver.
        notes: Counts of the policies, by condition, policy and maneuver, where they did.
        criteria: The thresholds the metrics were measured with.
        skipped: Why a policy was not driven, by condition and policy.
    """

    what = "a study"
    version = SCHEMA
    oldest = 1

    conditions: dict[str, str]
    policies: tuple[str, ...]
    maneuvers: tuple[str, ...]
    summaries: dict[str, dict[str, Summary]]
    failures: tuple[StudyFailure, ...]
    metrics: dict[str, dict[str, dict[str, Metrics]]]
    notes: dict[str, dict[str, dict[str, dict[str, str]]]]
    criteria: Criteria
    skipped: dict[str, dict[str, str]] = renamed("skipped", "left_out")

    @property
    def driven(self) -> tuple[str, ...]:
        """Policies with a result under any condition; the others were skipped or failed everywhere."""
        done = {policy for policies in self.summaries.values() for policy in policies}
        return tuple(policy for policy in self.policies if policy in done)

    def across(self, policy: str) -> list[Summary | None]:
        """Summaries of a policy under each condition."""
        return [self.summaries.get(condition, {}).get(policy) for condition in self.conditions]

    def skipped_lines(self) -> list[str]:
        """A line for each skipped policy and its reason, with the conditions where not under all."""
        reasons: dict[tuple[str, str], list[str]] = {}
        for condition, policies in self.skipped.items():
            for policy, reason in policies.items():
                reasons.setdefault((policy, reason), []).append(condition)
        return [
            f"{policy}{'' if len(under) == len(self.conditions) else ', ' + ', '.join(under)}: {reason}"
            for (policy, reason), under in reasons.items()
        ]

    def save_csv(self, path: Path) -> None:
        """Write ``study.csv``: a row a condition and policy, with the reason where it was skipped."""
        import pandas as pd

        rows = []
        for condition in self.conditions:
            summaries, skipped = self.summaries.get(condition, {}), self.skipped.get(condition, {})
            for policy in self.policies:
                numbers = summaries[policy].row if policy in summaries else {}
                reason = skipped.get(policy)
                rows.append({"condition": condition, "policy": policy, **numbers, "skipped": reason})
        save_frame(pd.DataFrame(rows), path)

    @classmethod
    def upgrade(cls, values: dict[str, Any]) -> dict[str, Any]:
        """Version 1 named each metric of a summary as a field."""
        for policies in values["summaries"].values() if values["schema"] == 1 else ():
            for name, old in policies.items():
                policies[name] = {
                    "normalized_score": old.pop("share"),
                    "perceived_normalized_score": old.pop("perceived_share"),
                    "ratio": old.pop("ratio"),
                    "most_limited": old.pop("most_limited"),
                    "metrics": old,
                }
        return values


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
        criteria: For the references of the score.
    """
    common = common_maneuvers(metrics)
    if not common:
        return {}
    references = (criteria or Criteria()).references
    nominal: dict[str, float] = {}
    summaries: dict[str, dict[str, Summary]] = {}
    for i, (condition, policies) in enumerate(metrics.items()):
        drives = {name: [each[m] for m in common] for name, each in policies.items() if each}
        combined = {name: over_drives(each) for name, each in drives.items()}
        errors = {name: each["cue_error"] or 0.0 for name, each in combined.items()}
        perceived = {name: each["perceived_cue_error"] or 0.0 for name, each in combined.items()}
        nominal = errors if i == 0 else nominal
        scores = normalized_scores(errors, perceived, references)
        summaries[condition] = {
            name: Summary(
                metrics=combined[name],
                normalized_score=scores[name].cue_error,
                perceived_normalized_score=scores[name].perceived_cue_error,
                ratio=errors[name] / nominal[name] if nominal.get(name) else None,
                most_limited=max(m.at_limit for m in each),
            )
            for name, each in drives.items()
        }
    return summaries


def matrix_table(results: StudyResults, title: str, ratios: bool) -> TextTable:
    """J of every policy that was driven under every condition.

    Args:
        results: The study.
        title: Above the table.
        ratios: Whether J over that under the first condition stands beside it.
    """
    rows = []
    for policy in results.driven:
        cells = []
        for i, (condition, summary) in enumerate(
            zip(results.conditions, results.across(policy), strict=True)
        ):
            if summary is None:
                cells.append("skipped" if policy in results.skipped.get(condition, {}) else NOTHING)
            elif not ratios or i == 0 or summary.ratio is None:
                cells.append(number(summary.cue_error))
            else:
                cells.append(f"{number(summary.cue_error)} (×{summary.ratio:.2f})")
        rows.append((policy, *cells))
    about = f"{title}: J, mean over {how_many(len(results.maneuvers), 'drive')}"
    return TextTable(about, ("policy", *results.conditions), tuple(rows))


def standstill_table(results: StudyResults) -> TextTable:
    """Mean J of every policy over that of standing still under the same condition; above 1 it is worse.

    Standing still costs the square of the motion scale. So this is what compares scales; J is not.
    """
    still = results.across(STILL)
    rows = []
    for policy in results.driven:
        cells = [
            NOTHING if s is None or rest is None else f"{s.cue_error / rest.cue_error:.2f}"
            for s, rest in zip(results.across(policy), still, strict=True)
        ]
        rows.append((policy, *cells))
    return TextTable(f"J over that of {STILL}", ("policy", *results.conditions), tuple(rows))


def score_tables(results: StudyResults) -> list[TextTable]:
    """Normalized score of every policy under every condition, of J and of the perceived J, if there is any.

    A score is measured between the references under its own condition.
    """
    tables = []
    for name, title in SCORES.items():
        rows = []
        for policy in results.driven:
            scores = [None if s is None else s.row[name] for s in results.across(policy)]
            rows.append((policy, *map(fraction, scores)))
        if any(set(row[1:]) != {NOTHING} for row in rows):
            tables.append(TextTable(title.capitalize(), ("policy", *results.conditions), tuple(rows)))
    return tables


def condition_table(results: StudyResults, condition: str) -> TextTable:
    """Every policy under one condition, best first; skipped ones are missing."""
    import pandas as pd

    summaries = results.summaries.get(condition, {})
    order = sorted(summaries, key=lambda name: summaries[name].cue_error)
    columns = ["policy", *METRICS, *SCORES, "ratio", "most_limited"]
    rows = pd.DataFrame([{"policy": name, **summaries[name].row} for name in order], columns=columns)
    more: dict[str, Cell] = {
        f"J over {next(iter(results.conditions))}": lambda row: fraction(row["ratio"]),
        "worst drive at a limit %": lambda row: percent(row["most_limited"]),
    }
    return policy_table(f"{condition}: {results.conditions[condition]}", rows, "study", more)


def print_study(console: Console, results: StudyResults, title: str, ratios: bool) -> None:
    """Show a table a condition, the matrices of J and scores, counts, skipped policies and failures."""
    for condition in results.conditions:
        print_table(console, condition_table(results, condition))
    for table in (matrix_table(results, title, ratios), *score_tables(results)):
        print_table(console, table)
    counted = [
        (policy, f"{condition} {maneuver}", counts)
        for condition, policies in results.notes.items()
        for policy, drives in policies.items()
        for maneuver, counts in drives.items()
    ]
    print_troubles(console, counted)
    for line in results.skipped_lines():
        print_note(console, "skipped", line)
    for failure in results.failures:
        who = ", ".join(part for part in (failure.condition, failure.policy, failure.maneuver) if part)
        print_note(console, "failed", f"{who}: {failure.message}")
