"""Results of the benchmark: ``benchmark.json``, which two laboratories can set side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import Self

from ...envs.settings import configuration, to_dict
from ..comparison import normalized_score
from ..metrics import References
from ..results import Headed, save_rows
from .splits import BENCHMARK_VERSION, Split
from .statistics import Estimate, Floats, difference, estimate, improvement, worst_tenth

SCHEMA: Final = 1
"""Version of ``benchmark.json``."""

SUMMARIZED: Final = ("cue_error", "perceived_cue_error")
"""Metrics with summaries: J and the perceived J."""

DriveValues = dict[str, float | None]
"""Metrics of a drive by name; None where one is undefined."""


@configuration
class SplitResult:
    """A split that was driven.

    Args:
        name: Its name.
        version: Its version.
        description: One line.
        hash: Of its definition, see :class:`~.splits.Split`.
        drives: Fingerprint by drive.
    """

    name: str
    version: int
    description: str
    hash: str
    drives: dict[str, tuple[float, ...]]

    @classmethod
    def of(cls, split: Split) -> Self:
        """The record of a split."""
        return cls(split.name, split.version, split.description, split.hash, split.fingerprints)


@configuration
class RunResult:
    """The drives of one policy, or of one training seed of it.

    Args:
        source: Name or file of the policy.
        drives: Metrics by split and drive; a drive without a result is missing.
        failures: Why, by split and drive.
        notes: What the policy counted, by split and drive, where it did.
    """

    source: str
    drives: dict[str, dict[str, DriveValues]]
    failures: dict[str, dict[str, str]]
    notes: dict[str, dict[str, dict[str, str]]]


@configuration
class PolicyResult:
    """A policy on a motion base.

    Args:
        information: What it knows of the drive, such as ``now`` or ``2 s true``; see
            :class:`~motion_cueing.baselines.Information`.
        runs: One, or one for each training seed.
    """

    information: str
    runs: tuple[RunResult, ...]

    def finished(self, split: str) -> list[str]:
        """Drives of a split that every run finished."""
        runs = [run.drives.get(split, {}) for run in self.runs]
        return [name for name in runs[0] if all(name in run for run in runs[1:])]

    def values(self, split: str, metric: str, drives: Sequence[str]) -> Floats:
        """(runs, n) of a metric in drives that every run finished; NaN where it is undefined."""
        return np.array(
            [[run.drives[split][name][metric] for name in drives] for run in self.runs], dtype=np.float64
        )


@configuration
class Summary:
    """A policy over the drives of a split that it finished.

    Args:
        platform: Motion base.
        policy: Label.
        split: Name.
        metric: ``cue_error`` or ``perceived_cue_error``; lower is better.
        information: What the policy knows of the drive.
        drives: Number of drives that it finished, of ``requested``.
        requested: Number of drives of the split.
        mean: Over the drives.
        median: Over the drives.
        worst_tenth: Mean over the worst tenth of the drives.
        difference: Mean over the drives that both finished of the metric less that of the reference policy:
            below 0 is better. None where the reference was not driven, and of itself.
        improvement: Probability that it is better than the reference in a drive.
        normalized_score: 0 is the reference, 1 the optimum, of the means over drives that all three finished;
            None where one is missing.
        run_means: Mean of each run: the spread over training seeds.
        step_time_mean: Mean time of a step, s; None where it was not measured.
        step_time_p99: Largest 99th percentile of the time of a step in a drive, s.
    """

    platform: str
    policy: str
    split: str
    metric: str
    information: str
    drives: int
    requested: int
    mean: Estimate
    median: Estimate
    worst_tenth: Estimate
    difference: Estimate | None
    improvement: Estimate | None
    normalized_score: float | None
    run_means: tuple[float, ...]
    step_time_mean: float | None
    step_time_p99: float | None


@configuration
class BenchmarkResults(Headed):
    """Everything that the benchmark measured: ``benchmark.json``.

    Args:
        benchmark: Version of the benchmark.
        reference: Label of the policy that others are compared with.
        splits: The drives.
        platforms: Results by motion base and policy.
        skipped: Policies that cannot be driven on a motion base, and why, by motion base.
        finished: Whether every drive is done; an interrupted benchmark goes on by the same command.
        summaries: One a motion base, policy, split and metric.
    """

    what = "benchmark results"
    version = SCHEMA

    benchmark: int
    reference: str
    splits: tuple[SplitResult, ...]
    platforms: dict[str, dict[str, PolicyResult]]
    skipped: dict[str, dict[str, str]]
    finished: bool
    summaries: tuple[Summary, ...]

    @classmethod
    def of(
        cls,
        words: Sequence[str],
        splits: Sequence[SplitResult],
        platforms: Mapping[str, dict[str, PolicyResult]],
        skipped: Mapping[str, dict[str, str]],
        finished: bool = True,
        references: References | None = None,
    ) -> Self:
        """The results of drives, with their statistics.

        Args:
            words: The command line, program first.
            splits: The drives.
            platforms: Results by motion base and policy.
            skipped: Why policies are not driven, by motion base and policy.
            finished: Whether every drive is done.
            references: The policies with the normalized scores 0 and 1.
        """
        references = references or References()
        summaries = [
            summarize(platform, policies, policy, split, metric, references)
            for platform, policies in platforms.items()
            for split in splits
            for policy in policies
            if policies[policy].finished(split.name)
            for metric in SUMMARIZED
        ]
        return cls(
            **cls.head(words),
            benchmark=BENCHMARK_VERSION,
            reference=references.baseline,
            splits=tuple(splits),
            platforms=dict(platforms),
            skipped=dict(skipped),
            finished=finished,
            summaries=tuple(summaries),
        )

    def of_split(self, platform: str, split: str, metric: str = "cue_error") -> dict[str, Summary]:
        """Summaries by policy."""
        return {
            one.policy: one
            for one in self.summaries
            if (one.platform, one.split, one.metric) == (platform, split, metric)
        }

    def save_csv(self, path: str | Path) -> None:
        """Write ``benchmark.csv``: one row a motion base, policy, run, split and drive, in SI units."""
        rows = [
            {
                "platform": platform,
                "policy": policy,
                "run": run.source,
                "split": split,
                "drive": drive,
                **values,
            }
            for platform, policies in self.platforms.items()
            for policy, result in policies.items()
            for run in result.runs
            for split, drives in run.drives.items()
            for drive, values in drives.items()
        ]
        save_rows(rows, path)

    def save_summaries(self, path: str | Path) -> None:
        """Write ``summaries.csv``: the statistics, one row a motion base, policy, split and metric."""
        rows = []
        for one in self.summaries:
            row: dict[str, Any] = {}
            for name, value in to_dict(one).items():
                if name == "run_means":
                    value = " ".join(map(str, value))
                if name in ("mean", "median", "worst_tenth", "difference", "improvement"):
                    ends = value or {"value": None, "low": None, "high": None}
                    row |= {name: ends["value"], f"{name}_low": ends["low"], f"{name}_high": ends["high"]}
                else:
                    row[name] = value
            rows.append(row)
        save_rows(rows, path)


def summarize(
    platform: str,
    policies: Mapping[str, PolicyResult],
    policy: str,
    split: SplitResult,
    metric: str,
    references: References,
) -> Summary:
    """The statistics of a policy over a split; it finished at least one drive.

    Args:
        platform: The motion base.
        policies: Results on it.
        policy: Label.
        split: The drives.
        metric: Its name.
        references: The policies with the normalized scores 0 and 1.
    """
    result = policies[policy]
    names = result.finished(split.name)
    values = result.values(split.name, metric, names)
    against = better = None
    reference = policies.get(references.baseline)
    if reference is not None and policy != references.baseline:
        both = [name for name in reference.finished(split.name) if name in names]
        if both:
            pair = [one.values(split.name, metric, both) for one in (result, reference)]
            against, better = difference(*pair), improvement(*pair)
    perceived = metric == "perceived_cue_error"
    optimum = policies.get(references.perceived_optimum if perceived else references.optimum)
    score = None
    if reference is not None and optimum is not None:
        trio = [result, reference, optimum]
        common = [name for name in names if all(name in one.finished(split.name) for one in trio[1:])]
        if common:
            means = [float(one.values(split.name, metric, common).mean()) for one in trio]
            score = normalized_score(*means)
    times = {name: result.values(split.name, name, names) for name in ("step_time_mean", "step_time_p99")}
    measured = all(np.isfinite(one).any() for one in times.values())
    return Summary(
        platform=platform,
        policy=policy,
        split=split.name,
        metric=metric,
        information=result.information,
        drives=len(names),
        requested=len(split.drives),
        mean=estimate(values),
        median=estimate(values, np.median),
        worst_tenth=estimate(values, worst_tenth),
        difference=against,
        improvement=better,
        normalized_score=score,
        run_means=tuple(values.mean(axis=1).tolist()),
        step_time_mean=float(np.nanmean(times["step_time_mean"])) if measured else None,
        step_time_p99=float(np.nanmax(times["step_time_p99"])) if measured else None,
    )
