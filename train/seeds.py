"""One training with several seeds: what it comes to, and how far that is luck."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..envs.errors import DataError
from ..envs.settings import configuration, load, save
from ..envs.storage import write_text
from ..envs.task.options import PositiveCount
from .config import TrainingConfig
from .engine.job import Ending, Engine, Listener, run_jobs
from .run import free_folder
from .training_job import TrainingJob

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
            raise DataError(f"failed: {'; '.join(wrong)}; --resume {self.path} tries again")
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
