"""What the studies' commands have in common: checks, results, files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from ..envs.progress import drives_progress
from ..envs.storage import check_folder, check_own_json, write_bytes
from ..evaluation.metrics import Criteria
from ..evaluation.reporting.figures import png
from ..evaluation.reporting.text import save_markdown, table_console
from ..evaluation.studies.results import (
    StudyResults,
    common_maneuvers,
    matrix_table,
    print_study,
    score_tables,
    summarize,
)
from ..evaluation.studies.store import check_kept, forget_kept
from ..evaluation.studies.study import Condition, StudyOutcome, run_study


def prepare(out: Path, fresh: bool) -> None:
    """Refuse a folder that cannot be used; with ``fresh``, forget the drives that are kept.

    Raises:
        DataError: ``out`` cannot be written, holds another's study.json, or drives that are damaged.
    """
    check_folder("--out", out)
    check_own_json("--out", out / "study.json", frozenset({"schema", "conditions"}))
    if fresh:
        forget_kept(out)
    check_kept(out)


def run_and_save(
    conditions: list[Condition],
    policies: Mapping[str, str],
    out: Path,
    words: Sequence[str],
    title: str,
    ratios: bool,
    figure: Callable[[StudyResults], Figure | None],
) -> int:
    """Drive a study, print its tables, write its files.

    Args:
        conditions: Parts of the study.
        policies: Name or file by label.
        out: Folder.
        words: The command line.
        title: Of the table of J.
        ratios: Whether J over that under the first condition stands in it.
        figure: Draws the study; None where there is nothing to draw.

    Returns:
        Exit status: 1 if a drive failed.
    """
    count = sum(len(condition.maneuvers) for condition in conditions) * len(policies)
    with drives_progress(count) as advance:
        outcome = run_study(conditions, policies, out, advance)
    results = results_of(conditions, list(policies), outcome, words)
    _write(results, out, title, ratios)
    drawn = figure(results)
    if drawn is not None:
        write_bytes(out / "study.png", png(drawn))
    console = table_console()
    print_study(console, results, title, ratios)
    console.print(
        f"{outcome.driven} of {count} drives driven now; everything is in {out}",
        highlight=False,
        markup=False,
    )
    return 1 if results.failures else 0


def _write(results: StudyResults, out: Path, title: str, ratios: bool) -> None:
    """What stays of a study, but its figure."""
    results.save_json(out / "study.json")
    results.save_csv(out / "study.csv")
    skipped = [f"Skipped: {line}" for line in results.skipped_lines()]
    save_markdown(out / "study.md", matrix_table(results, title, ratios), *score_tables(results), *skipped)


def results_of(
    conditions: Sequence[Condition], policies: Sequence[str], outcome: StudyOutcome, words: Sequence[str]
) -> StudyResults:
    """The results of an outcome, with what made them."""
    criteria = Criteria()
    return StudyResults(
        **StudyResults.head(words),
        conditions={condition.name: condition.description for condition in conditions},
        policies=tuple(policies),
        maneuvers=common_maneuvers(outcome.metrics),
        summaries=summarize(outcome.metrics, criteria),
        skipped=outcome.skipped,
        failures=tuple(outcome.failures),
        metrics=outcome.metrics,
        notes=outcome.statistics,
        criteria=criteria,
    )
