"""Hyperparameter search: many short trainings, drawn by Optuna's TPE; the hopeless ones are pruned.

A search varies fields of a configuration by their path, as ``hyperparameters.learning_rate``; so do
populations. Its folder holds Optuna's journal, a folder for each trial, a table, and the best configuration.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState

from ...envs.errors import ConfigurationError, DataError
from ...envs.settings import from_dict, load, save, to_dict
from ..config import Choice, TrainingConfig
from ..run import free_folder
from ..training import Status, rating
from .engine import Ending, Engine, Job, Listener
from .job import TrainingJob, write_table

JOURNAL: Final = "search.journal"
"""File with all trials, beside their folder."""

_STUDY: Final = "training"
_TRIALS: Final = "trials"
_CONFIG: Final = "config.yaml"
_TABLE: Final = "results.csv"
_BEST: Final = "best.yaml"
_FINISHED: Final = (TrialState.COMPLETE, TrialState.PRUNED)


def varied(config: TrainingConfig, values: Mapping[str, Any], **fields: Any) -> TrainingConfig:
    """A configuration with other values, that varies nothing any more.

    Args:
        config: What is common.
        values: By path, as ``hyperparameters.learning_rate``.
        **fields: Other fields of the configuration.

    Raises:
        ConfigurationError: a path is unknown, or a value wrong there.
    """
    fields_of_trial = to_dict(replace(config, search={}, **fields))
    for path, value in values.items():
        _set(fields_of_trial, path, value)
    return from_dict(TrainingConfig, fields_of_trial, "search")


def check_space(config: TrainingConfig) -> None:
    """Refuse a space with nothing in it, or whose ends are no configurations."""
    if not config.search:
        raise ConfigurationError("search is empty; name fields to vary, as hyperparameters.learning_rate")
    for end in (first, last):
        varied(config, {path: end(choice) for path, choice in config.search.items()})


def first(choice: Choice) -> Any:
    """The first or smallest value."""
    return choice.choices[0] if choice.choices else _number(choice, choice.low or 0.0)


def last(choice: Choice) -> Any:
    """The last or largest value."""
    return choice.choices[-1] if choice.choices else _number(choice, choice.high or 0.0)


def _number(choice: Choice, value: float) -> float | int:
    return int(value) if choice.integer else value


def _set(values: dict[str, Any], path: str, value: Any) -> None:
    """Set a field by its path."""
    *parents, last_name = path.split(".")
    for name in parents:
        inner = values.setdefault(name, {})
        if not isinstance(inner, dict):
            raise ConfigurationError(f"search: {path!r} leads through {name!r}, which has no fields")
        values = inner
    values[last_name] = value


class Search:
    """A search in its folder; finished trials count.

    Args:
        path: The folder.
        config: What every training has in common; ``search`` says what they differ in.

    Raises:
        ConfigurationError: there is nothing to search, or a field cannot be set so.
    """

    def __init__(self, path: Path, config: TrainingConfig) -> None:
        self.path, self.config = path, config
        check_space(config)

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig) -> Search:
        """A new search."""
        search = cls(free_folder(path, f"{config.algo}-search"), config)
        save(config, search.path / _CONFIG)
        (search.path / _TRIALS).mkdir(exist_ok=True)
        search._study(optuna.create_study)
        return search

    @classmethod
    def open(cls, path: Path) -> Search:
        """A search that was begun."""
        if not is_search(path):
            raise DataError(f"--out {path}: no search was begun there ({JOURNAL} is missing)")
        return cls(path, load(TrainingConfig, path / _CONFIG))

    def study(self) -> optuna.Study:
        """The study."""
        return self._study(optuna.load_study)

    def _study(self, make: Callable[..., optuna.Study]) -> optuna.Study:
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        storage = JournalStorage(JournalFileBackend(str(self.path / JOURNAL)))
        return make(
            storage=storage, study_name=_STUDY, pruner=optuna.pruners.MedianPruner(n_startup_trials=4)
        )

    def run(self, trials: int, engine: Engine, listener: Listener) -> bool:
        """Train until there are ``trials`` results; returns whether Ctrl-C stopped it.

        Trials of a session that ended in the middle of them go on.
        """
        session = _Session(self, trials, listener)
        try:
            return engine.run(session.next_job, session)
        finally:
            self.report()

    def job(self, trial: FrozenTrial | optuna.Trial) -> TrainingJob:
        """The training of a trial."""
        folder = self.path.resolve() / _TRIALS / f"{trial.number:04d}"
        return TrainingJob(f"trial {trial.number}", folder, self._config_with(self._values(trial.params)))

    def _values(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Values of a trial's parameters: of choices, Optuna holds the index."""
        return {
            name: self.config.search[name].choices[drawn] if self.config.search[name].choices else drawn
            for name, drawn in params.items()
        }

    def _config_with(self, values: Mapping[str, Any]) -> TrainingConfig:
        """A trial's configuration."""
        return varied(self.config, values, checkpoints=replace(self.config.checkpoints, keep=1))

    def report(self) -> None:
        """Write the table of all trials, and the configuration of the best."""
        trials = self._study(optuna.load_study).get_trials(deepcopy=False)
        names = list(self.config.search)
        rows: list[list[Any]] = [["trial", "state", "result", *names]]
        for trial in trials:
            result = "" if trial.value is None else f"{trial.value:.6g}"
            values = self._values(trial.params)
            row = [values.get(name, "") for name in names]
            rows.append([trial.number, trial.state.name.lower(), result, *row])
        write_table(self.path / _TABLE, rows)
        best = self.best()
        if best is not None:
            config = self._config_with(self._values(best.params))
            save(replace(config, checkpoints=self.config.checkpoints), self.path / _BEST)

    def best(self) -> Any:
        """The best trial, or None while there is none."""
        trials = self._study(optuna.load_study).get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
        return min(trials, key=lambda trial: float(trial.value or 0.0)) if trials else None

    @property
    def best_config(self) -> Path:
        """The best trial's configuration, for ``--config``."""
        return self.path / _BEST


class _Session:
    """Draws trials for an engine, prunes them, and notes their results."""

    def __init__(self, search: Search, trials: int, listener: Listener) -> None:
        self._search, self._listener = search, listener
        self._study = search.study()
        known = self._study.get_trials(deepcopy=False)
        done = sum(trial.state in _FINISHED for trial in known)
        self._left = max(0, trials - done)
        self._begun = [trial for trial in known if trial.state is TrialState.RUNNING]
        # A process that ended while one was drawn.
        for trial in [trial for trial in self._begun if len(trial.params) < len(search.config.search)]:
            self._study.tell(trial.number, state=TrialState.FAIL)
            self._begun.remove(trial)
        self._trials: dict[str, optuna.Trial] = {}
        self._pruned: set[str] = set()

    def next_job(self) -> TrainingJob | None:
        """The next trial's."""
        if self._left == 0:
            return None
        self._left -= 1
        if self._begun:
            trial = optuna.Trial(self._study, self._begun.pop(0)._trial_id)
        else:
            self._study.sampler = _sampler(
                self._search.config.seed, len(self._study.get_trials(deepcopy=False))
            )
            trial = self._study.ask()
            for name, choice in self._search.config.search.items():
                suggest(trial, name, choice)
        job = self._search.job(trial)
        self._trials[job.name] = trial
        return job

    def update(self, job: Job, status: Status) -> bool:
        """Pass on where a trial is; returns whether it is hopeless."""
        self._listener.update(job, status)
        trial, options = self._trials[job.name], job.config.validation
        if status.score is not None and status.news and status.steps >= options.every:
            trial.report(rating(status.score, options.best), status.steps // options.every)
            if status.steps < status.total and trial.should_prune():
                self._pruned.add(job.name)
        return job.name in self._pruned

    def ended(self, job: Job, ending: Ending) -> None:
        """Note a result; a trial that Ctrl-C stopped stays begun."""
        assert isinstance(job, TrainingJob)
        self._listener.ended(job, ending)
        number, error = self._trials[job.name].number, ending.error
        stopped = error is None and ending.result.interrupted
        if stopped and job.name not in self._pruned:
            return
        value = None if error is not None or stopped else ending.result.status.best
        if error is None and not stopped and not math.isfinite(math.nan if value is None else value):
            error = "no validation of it is finite"
        if error is not None:
            self._study.tell(number, state=TrialState.FAIL)
            print(f"{job.name}: failed ({error})", flush=True)
            return
        # Checkpoints are of no use any more.
        shutil.rmtree(job.path / "checkpoints", ignore_errors=True)
        self._study.tell(number, value, TrialState.PRUNED if stopped else TrialState.COMPLETE)
        print(f"{job.name}: {'broken off' if stopped else format(value, '.4g')}", flush=True)


def _sampler(seed: int, trial: int) -> optuna.samplers.TPESampler:
    """What draws a trial: seeded by its number, so that a search goes on as if it had not been stopped."""
    own = int(np.random.SeedSequence((seed, trial)).generate_state(1)[0])
    return optuna.samplers.TPESampler(seed=own, constant_liar=True)


def is_search(path: Path) -> bool:
    """Whether a folder is that of a search."""
    return (path / JOURNAL).exists()


def suggest(trial: optuna.Trial, name: str, choice: Choice) -> None:
    """Draw a field; of choices, the place is drawn."""
    if choice.choices:
        trial.suggest_categorical(name, range(len(choice.choices)))
    elif choice.integer:
        trial.suggest_int(name, int(choice.low or 0), int(choice.high or 0), log=choice.log)
    else:
        trial.suggest_float(name, choice.low or 0.0, choice.high or 0.0, log=choice.log)
