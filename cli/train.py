"""``motion-cueing train``: train an agent, or one with each of several seeds."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from ..envs.errors import ConfigurationError
from .arguments import several
from .training import TrainingOptions, check, check_same, goes_on, new_config, place

if TYPE_CHECKING:
    from ..train.experiments.seeds import Seeds
    from ..train.run import RunFolder


@dataclass(frozen=True, kw_only=True)
class TrainCommand(TrainingOptions):
    """Train an agent on random drives.

    Ctrl-C stops after the update at hand and leaves a checkpoint; a second one stops at once. The same
    command goes on from the last checkpoint in --out; another --steps makes it longer.
    """

    seeds: Annotated[tuple[int, ...], several("SEED ...")] = ()
    """Train with each of these seeds, which follow each other, such as 0 1 2 3."""


def run(command: TrainCommand) -> int:
    """Train.

    Raises:
        MotionCueingError: an argument, a file or a hyperparameter is wrong, or a package is missing.
    """
    from ..train.experiments import seeds as studies

    check(command)
    if command.seeds or (command.out is not None and studies.is_seeds(command.out)):
        return studies.run_seeds(_seeds(command), place(command))
    if command.engine == "ray":
        where = place(command)
        return studies.run_training(_folder(command), where)
    if command.workers is not None:
        raise ConfigurationError("--workers is of use only where there are several trainings; leave it out")
    return _train(command)


def _train(command: TrainCommand) -> int:
    from ..train.experiments.seeds import report_training
    from ..train.progress import TrainingProgress
    from ..train.training import Training

    folder = _folder(command)
    with TrainingProgress(folder.config.steps) as progress:
        outcome = Training(folder, progress.tell).train()
    return report_training(folder, outcome)


def _folder(command: TrainCommand) -> RunFolder:
    from ..train.run import RunFolder

    if command.out is None or not goes_on(command, "training"):
        return RunFolder.create(command.out, new_config(command))
    folder = RunFolder.open(command.out)
    check_same(command, folder.config)
    if command.steps is not None:
        folder.extend(command.steps)
    for change in folder.changed_versions():
        print(f"note: {change}; the agent may differ in its last bits", file=sys.stderr)
    return folder


def _seeds(command: TrainCommand) -> Seeds:
    from dataclasses import replace

    from ..train.experiments.seeds import Seeds

    seeds = command.seeds
    if seeds and (len(seeds) < 2 or seeds != tuple(range(seeds[0], seeds[0] + len(seeds)))):
        raise ConfigurationError(
            "--seeds names seeds that follow each other, such as 0 1 2 3, found "
            f"{' '.join(map(str, seeds))}; --seed is for one"
        )
    if seeds and command.seed is not None:
        raise ConfigurationError("--seed and --seeds do not go together; leave --seed out")
    first = replace(command, seed=seeds[0]) if seeds else command
    if command.out is None or not goes_on(command, "seeds"):
        return Seeds.create(command.out, new_config(first), len(seeds))
    begun = Seeds.open(command.out).plan
    check_same(first, begun.config)
    if seeds and len(seeds) != begun.count:
        raise ConfigurationError(
            f"--seeds: {command.out} was begun with {begun.count} seeds; leave it out, or name another --out"
        )
    return Seeds.open(command.out, command.steps)
