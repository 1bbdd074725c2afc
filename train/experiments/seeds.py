"""One training with several seeds: what it comes to, and how far that is luck."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...envs.errors import DataError
from ...envs.settings import configuration, load, save
from ...envs.storage import write_text
from ...envs.task.options import PositiveCount
from ..config import TrainingConfig
from ..progress import FleetProgress
from ..run import RunFolder, free_folder
from ..training import Outcome
from .engines import Ending, Engine, Listener, make_engine, run_jobs
from .jobs import TrainingJob
from .population import Population
from .search import Search

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
    """Trainings that differ in their seed, in folders ``seed-S`` of one folder.

    Args:
        path: The folder.
        plan: Which there are.
    """

    def __init__(self, path: Path, plan: SeedsPlan) -> None:
        self.path, self.plan = path, plan

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig, count: int) -> Seeds:
        """New trainings.

        Raises:
            ConfigurationError: the folder is not empty.
        """
        seeds = cls(free_folder(path, f"{config.algo}-seeds"), SeedsPlan(config, count))
        save(seeds.plan, seeds.path / _PLAN)
        return seeds

    @classmethod
    def open(cls, path: Path, steps: int | None = None) -> Seeds:
        """Trainings that were begun, perhaps with another length.

        Raises:
            DataError: there are none.
        """
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
        """Train; what is done already stays.

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
        done = [ending.result.status.best for ending in endings.values() if not ending.result.interrupted]
        return done, interrupted

    def _report(self, endings: dict[str, Ending]) -> None:
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["seed", "state", "steps", "best", "last J"])
        for job in self.jobs:
            table.writerow([job.config.seed, *_row(endings.get(job.name))])
        write_text(self.path / _TABLE, text.getvalue())


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


# Trainings on an engine from the command line: run them, and say what came of them.


_INTERRUPTED: Final = 130
_SUCCESS: Final = 0


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
        """Refuse an engine that is not there before anything is written.

        Raises:
            ConfigurationError: a package is missing.
        """
        make_engine(self.engine, self.jobs, self.address)

    @contextmanager
    def open(self) -> Iterator[tuple[Engine, FleetProgress]]:
        """The engine, and what shows its work."""
        with make_engine(self.engine, self.jobs, self.address) as engine, FleetProgress() as progress:
            yield engine, progress

    @property
    def words(self) -> str:
        """Options that lead here again."""
        given = {"engine": self.engine if self.engine != "local" else None}
        given |= {"address": self.address, "workers": None if self.jobs is None else str(self.jobs)}
        return "".join(f" --{name} {value}" for name, value in given.items() if value is not None)


def run_training(folder: RunFolder, place: Place) -> int:
    """One training on an engine; returns the exit status.

    Raises:
        DataError: it failed.
    """
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
    """Say what came of a training; returns the exit status."""
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
        found, interrupted = seeds.run(engine, progress)
    if interrupted:
        return _stopped(f"train --out {seeds.path}{place.words}")
    print(f"{seeds.path}: {summary(found)}")
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
