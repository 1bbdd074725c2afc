"""Trainings on an engine from the command line: run them, and say what came of them."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..envs.errors import DataError
from .engine.choose import make_engine
from .engine.job import Engine, run_jobs
from .fleet_progress import FleetProgress
from .population import Population, is_population
from .run import RunFolder
from .search import Search, is_search
from .seeds import Seeds, is_seeds, summary
from .training import Outcome
from .training_job import TrainingJob

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
        given |= {"address": self.address, "jobs": None if self.jobs is None else str(self.jobs)}
        return "".join(f" --{name} {value}" for name, value in given.items() if value is not None)


def kind_of(path: Path) -> str | None:
    """Which kind of several trainings a folder holds; None where it is one training."""
    kinds = {"search": is_search, "seeds": is_seeds, "population": is_population}
    found = next((kind for kind, holds in kinds.items() if holds(path)), None)
    if found == "search":
        raise DataError(f"--resume {path}: a search; say with --search how many trainings there shall be")
    return found


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
        return _stopped(f"--resume {folder.path}{place.words}")
    ending = endings[job.name]
    if ending.error is not None:
        raise DataError(ending.error)
    return report_training(folder, ending.result, place.words)


def report_training(folder: RunFolder, outcome: Outcome, words: str = "") -> int:
    """Say what came of a training; returns the exit status."""
    steps = outcome.status.steps
    if outcome.interrupted:
        return _stopped(f"--resume {folder.path}{words}", f" after {steps:,} steps")
    print(f"{folder.final_agent}: the agent after {steps:,} steps")
    if folder.best_agent.exists():
        print(f"{folder.best_agent}: the best on the validation drives")
    return _SUCCESS


def run_search(search: Search, trials: int, place: Place) -> int:
    """A search, until it has so many results; returns the exit status."""
    with place.open() as (engine, progress):
        interrupted = search.run(trials, engine, progress)
    if interrupted:
        return _stopped(f"--resume {search.path} --search {trials}{place.words}")
    best = search.best()
    if best is not None:
        print(f"{search.best_config}: trial {best.number}, {best.value:.4g}")
    return _SUCCESS


def run_seeds(seeds: Seeds, place: Place) -> int:
    """Several seeds; returns the exit status."""
    with place.open() as (engine, progress):
        found, interrupted = seeds.run(engine, progress)
    if interrupted:
        return _stopped(f"--resume {seeds.path}{place.words}")
    print(f"{seeds.path}: {summary(found)}")
    return _SUCCESS


def run_population(population: Population, place: Place) -> int:
    """A population; returns the exit status."""
    with place.open() as (engine, progress):
        interrupted = population.run(engine, progress)
    if interrupted:
        return _stopped(f"--resume {population.path}{place.words}")
    print(f"{population.best_agent}: the best of {len(population.generations[-1])} members")
    return _SUCCESS


def _stopped(words: str, when: str = "") -> int:
    print(f"stopped{when}; go on with: motion-cueing train {words}", file=sys.stderr)
    return _INTERRUPTED
