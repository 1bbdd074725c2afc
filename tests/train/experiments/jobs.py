"""Trainings as jobs, and who listens to them."""

from __future__ import annotations

import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

from motion_cueing.train.config import TrainingConfig
from motion_cueing.train.experiments.engine import Ending, Job
from motion_cueing.train.experiments.job import TrainingJob
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


class Heard:
    """Keeps its messages; may press Ctrl-C after so many jobs have reported."""

    def __init__(self, press_after: int | None = None) -> None:
        self.statuses: dict[str, list[int]] = {}
        self.endings: dict[str, Ending] = {}
        self._press_after = press_after

    def update(self, job: Job, status: Status) -> None:
        self.statuses.setdefault(job.name, []).append(status.steps)
        if self._press_after is not None and len(self.statuses) == self._press_after:
            self._press_after = None
            signal.raise_signal(signal.SIGINT)

    def ended(self, job: Job, ending: Ending) -> None:
        self.endings[job.name] = ending
