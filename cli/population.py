"""``motion-cueing population``: population based training."""

from __future__ import annotations

from dataclasses import dataclass

from ..envs.errors import ConfigurationError
from .arguments import Whole
from .training import TrainingOptions, check, check_same, goes_on, new_config, place


@dataclass(frozen=True, kw_only=True)
class PopulationCommand(TrainingOptions):
    """Train a population: the worst go on from the best, with other values of what is varied.

    The field `search` of the configuration says what is varied, the field `population` how. The same command
    goes on from what is in --out.
    """

    members: Whole | None = None
    """Trainings in the population; default: as the configuration says."""


def run(command: PopulationCommand) -> int:
    """Train.

    Raises:
        MotionCueingError: an argument, a file or a hyperparameter is wrong, or a package is missing.
    """
    from ..train.experiments.population import Population
    from ..train.experiments.seeds import run_population

    check(command)
    where = place(command)
    if command.out is None or not goes_on(command, "population"):
        members = None if command.members is None else {"members": command.members}
        return run_population(Population.create(command.out, new_config(command, population=members)), where)
    population = Population.open(command.out)
    begun = population.config
    for name, given, was in (
        ("steps", command.steps, begun.steps),
        ("members", command.members, begun.population.members),
    ):
        if given not in (None, was):
            raise ConfigurationError(
                f"--{name} {given}: {command.out} was begun with {was}; leave it out, or name another --out"
            )
    check_same(command, begun)
    return run_population(population, where)
