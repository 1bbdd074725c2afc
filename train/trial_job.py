"""A trial of a search as a job of an engine."""

from __future__ import annotations

import math
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

from ..envs.errors import DataError
from .config import TrainingConfig
from .engine.job import Report
from .training import Status, rating
from .training_job import TrainingJob

JOURNAL: Final = "search.journal"
"""File with all trials, beside their folder."""

_STUDY: Final = "training"
_TRIALS: Final = "trials"


@dataclass(frozen=True)
class Tried:
    """What came of a trial.

    Args:
        value: Rating of its best agent; None where it was broken off as hopeless.
        interrupted: Whether Ctrl-C stopped it; it can be resumed.
    """

    value: float | None = None
    interrupted: bool = False


@dataclass(frozen=True)
class TrialJob:
    """A training whose validations the search is told, and which is broken off when they are hopeless.

    Args:
        number: The trial's.
        trial_id: The same for its storage.
        path: Folder of the search, absolute.
        config: The training.
    """

    number: int
    trial_id: int
    path: Path
    config: TrainingConfig

    @property
    def name(self) -> str:
        """What a person calls it."""
        return f"trial {self.number}"

    @property
    def folder(self) -> Path:
        """The training's."""
        return self.path / _TRIALS / f"{self.number:04d}"

    def run(self, report: Report) -> Tried:
        """Train, or go on; checkpoints are of no use afterwards.

        Raises:
            DataError: no validation is finite, or see :meth:`TrainingJob.run`.
        """
        trial = optuna.Trial(load_study(self.path), self.trial_id)
        every = self.config.validation.every

        def watched(status: Status) -> bool:
            if status.score is not None and status.news and status.steps >= every:
                trial.report(rating(status.score, self.config.validation.best), status.steps // every)
                if trial.should_prune() and status.steps < status.total:
                    raise optuna.TrialPruned
            return report(status)

        training = TrainingJob(self.name, self.folder, self.config)
        try:
            outcome = training.run(watched)
        except optuna.TrialPruned:
            found = Tried()
        else:
            if outcome.interrupted:
                return Tried(interrupted=True)
            found = Tried(_finite(outcome.status.best))
        shutil.rmtree(self.folder / "checkpoints", ignore_errors=True)
        return found


def _finite(value: float | None) -> float:
    if value is None or not math.isfinite(value):
        raise DataError("no validation of it is finite")
    return value


def create_study(path: Path) -> None:
    """Begin the journal of a search."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    path.mkdir(parents=True, exist_ok=True)
    (path / _TRIALS).mkdir(exist_ok=True)
    optuna.create_study(storage=_storage(path), study_name=_STUDY, direction="minimize", pruner=_pruner())


def load_study(path: Path) -> optuna.Study:
    """The study in the folder of a search, as its journal says."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna.load_study(storage=_storage(path), study_name=_STUDY, pruner=_pruner())


def _storage(path: Path) -> JournalStorage:
    return JournalStorage(JournalFileBackend(str(path / JOURNAL)))


def _pruner() -> optuna.pruners.BasePruner:
    return optuna.pruners.MedianPruner(n_startup_trials=4)
