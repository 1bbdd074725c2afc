"""The page of the benchmark: its tables, on a terminal and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from ..reporting.text import NOTHING, TextTable, fraction, how_many, markdown, microseconds, number, percent
from ..suite import trouble_lines
from .compare import with_interval
from .results import BenchmarkResults, Summary
from .statistics import Estimate

VERSIONS: Final = ("motion-cueing-gym", "python", "numpy", "warp-lang")
"""What stands beside the figures, of the versions of a result."""

_ALT: Final = {
    "intervals": "mean J with its 95 % interval (dot and bar), median (tick), worst tenth (triangle)",
    "profiles": "share of drives with a J up to each value, with 95 % bands",
}


def main_table(results: BenchmarkResults, platform: str, split: str) -> TextTable:
    """Every policy over a split: J, its worst tenth, and the comparison with the reference."""
    cue = results.of_split(platform, split)
    perceived = results.of_split(platform, split, "perceived_cue_error")
    scored = any(one.normalized_score is not None for one in cue.values())
    rows = [
        (
            policy,
            one.information,
            *((f"{one.drives}",) if _incomplete(cue) else ()),
            with_interval(one.mean),
            number(one.median.value),
            number(one.worst_tenth.value),
            with_interval(perceived[policy].mean),
            number(perceived[policy].worst_tenth.value),
            *((fraction(one.normalized_score),) if scored else ()),
            microseconds(one.step_time_mean),
            microseconds(one.step_time_p99),
        )
        for policy, one in cue.items()
    ]
    header = (
        "policy",
        "knows",
        *(("drives",) if _incomplete(cue) else ()),
        "J",
        "median",
        "worst tenth",
        "perceived J",
        "worst tenth",
        *(("normalized score",) if scored else ()),
        "step mean µs",
        "p99 µs",
    )
    return TextTable(_title(results, platform, split, "J and perceived J"), header, tuple(rows), _best(cue))


def paired_table(results: BenchmarkResults, platform: str, split: str) -> TextTable:
    """Every policy against the reference in the same drives."""
    cue = results.of_split(platform, split)
    perceived = results.of_split(platform, split, "perceived_cue_error")
    rows = [
        (
            policy,
            *(
                cell
                for one in (cue[policy], perceived[policy])
                for cell in (with_interval(one.difference), _probability(one.improvement))
            ),
        )
        for policy in cue
        if cue[policy].difference is not None
    ]
    header = ("policy", "J less its J", "better %", "perceived J less its", "better %")
    title = _title(results, platform, split, f"against {results.reference} in the same drives")
    return TextTable(title, header, tuple(rows))


def seeds_table(results: BenchmarkResults, platform: str) -> TextTable:
    """Mean J of each training seed of the policies that have several."""
    rows = []
    for one in results.summaries:
        if one.platform == platform and one.metric == "cue_error" and len(one.run_means) > 1:
            means = one.run_means
            middle = sum(means) / len(means)
            spread = math.sqrt(sum((mean - middle) ** 2 for mean in means) / (len(means) - 1))
            rows.append(
                (
                    one.policy,
                    one.split,
                    str(len(means)),
                    *map(number, (middle, min(means), max(means), spread)),
                )
            )
    header = ("policy", "split", "seeds", "mean J", "best", "worst", "standard deviation")
    return TextTable("Spread over training seeds", header, tuple(rows))


def splits_table(results: BenchmarkResults) -> TextTable:
    """The splits with version and hash."""
    rows = [
        (one.name, f"{one.version}", f"{len(one.drives)}", one.description, one.hash[:12])
        for one in results.splits
    ]
    return TextTable("Splits", ("split", "version", "drives", "of", "hash"), tuple(rows))


def tables(results: BenchmarkResults) -> list[TextTable]:
    """All tables: of each motion base and split, and the spread over training seeds."""
    found = [splits_table(results)]
    for platform in results.platforms:
        for split in results.splits:
            made = [main_table(results, platform, split.name), paired_table(results, platform, split.name)]
            found += [table for table in made if table.rows]
        seeds = seeds_table(results, platform)
        found += [seeds] if seeds.rows else []
    return found


def notes(results: BenchmarkResults) -> list[str]:
    """Lines about policies that were skipped, drives that failed, and solves that went wrong."""
    lines = [] if results.finished else ["Interrupted: drives are missing; the same command goes on."]
    for platform, skipped in results.skipped.items():
        lines += [f"Skipped on {platform}: {policy}: {reason}" for policy, reason in skipped.items()]
    for platform, policies in results.platforms.items():
        counted = []
        for policy, result in policies.items():
            for run in result.runs:
                for split, failures in run.failures.items():
                    lines += [
                        f"Failed on {platform}: {policy}, {split}, {drive}: {reason}"
                        for drive, reason in list(failures.items())[:3]
                    ]
                    if len(failures) > 3:
                        lines.append(
                            f"Failed on {platform}: {policy}, {split}: {len(failures)} drives in all"
                        )
                for drives in run.notes.values():
                    counted += [(policy, drive, counts) for drive, counts in drives.items()]
        lines += [
            f"Counted on {platform}: {policy}: {line}" for policy, line in trouble_lines(counted).items()
        ]
    return lines


def page(results: BenchmarkResults, figures: Mapping[str, str]) -> str:
    """The page as Markdown.

    Args:
        results: Of the benchmark.
        figures: Files beside the page, by "intervals" or "profiles" and the motion base.
    """
    versions = ", ".join(f"{name} {results.versions[name]}" for name in VERSIONS if name in results.versions)
    parts = [
        "# Benchmark",
        f"Version {results.benchmark}, made on {results.created[:10]} with {versions}, by",
        f"```\n{results.command}\n```",
        "J and perceived J are defined in [Metrics](../reference/metrics.md). Lower is better. "
        "[How the benchmark works](../guides/benchmark.md) explains each column. "
        "Intervals are 95 %, by bootstrap over drives.",
        "## Splits",
        markdown(splits_table(results)),
    ]
    for platform in results.platforms:
        for split in results.splits:
            made = [main_table(results, platform, split.name), paired_table(results, platform, split.name)]
            if not made[0].rows:
                continue
            parts.append(f"## {split.name}, {platform}")
            for table in made:
                if table.rows:
                    parts += [f"{table.title}:", markdown(table)]
        seeds = seeds_table(results, platform)
        if seeds.rows:
            parts += [f"## Training seeds, {platform}", markdown(seeds)]
    if figures:
        parts.append("## Figures")
        for what, file in figures.items():
            kind, _, platform = what.partition("-")
            parts += [f"![{platform}: {_ALT[kind]}]({file})", f"On {platform}: {_ALT[kind]}."]
    lines = notes(results)
    if lines:
        parts += ["## Notes", *(f"- {line}" for line in lines)]
    return "\n\n".join(parts) + "\n"


def _incomplete(policies: dict[str, Summary]) -> bool:
    return any(one.drives < one.requested for one in policies.values())


def _title(results: BenchmarkResults, platform: str, split: str, what: str) -> str:
    drives = next(len(one.drives) for one in results.splits if one.name == split)
    return f"{split}, {how_many(drives, 'drive')}, {platform}: {what}"


def _best(policies: dict[str, Summary]) -> tuple[int, ...]:
    means = [one.mean.value for one in policies.values()]
    return (means.index(min(means)),) if means else ()


def _probability(one: Estimate | None) -> str:
    if one is None:
        return NOTHING
    if one.low is None:
        return percent(one.value)
    return f"{percent(one.value)} ({percent(one.low)} to {percent(one.high)})"
