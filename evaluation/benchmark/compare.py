"""Two results of the benchmark side by side, from one laboratory or two."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...envs.errors import DataError
from ..reporting.text import NOTHING, TextTable, number
from .results import BenchmarkResults, SplitResult
from .splits import same_drive
from .statistics import Estimate, difference, estimate


@dataclass(frozen=True)
class ComparisonRow:
    """A policy in both results.

    Args:
        platform: Motion base.
        policy: Label.
        split: Name.
        drives: Number of drives that both finished.
        first: Mean J of the first.
        second: Mean J of the second.
        change: Mean of second less first over the same drives; below 0: the second is better.
    """

    platform: str
    policy: str
    split: str
    drives: int
    first: Estimate
    second: Estimate
    change: Estimate


@dataclass(eq=False)
class Comparison:
    """Two results.

    Args:
        rows: Policies that are in both.
        refused: Why a split is not compared, by its name.
        only_first: Policies in the first alone, with their motion base.
        only_second: Policies in the second alone.
    """

    rows: list[ComparisonRow] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    only_first: list[str] = field(default_factory=list)
    only_second: list[str] = field(default_factory=list)


def why_not_equal(first: SplitResult, second: SplitResult) -> str | None:
    """Why two splits of one name cannot be compared; None where they are the same drives."""
    if first.hash != second.hash:
        return (
            f"version {first.version}, hash {first.hash[:12]}, and version {second.version}, "
            f"hash {second.hash[:12]}, are defined otherwise"
        )
    if list(first.drives) != list(second.drives):
        return "the drives have other names"
    others = [name for name, one in first.drives.items() if not same_drive(one, second.drives[name])]
    if others:
        return f"the cues of {len(others)} drives differ, as of {others[0]}, by the same definition"
    return None


def compare(first: BenchmarkResults, second: BenchmarkResults) -> Comparison:
    """Set two results side by side, split by split; a split that is not the same in both is refused.

    Raises:
        DataError: no split is the same in both.
    """
    found = Comparison()
    theirs = {split.name: split for split in second.splits}
    for split in first.splits:
        other = theirs.get(split.name)
        reason = "it is in one of the files only" if other is None else why_not_equal(split, other)
        if reason is not None:
            found.refused[split.name] = reason
            continue
        for platform, policies in first.platforms.items():
            for policy, one in policies.items():
                again = second.platforms.get(platform, {}).get(policy)
                if again is None:
                    continue
                both = [name for name in one.finished(split.name) if name in again.finished(split.name)]
                if both:
                    before, after = (r.values(split.name, "cue_error", both) for r in (one, again))
                    change = difference(after, before)
                    found.rows.append(
                        ComparisonRow(
                            platform, policy, split.name, len(both), estimate(before), estimate(after), change
                        )
                    )
    if len(found.refused) == len(first.splits):
        reasons = "; ".join(f"{name}: {reason}" for name, reason in found.refused.items())
        raise DataError(f"the two results are not of the same drives: {reasons}")
    pairs = [
        {f"{platform}, {policy}" for platform, policies in one.platforms.items() for policy in policies}
        for one in (first, second)
    ]
    found.only_first, found.only_second = sorted(pairs[0] - pairs[1]), sorted(pairs[1] - pairs[0])
    return found


def comparison_table(comparison: Comparison) -> TextTable:
    """J of both, and the change with its interval."""
    header = ("policy", "motion base", "split", "drives", "J, first", "J, second", "second less first")
    rows = [
        (
            row.policy,
            row.platform,
            row.split,
            str(row.drives),
            with_interval(row.first),
            with_interval(row.second),
            with_interval(row.change),
        )
        for row in comparison.rows
    ]
    return TextTable("Second less first: below 0 the second is better", header, tuple(rows))


def with_interval(one: Estimate | None) -> str:
    """A figure with its interval: ``1.14 (0.98 to 1.31)``."""
    if one is None:
        return NOTHING
    if one.low is None or one.high is None:
        return number(one.value)
    return f"{number(one.value)} ({number(one.low)} to {number(one.high)})"
