"""A training as a job of an engine."""

from __future__ import annotations

import math
import platform
import shutil
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

from ...envs.errors import DataError, MotionCueingError
from ...envs.storage import copy_file, write_text
from ..config import TrainingConfig
from ..logs import LOG
from ..run import RunFolder, checkpoints_in
from ..training import Interrupt, Outcome, Status, Training, rating
from .engines import Report

_TRACE: Final = "error.txt"


@dataclass(frozen=True)
class TrainingJob:
    """A training in its folder, or a piece of it.

    Args:
        name: What a person calls it.
        path: The folder, absolute; what is there already is gone on from. The one above it exists.
        config: The training.
        until: Actions after which it pauses with a checkpoint; None for its end.
        parent: Folder of the training whose last checkpoint it begins with; None to begin anew.
    """

    name: str
    path: Path
    config: TrainingConfig
    until: int | None = None
    parent: Path | None = None

    def run(self, report: Report) -> Outcome:
        """Train; an outcome is interrupted where it was stopped before ``until``.

        Raises:
            DataError: the folder is not on this machine, or a checkpoint is damaged.
            ConfigurationError: the configuration does not fit its algorithm.
        """
        if not self.path.parent.is_dir():
            raise DataError(
                f"{self.path.parent} is not there on {platform.node()}; "
                "with a cluster, --out must be on a disk that all machines share"
            )
        try:
            return self._train(report)
        except MotionCueingError:
            raise
        except Exception:
            write_text(self.path / _TRACE, traceback.format_exc())
            raise

    def _train(self, report: Report) -> Outcome:
        asked = Interrupt()

        def tell(status: Status) -> None:
            asked.asked = report(status) or asked.asked or self._paused(status)

        run = RunFolder.take_up(self.path, self.config)
        if self.parent is not None and not checkpoints_in(run.checkpoints):
            inherit(run, RunFolder(self.parent, self.config))
        outcome = Training(run, tell, asked).train()
        return Outcome(outcome.status, outcome.interrupted and not self._paused(outcome.status))

    def _paused(self, status: Status) -> bool:
        return self.until is not None and status.steps >= self.until


def inherit(run: RunFolder, parent: RunFolder) -> None:
    """Begin a folder with another's log, best agent and, last of all, checkpoint."""
    (*_, last) = checkpoints_in(parent.checkpoints)
    for path in (parent.path / LOG, parent.best_agent, last):
        if path.exists():
            copy_file(path, run.path / path.relative_to(parent.path))


# A trial of a search as a job of an engine.


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
