"""Several seeds of one training, with mean and spread of their results; experiments run on an engine."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
from rich.console import Console
from typing_extensions import Self

from ...envs.errors import DataError
from ...envs.progress import Bar, Bars
from ...envs.settings import configuration, load, save
from ...envs.task.options import PositiveCount
from ..config import TrainingConfig
from ..run import RunFolder, free_folder, is_training
from ..training import Outcome, Status
from .engine import Ending, Engine, Job, Listener, make_engine, run_jobs
from .job import TrainingJob, write_table
from .population import Population, is_population
from .search import Search, is_search

_PLAN: Final = "seeds.yaml"
_TABLE: Final = "results.csv"


@configuration
class SeedsPlan:
    """Which trainings there are.

    Args:
        config: What they have in common; its seed is the first.
        count: Of the seeds, which follow each other.
    """

    config: TrainingConfig
    count: PositiveCount


class Seeds:
    """Trainings that differ in their seed, in folders ``seed-S`` of one folder."""

    def __init__(self, path: Path, plan: SeedsPlan) -> None:
        self.path, self.plan = path, plan

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig, count: int) -> Seeds:
        """New trainings."""
        seeds = cls(free_folder(path, f"{config.algo}-seeds"), SeedsPlan(config, count))
        save(seeds.plan, seeds.path / _PLAN)
        return seeds

    @classmethod
    def open(cls, path: Path, steps: int | None = None) -> Seeds:
        """Trainings that were begun, perhaps with another length."""
        plan = load(SeedsPlan, path / _PLAN)
        if steps is not None:
            plan = replace(plan, config=replace(plan.config, steps=steps))
            save(plan, path / _PLAN)
        return cls(path, plan)

    @property
    def jobs(self) -> list[TrainingJob]:
        """A job for each seed."""
        config = self.plan.config
        configs = [replace(config, seed=config.seed + i) for i in range(self.plan.count)]
        folder = self.path.resolve()
        return [TrainingJob(f"seed-{c.seed}", folder / f"seed-{c.seed}", c) for c in configs]

    def run(self, engine: Engine, listener: Listener) -> tuple[list[float], bool]:
        """Train; finished trainings stay as they are.

        Returns:
            What the configuration calls best of each seed's best agent, and whether Ctrl-C stopped them.

        Raises:
            DataError: some failed; the others are done.
        """
        endings, interrupted = run_jobs(engine, self.jobs, listener)
        self._report(endings)
        wrong = [f"{name} ({ending.error})" for name, ending in endings.items() if ending.error is not None]
        if wrong:
            raise DataError(f"failed: {'; '.join(wrong)}; the same command tries again")
        results = [ending.result for ending in endings.values()]
        return [result.status.best for result in results if not result.interrupted], interrupted

    def _report(self, endings: dict[str, Ending]) -> None:
        rows = [[job.config.seed, *_row(endings.get(job.name))] for job in self.jobs]
        write_table(self.path / _TABLE, [["seed", "state", "steps", "best", "last J"], *rows])


def is_seeds(path: Path) -> bool:
    """Whether a folder holds several seeds."""
    return (path / _PLAN).exists()


def summary(values: list[float]) -> str:
    """Mean and spread of what the seeds came to."""
    mean, low, high = np.mean(values), min(values), max(values)
    return f"best in validation {mean:.3f}, {low:.3f} to {high:.3f} over {len(values)} seeds"


def _row(ending: Ending | None) -> list[Any]:
    if ending is None:
        return ["not begun", "", "", ""]
    if ending.error is not None:
        return ["failed", "", "", ""]
    status = ending.result.status
    state = "stopped" if ending.result.interrupted else "done"
    best = "" if status.best is None else f"{status.best:.6g}"
    return [state, status.steps, best, "" if status.score is None else f"{status.score.cue_error:.6g}"]


_INTERRUPTED: Final = 130
_SUCCESS: Final = 0


class TrainingProgress:
    """A bar for each training on a terminal, and a line for each validation anywhere.

    Shows one training (:meth:`tell`), or the jobs of an engine (as its listener).

    Args:
        total: Actions of one training, to show its bar before its first status.
        console: Where to write; default: the error stream.
    """

    def __init__(self, total: int | None = None, console: Console | None = None) -> None:
        self._all, self._bars = Bars(console), dict[str, Bar]()
        if total is not None:
            self._bars["training"] = self._all.add("training", total)

    def __enter__(self) -> Self:
        """Show bars."""
        self._all.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove them."""
        self._all.__exit__(kind, error, trace)

    def tell(self, status: Status) -> None:
        """Show the progress of the one training."""
        self._show("training", status, "")

    def update(self, job: Job, status: Status) -> None:
        """Show the progress of a job."""
        self._show(job.name, status, f"{job.name}: ")

    def ended(self, job: Job, ending: Ending) -> None:
        """Remove a job's bar."""
        if job.name in self._bars:
            self._bars.pop(job.name).remove()

    def _show(self, name: str, status: Status, before: str) -> None:
        bar = self._bars.get(name) or self._all.add(name, status.total)
        self._bars[name] = bar
        speed = bar.speed
        bar.move(status.steps, note=f"{speed:,.0f} a second" if speed else "")
        if status.news:
            self._all.line(f"{before}{validation_line(status)}")
        for sentence in status.warnings:
            self._all.line(f"{before}warning: {sentence}")


def validation_line(status: Status) -> str:
    """One line about the last validation, of 120 characters: what is unknown is left out."""
    score = status.score
    assert score is not None
    beside = {} if status.references is None else status.references.shown()
    parts = [f"{_short(status.steps):>5} J {_three(score.cue_error)}"]
    if beside:
        parts.append(f"({' '.join(f'{name} {_three(value)}' for name, value in beside.items())})")
    if score.noise is not None:
        parts.append(f"noise {'+' if score.noise >= 0.0 else '-'}{_three(abs(score.noise))}")
    if status.drive_share is not None:
        parts.append(f"drive {100.0 * status.drive_share:.0f}%")
    used = f"{100.0 * score.carriage_travel:.0f}/{100.0 * score.leg_travel:.0f}%"
    parts.append(f"travel {used} limits {100.0 * score.limited:.1f}%")
    if status.entropy is not None:
        parts.append(f"entropy {status.entropy:.1f}")
    if status.kl is not None:
        parts.append(f"KL {status.kl:.3f}")
    return " ".join(parts)


def _three(value: float) -> str:
    """A number with about three digits, without exponent."""
    return f"{value:.2f}" if abs(value) < 9.995 else f"{value:.1f}" if abs(value) < 99.95 else f"{value:.0f}"


def _short(steps: int) -> str:
    """Actions in at most five characters: 320, 12.8k, 1.25M."""
    if steps < 1_000:
        return str(steps)
    return f"{steps / 1e3:.3g}k" if steps < 999_500 else f"{steps / 1e6:.3g}M"


@dataclass(frozen=True)
class Place:
    """Where trainings run.

    Args:
        engine: By name.
        jobs: At a time; None for the engine's own choice.
        address: Of a Ray cluster.
    """

    engine: str
    jobs: int | None = None
    address: str | None = None

    def check(self) -> None:
        """Refuse an engine that is not there before anything is written."""
        make_engine(self.engine, self.jobs, self.address)

    @contextmanager
    def open(self) -> Iterator[tuple[Engine, TrainingProgress]]:
        """The engine, and what shows its work."""
        with make_engine(self.engine, self.jobs, self.address) as engine, TrainingProgress() as progress:
            yield engine, progress

    @property
    def words(self) -> str:
        """Options that lead here again."""
        engine = None if self.engine == "local" else self.engine
        given = {"engine": engine, "address": self.address, "workers": self.jobs}
        return "".join(f" --{name} {value}" for name, value in given.items() if value is not None)


def kind_of(path: Path) -> str | None:
    """What was begun in a folder: "search", "seeds", "population" or "training"; None where nothing was."""
    kinds = {"search": is_search, "seeds": is_seeds, "population": is_population, "training": is_training}
    return next((kind for kind, holds in kinds.items() if holds(path)), None)


def run_training(folder: RunFolder, place: Place) -> int:
    """One training on an engine; returns the exit status."""
    folder.path.parent.mkdir(parents=True, exist_ok=True)
    job = TrainingJob("training", folder.path.resolve(), folder.config)
    with place.open() as (engine, progress):
        endings, _ = run_jobs(engine, [job], progress)
    if job.name not in endings:
        return _stopped(f"train --out {folder.path}{place.words}")
    ending = endings[job.name]
    if ending.error is not None:
        raise DataError(ending.error)
    return report_training(folder, ending.result, place.words)


def report_training(folder: RunFolder, outcome: Outcome, words: str = "") -> int:
    """Print the result of a training; returns the exit status."""
    steps = outcome.status.steps
    if outcome.interrupted:
        return _stopped(f"train --out {folder.path}{words}", f" after {steps:,} steps")
    print(f"{folder.final_agent}: the agent after {steps:,} steps")
    if folder.best_agent.exists():
        print(f"{folder.best_agent}: the best on the validation drives")
    return _SUCCESS


def run_search(search: Search, trials: int, place: Place) -> int:
    """A search, until it has so many results; returns the exit status."""
    with place.open() as (engine, progress):
        interrupted = search.run(trials, engine, progress)
    if interrupted:
        return _stopped(f"search --out {search.path} --trials {trials}{place.words}")
    best = search.best()
    if best is not None:
        print(f"{search.best_config}: trial {best.number}, {best.value:.4g}")
    return _SUCCESS


def run_seeds(seeds: Seeds, place: Place) -> int:
    """Several seeds; returns the exit status."""
    with place.open() as (engine, progress):
        results, interrupted = seeds.run(engine, progress)
    if interrupted:
        return _stopped(f"train --out {seeds.path}{place.words}")
    print(f"{seeds.path}: {summary(results)}")
    return _SUCCESS


def run_population(population: Population, place: Place) -> int:
    """A population; returns the exit status."""
    with place.open() as (engine, progress):
        interrupted = population.run(engine, progress)
    if interrupted:
        return _stopped(f"population --out {population.path}{place.words}")
    print(f"{population.best_agent}: the best of {len(population.generations[-1])} members")
    return _SUCCESS


def _stopped(words: str, when: str = "") -> int:
    print(f"stopped{when}; go on with: motion-cueing {words}", file=sys.stderr)
    return _INTERRUPTED
