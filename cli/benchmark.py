"""``motion-cueing benchmark``: policies over fixed, versioned drives, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from ..envs.errors import ConfigurationError
from ..envs.progress import Interrupt, progress
from ..envs.storage import check_folder, check_own_json, write_bytes, write_text
from .arguments import (
    ALL,
    BENCHMARK,
    Fresh,
    Names,
    OutFolder,
    PolicyNames,
    Workers,
    find_platforms,
    find_policies,
    option,
    several,
)

if TYPE_CHECKING:
    from ..envs.platform import Platform
    from ..evaluation.benchmark import BenchmarkResults, Entrant, Split

SLOW: Final = ("nmpc", "nmpc-preview", "optimum-perceived", "optimum")
"""Policies of the benchmark that are driven only where they are named: they take hours over all drives."""


@dataclass(frozen=True, kw_only=True)
class BenchmarkCommand:
    """Drive policies in the fixed drives of the benchmark, and compare them with 95 % intervals.

    The drives are three splits: standard maneuvers, recorded drives, and random drives that no training or
    tuning draws. Writes benchmark.json, benchmark.md, two CSV files and figures. Finished drives are kept in
    the output folder and not driven again. Without --policies it drives all of the benchmark but `nmpc` and
    the optimum, which take hours. Several training seeds of one agent are one policy: `NAME=FILE,FILE`.
    """

    policies: PolicyNames = ()
    platforms: Names = ("paper",)
    """Motion bases, by name or YAML file; `all` for every whole one."""
    splits: Annotated[tuple[str, ...], several("NAME ...")] = (ALL,)
    """Splits of drives: `standard`, `recorded`, `held-out`, or `all`."""
    compare: Annotated[tuple[Path, Path] | None, option("A.json B.json")] = None
    """Set two results side by side instead of driving; drives must be the same in both."""
    workers: Workers = 1
    markdown: Annotated[Path | None, option("FILE.md")] = None
    """Also write the page to this file, and its figures beside it."""
    out: OutFolder = Path("benchmark")
    fresh: Fresh = False


def run(command: BenchmarkCommand) -> int:
    """Drive what is missing and write the results, or compare; the exit status is 1 if a drive failed."""
    if command.compare is not None:
        return _compare(*command.compare)
    from ..evaluation.benchmark import BenchmarkRequest, BenchmarkResults, SplitResult
    from ..evaluation.benchmark.run import BenchmarkRun, forget_kept
    from ..evaluation.reporting.text import how_many, table_console, words_of

    if command.workers < 1:
        raise ConfigurationError(f"--workers must be at least 1, found {command.workers}")
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "benchmark.json", frozenset({"schema", "benchmark"}))
    machines = find_platforms(command.platforms)
    entrants, may_skip = find_entrants(command.policies, next(iter(machines.values())))
    splits = find_splits(command.splits)
    if command.fresh:
        forget_kept(command.out)
    request = BenchmarkRequest(
        splits, list(machines.values()), entrants, command.out, command.workers, frozenset(may_skip)
    )
    whole, interrupt = BenchmarkRun(request), Interrupt()
    with interrupt.caught(), progress(whole.missing, "drives") as bar:
        outcome = whole.drive(
            lambda what, drives: bar.move(text=what, advance=drives), lambda: interrupt.asked
        )
    results = BenchmarkResults.of(
        words_of("benchmark", command),
        [SplitResult.of(split) for split in splits],
        outcome.platforms,
        outcome.skipped,
        outcome.finished,
    )
    write(results, command.out, command.markdown)
    show(results)
    table_console().print(
        f"{how_many(outcome.driven, 'drive')} driven now; everything is in {command.out}",
        highlight=False,
        markup=False,
    )
    if not outcome.finished:
        raise KeyboardInterrupt
    failed = any(
        run.failures[split]
        for policies in outcome.platforms.values()
        for result in policies.values()
        for run in result.runs
        for split in run.failures
    )
    return 1 if failed else 0


def find_entrants(names: Sequence[str], platform: Platform) -> tuple[list[Entrant], list[str]]:
    """The policies of names, and labels of those that may be skipped where they do not fit.

    Args:
        names: Names, files, classes and ``NAME=FILE,FILE``; none for the benchmark without the slow ones.
        platform: A machine, to name a class of one's own.

    Raises:
        ConfigurationError: a name of seeds stands for another policy, or is given twice.
    """
    from ..evaluation.benchmark import Entrant, benchmark_policies
    from ..evaluation.policies import policy_names

    own = benchmark_policies(policy_names())
    plain = list(names) or [name for name in own if name not in SLOW]
    groups = {name: name.partition("=") for name in plain if "=" in name and not Path(name).exists()}
    singles = [name for name in plain if name not in groups]
    labels = {} if groups and not singles else find_policies(singles, platform)
    entrants = {label: Entrant(label, (name,)) for label, name in labels.items()}
    for label, _, files in groups.values():
        if not label or label in entrants or label in policy_names():
            raise ConfigurationError(
                f"--policies {label}={files}: the name must be new, and of no other policy; choose another"
            )
        entrants[label] = Entrant(label, tuple(file for file in files.split(",") if file))
        if not entrants[label].sources:
            raise ConfigurationError(
                f"--policies {label}=: name its files: {label}=a.safetensors,b.safetensors"
            )
    optional = own if not names or BENCHMARK in names else []
    return list(entrants.values()), [name for name in optional if name not in names]


def find_splits(names: Sequence[str]) -> list[Split]:
    """Splits by name; ``all`` stands for every one."""
    from ..evaluation.benchmark import SPLITS, get_split

    named = [name for given in names for name in (SPLITS if given == ALL else [given])]
    return [get_split(name) for name in dict.fromkeys(named)]


def write(results: BenchmarkResults, folder: Path, markdown: Path | None) -> None:
    """Write benchmark.json, the CSV files, the page and its figures; the page also to ``markdown``."""
    from ..evaluation.benchmark.page import page

    results.save_json(folder / "benchmark.json")
    results.save_csv(folder / "benchmark.csv")
    results.save_summaries(folder / "summaries.csv")
    figures = draw(results)
    for path in [folder / "benchmark.md", *([markdown] if markdown is not None else [])]:
        names = {what: f"{path.stem}-{what}.png" for what in figures}
        for what, image in figures.items():
            write_bytes(path.parent / names[what], image)
        write_text(path, page(results, names))


def draw(results: BenchmarkResults) -> Mapping[str, bytes]:
    """The figures by what they show and on which motion base."""
    from ..evaluation.benchmark.figures import interval_figure, profile_figure
    from ..evaluation.reporting.figures import png
    from ..evaluation.reporting.text import file_names

    driven = [name for name in results.platforms if any(s.platform == name for s in results.summaries)]
    images = {}
    for platform, name in file_names(driven).items():
        images[f"intervals-{name}"] = png(interval_figure(results, platform))
        images[f"profiles-{name}"] = png(profile_figure(results, platform))
    return images


def show(results: BenchmarkResults) -> None:
    """Print the tables and notes."""
    from ..evaluation.benchmark.page import notes, tables
    from ..evaluation.reporting.text import print_table, table_console

    console = table_console()
    for table in tables(results):
        print_table(console, table)
    for line in notes(results):
        console.print(line, highlight=False, markup=False)


def _compare(first: Path, second: Path) -> int:
    """Print two results side by side; the exit status is 1 if a split is not the same in both."""
    from ..evaluation.benchmark import BenchmarkResults, compare, comparison_table
    from ..evaluation.benchmark.page import VERSIONS
    from ..evaluation.reporting.text import print_note, print_table, table_console

    pair = [BenchmarkResults.load_json(path) for path in (first, second)]
    found = compare(*pair)
    console = table_console()
    for path, results in zip((first, second), pair, strict=True):
        about = ", ".join(f"{name} {results.versions.get(name, 'unknown')}" for name in VERSIONS)
        console.print(f"{path}: {results.created}, {about}", highlight=False, markup=False)
    print_table(console, comparison_table(found))
    for path, names in ((first, found.only_first), (second, found.only_second)):
        for name in names:
            print_note(console, "skipped", f"{name}: only in {path}")
    for split, reason in found.refused.items():
        print_note(console, "failed", f"{split} is not compared: {reason}")
    return 1 if found.refused else 0
