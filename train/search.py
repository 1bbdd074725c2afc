"""A search for hyperparameters: many short trainings, the hopeless ones broken off early."""

from __future__ import annotations

import csv
import io
import multiprocessing
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState

from ..envs.errors import ConfigurationError, DataError
from ..envs.settings import from_dict, load, save, to_dict
from ..envs.storage import write_text
from .config import CheckpointOptions, Choice, TrainingConfig
from .run import RunFolder, free_folder
from .training import Status, Training, rating

_CONFIG: Final = "config.yaml"
_JOURNAL: Final = "search.journal"
_TABLE: Final = "results.csv"
_BEST: Final = "best.yaml"
_STUDY: Final = "training"
_FINISHED: Final = (TrialState.COMPLETE, TrialState.PRUNED)


class Search:
    """A search in its folder; what is there already counts.

    Args:
        path: The folder.
        config: What every training has in common; ``search`` says what they differ in.

    Raises:
        ConfigurationError: there is nothing to search, or a field cannot be set so.
    """

    def __init__(self, path: Path, config: TrainingConfig) -> None:
        self.path, self.config = path, config
        if not config.search:
            raise ConfigurationError("search is empty; name fields to vary, as hyperparameters.learning_rate")
        for choose in (_first, _last):
            self._config_with({name: choose(choice) for name, choice in config.search.items()})

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig) -> Search:
        """A new search.

        Raises:
            ConfigurationError: the folder is not empty, or there is nothing to search.
        """
        search = cls(free_folder(path, f"{config.algo}-search"), config)
        save(config, search.path / _CONFIG)
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        optuna.create_study(
            storage=search._storage(), study_name=_STUDY, direction="minimize", pruner=_pruner()
        )
        return search

    @classmethod
    def open(cls, path: Path) -> Search:
        """A search that was begun.

        Raises:
            DataError: there is none.
        """
        if not is_search(path):
            raise DataError(f"--resume {path}: no search was begun there ({_JOURNAL} is missing)")
        search = cls(path, load(TrainingConfig, path / _CONFIG))
        search._take_up_broken_off()
        return search

    def _storage(self) -> JournalStorage:
        return JournalStorage(JournalFileBackend(str(self.path / _JOURNAL)))

    def study(self, worker: int = 0) -> optuna.Study:
        """The study; each worker draws from a generator of its own, and none repeats an earlier session."""
        study = optuna.load_study(storage=self._storage(), study_name=_STUDY, pruner=_pruner())
        entropy = (self.config.seed, len(study.trials), worker)
        seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
        study.sampler = optuna.samplers.TPESampler(seed=seed, constant_liar=True)
        return study

    def _take_up_broken_off(self) -> None:
        """Trials of a session that ended without a word are tried again."""
        study = self.study()
        for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
            study.enqueue_trial(trial.params)
            study.tell(trial.number, state=TrialState.FAIL)

    def run(self, trials: int, jobs: int) -> bool:
        """Train until there are ``trials`` results; returns whether Ctrl-C stopped it."""
        done = len(self.study().get_trials(deepcopy=False, states=_FINISHED))
        context = multiprocessing.get_context("spawn")
        left = context.Value("i", max(0, trials - done))
        if jobs == 1:
            interrupted = _work(self.path, self.config, left, 0)
        else:
            arguments = [(self.path, self.config, left, worker) for worker in range(jobs)]
            workers = [context.Process(target=_work, args=given) for given in arguments]
            interrupted = _join(workers)
        self.report()
        return interrupted

    def try_one(self, study: optuna.Study) -> bool:
        """One training; returns whether Ctrl-C stopped it."""
        trial = study.ask()
        for name, choice in self.config.search.items():
            _suggest(trial, name, choice)
        try:
            value, state = self._train(trial), TrialState.COMPLETE
        except optuna.TrialPruned:
            value, state = None, TrialState.PRUNED
        except KeyboardInterrupt:
            study.enqueue_trial(trial.params)
            study.tell(trial, state=TrialState.FAIL)
            return True
        except Exception as error:
            # One that diverges, or whose values do not go together, must not end the search.
            study.tell(trial, state=TrialState.FAIL)
            print(f"trial {trial.number}: failed ({' '.join(str(error).split())})", flush=True)
            return False
        study.tell(trial, value, state)
        print(f"trial {trial.number}: {_result(value)}", flush=True)
        return False

    def _train(self, trial: optuna.Trial) -> float:
        config = self._config_with(self._values(trial.params))
        every = config.validation.every

        def tell(status: Status) -> None:
            if status.score is not None and status.news and status.steps >= every:
                trial.report(rating(status.score, config.validation.best), status.steps // every)
                if trial.should_prune() and status.steps < status.total:
                    raise optuna.TrialPruned

        folder = RunFolder.create(self.path / "trials" / f"{trial.number:04d}", config)
        outcome = Training(folder, tell).train()
        if outcome.interrupted or outcome.status.best is None:
            raise KeyboardInterrupt
        return outcome.status.best

    def _values(self, drawn: Mapping[str, Any]) -> dict[str, Any]:
        """Values of what was drawn: of choices, Optuna is only told the place."""
        return {
            name: self.config.search[name].choices[found] if self.config.search[name].choices else found
            for name, found in drawn.items()
        }

    def _config_with(self, params: Mapping[str, Any]) -> TrainingConfig:
        """A trial's configuration."""
        values = to_dict(replace(self.config, search={}, checkpoints=CheckpointOptions(every=0)))
        for name, value in params.items():
            _set(values, name, value)
        return from_dict(TrainingConfig, values, "search")

    def report(self) -> None:
        """Write the table of all trials, and the configuration of the best."""
        trials = self.study().get_trials(deepcopy=False)
        names = list(self.config.search)
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["trial", "state", "result", *names])
        for trial in trials:
            result = "" if trial.value is None else f"{trial.value:.6g}"
            values = self._values(trial.params)
            row = [values.get(name, "") for name in names]
            table.writerow([trial.number, trial.state.name.lower(), result, *row])
        write_text(self.path / _TABLE, text.getvalue())
        best = self.best()
        if best is not None:
            config = self._config_with(self._values(best.params))
            save(replace(config, checkpoints=self.config.checkpoints), self.path / _BEST)

    def best(self) -> Any:
        """The best trial, or None while there is none."""
        trials = self.study().get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
        return min(trials, key=lambda trial: float(trial.value or 0.0)) if trials else None

    @property
    def best_config(self) -> Path:
        """The best trial's configuration, for ``--config``."""
        return self.path / _BEST


def is_search(path: Path) -> bool:
    """Whether a folder is that of a search."""
    return (path / _JOURNAL).exists()


def _pruner() -> optuna.pruners.BasePruner:
    return optuna.pruners.MedianPruner(n_startup_trials=4)


def _work(path: Path, config: TrainingConfig, left: Any, worker: int) -> bool:
    """Take trials until none is left, in this process; returns whether Ctrl-C stopped it."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        search = Search(path, config)
        study = search.study(worker)
        while _take(left):
            if search.try_one(study):
                return True
    except KeyboardInterrupt:
        return True
    return False


def _take(left: Any) -> bool:
    with left.get_lock():
        left.value -= 1
        return bool(left.value >= 0)


def _join(workers: list[Any]) -> bool:
    """Run processes to their end; Ctrl-C reaches them, too, and ends them."""
    for worker in workers:
        worker.start()
    try:
        for worker in workers:
            worker.join()
    except KeyboardInterrupt:
        for worker in workers:
            worker.join()
        return True
    broken = [worker for worker in workers if worker.exitcode != 0]
    if broken:
        raise DataError(f"{len(broken)} of {len(workers)} processes of the search ended with an error")
    return False


def _suggest(trial: optuna.Trial, name: str, choice: Choice) -> None:
    if choice.choices:
        trial.suggest_categorical(name, range(len(choice.choices)))
    elif choice.integer:
        trial.suggest_int(name, int(choice.low or 0), int(choice.high or 0), log=choice.log)
    else:
        trial.suggest_float(name, choice.low or 0.0, choice.high or 0.0, log=choice.log)


def _first(choice: Choice) -> Any:
    return choice.choices[0] if choice.choices else int(choice.low or 0) if choice.integer else choice.low


def _last(choice: Choice) -> Any:
    return choice.choices[-1] if choice.choices else int(choice.high or 0) if choice.integer else choice.high


def _set(values: dict[str, Any], path: str, value: Any) -> None:
    """Set a field by its path.

    Raises:
        ConfigurationError: the path does not lead through fields.
    """
    *parents, last = path.split(".")
    for name in parents:
        inner = values.setdefault(name, {})
        if not isinstance(inner, dict):
            raise ConfigurationError(f"search: {path!r} leads through {name!r}, which has no fields")
        values = inner
    values[last] = value


def _result(value: float | None) -> str:
    return "broken off" if value is None else f"{value:.4g}"
