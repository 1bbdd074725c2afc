"""Jobs whose process dies in the middle, and who listens to them."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from motion_cueing.train.config import TrainingConfig
from motion_cueing.train.experiments.engine import Ending, Job, Report
from motion_cueing.train.experiments.job import TrainingJob
from motion_cueing.train.run import checkpoints_in
from motion_cueing.train.training import Status

from .. import tiny


def config(folder: Path, **fields: Any) -> TrainingConfig:
    """Eight rounds of an analytic policy gradient."""
    small = tiny.config(
        folder,
        "apg",
        n_envs=3,
        steps=480,
        task={"observation": {"frame": "cab"}, "action": {"frame": "cab", "repeat": 5, "authority": 0.5}},
        validation={"every": 240},
        checkpoints={"every": 120},
    )
    return replace(small, **fields)


def seeds(folder: Path, config: TrainingConfig, count: int) -> list[TrainingJob]:
    """Trainings with other seeds."""
    folder.mkdir()
    return [
        TrainingJob(f"seed-{seed}", folder / f"seed-{seed}", replace(config, seed=seed))
        for seed in range(count)
    ]


@dataclass(frozen=True)
class Around:
    """A job around a training.

    Args:
        training: The training.
    """

    training: TrainingJob

    @property
    def name(self) -> str:
        return self.training.name

    @property
    def config(self) -> TrainingConfig:
        return self.training.config


@dataclass(frozen=True)
class Mortal(Around):
    """A training whose process is killed when it is half done; once, or always.

    Args:
        always: Whether every process that takes it up is killed.
    """

    always: bool = False

    def run(self, report: Report) -> Any:
        seen = [path.stem for path in checkpoints_in(self.training.path / "checkpoints")]

        def fatal(status: Status) -> bool:
            answer = report(status)
            if (2 * status.steps >= status.total and not seen) or self.always:
                os.kill(os.getpid(), signal.SIGKILL)
            return answer

        outcome = self.training.run(fatal)
        return outcome, seen


@dataclass(frozen=True)
class Failing:
    """A job that fails where it is run."""

    name: str
    config: TrainingConfig

    def run(self, report: Report) -> Any:
        raise ZeroDivisionError("one by\nnothing")


@dataclass(frozen=True)
class Waiting(Around):
    """A training that waits, half done, to be stopped."""

    def run(self, report: Report) -> Any:
        def held(status: Status) -> bool:
            while 2 * status.steps >= status.total and not report(status):
                time.sleep(0.1)
            return 2 * status.steps >= status.total

        return self.training.run(held)


class Heard:
    """Keeps what it is told; may press Ctrl-C once so many jobs have been heard of."""

    def __init__(self, press_after: int | None = None) -> None:
        self.statuses: dict[str, list[int]] = {}
        self.endings: dict[str, Ending] = {}
        self._press_after = press_after

    def told(self, job: Job, status: Status) -> None:
        self.statuses.setdefault(job.name, []).append(status.steps)
        if self._press_after is not None and len(self.statuses) == self._press_after:
            self._press_after = None
            signal.raise_signal(signal.SIGINT)

    def ended(self, job: Job, ending: Ending) -> None:
        self.endings[job.name] = ending
