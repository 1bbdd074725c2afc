"""``motion-cueing search``: many short trainings, to find the best hyperparameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..envs.errors import ConfigurationError
from .arguments import Whole
from .training import TrainingOptions, check, check_same, goes_on, new_config, place


@dataclass(frozen=True, kw_only=True)
class SearchCommand(TrainingOptions):
    """Search for an algorithm's best hyperparameters.

    The field `search` of the configuration says what is varied, --steps how long each training is. Hopeless
    trainings are broken off early. The same command goes on from what is in --out; another --trials makes it
    longer.
    """

    trials: Whole
    """Trainings in all."""


def run(command: SearchCommand) -> int:
    """Search.

    Raises:
        MotionCueingError: an argument, a file or a hyperparameter is wrong, or a package is missing.
    """
    from ..train.experiments.search import Search
    from ..train.experiments.seeds import run_search

    check(command)
    where = place(command)
    if command.out is None or not goes_on(command, "search"):
        return run_search(Search.create(command.out, new_config(command)), command.trials, where)
    search = Search.open(command.out)
    if command.steps not in (None, search.config.steps):
        raise ConfigurationError(
            f"--steps {command.steps}: {command.out} was begun with {search.config.steps}; leave it out, or "
            "name another --out"
        )
    check_same(replace(command, steps=None), search.config)
    return run_search(search, command.trials, where)
