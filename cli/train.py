"""``motion-cueing train``: train an agent or several, go on with them, or search for hyperparameters."""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from tyro.conf import arg

from ..envs.errors import ConfigurationError, UnknownNameError
from ..train.config import TrainingConfig, load_config
from ..train.registry import algorithm_names

if TYPE_CHECKING:
    from ..train.experiments.population import Population
    from ..train.experiments.search import Search
    from ..train.experiments.seeds import Seeds
    from ..train.run import RunFolder

_LOCAL: Final = "local"
_RAY: Final = "ray"
_SEVERAL: Final = ("search", "seeds", "population")
"""Options that ask for several trainings."""
_NEEDED: Final = ("torch", "stable_baselines3", "sb3_contrib", "tensorboard", "optuna", "safetensors")


@dataclass(frozen=True)
class TrainCommand:
    """Train an agent on random drives.

    Ctrl-C stops after the update at hand and leaves a checkpoint; a second one stops at once.
    """

    algo: Annotated[str | None, arg(metavar="|".join(algorithm_names()))] = None
    """Algorithm; its default configuration is what the other arguments change."""
    config: Annotated[Path | None, arg(metavar="FILE.yaml|NAME")] = None
    """Configuration: only what differs from the algorithm's default; or the name of a shipped agent's."""
    initial: Annotated[Path | None, arg(metavar="FILE.safetensors")] = None
    """Agent to go on from, with the same observation and action."""
    steps: Annotated[int | None, arg(metavar="N")] = None
    """Actions in all, over all environments; default: as the configuration says, like the next two."""
    seed: Annotated[int | None, arg(metavar="S")] = None
    """Of everything that is drawn."""
    envs: Annotated[int | None, arg(metavar="N")] = None
    """Environments stepped together."""
    out: Annotated[Path | None, arg(metavar="DIR")] = None
    """New folder for everything that comes of it; default: runs/ALGO-1 and so on."""
    resume: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder of a training, seeds or a population to go on with, from the last checkpoints; --steps may
    change how long it is, but for a population. Or of a search, to go on with --search."""
    search: Annotated[int | None, arg(metavar="N")] = None
    """Search for hyperparameters instead, until N trainings are done; the field `search` of the configuration
    says what is varied, --steps how long each is."""
    seeds: Annotated[int | None, arg(metavar="N")] = None
    """Train with N seeds: --seed and those that follow."""
    population: Annotated[int | None, arg(metavar="N")] = None
    """Train a population of N: the worst go on from the best, with other values of what the field `search`
    names; the field `population` says how."""
    jobs: Annotated[int | None, arg(metavar="N")] = None
    """Trainings at a time, each in a process of its own; default: 1, with Ray one a core."""
    engine: Annotated[str | None, arg(metavar="local|ray")] = None
    """Where trainings run: this machine alone, or Ray; default: local."""
    address: Annotated[str | None, arg(metavar="HOST:PORT")] = None
    """Ray cluster to run on, which this machine is a part of; default: a Ray of its own on this machine."""


def run(command: TrainCommand) -> int:
    """Train.

    Raises:
        MotionCueingError: an argument, a file or a hyperparameter is wrong, or a package is missing.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"training needs {', '.join(missing)}: pip install 'motion-cueing-gym[train]'"
        )
    _check(command)
    kind = _kind(command)
    if kind == "training" and command.engine != _RAY:
        return _train(command)
    return _run(command, kind)


def _check(command: TrainCommand) -> None:
    for name in (*_SEVERAL, "jobs"):
        value = getattr(command, name)
        if value is not None and value < 1:
            raise ConfigurationError(f"--{name} must be at least 1, found {value}")
    named = [name for name in _SEVERAL if getattr(command, name) is not None]
    if len(named) > 1:
        raise ConfigurationError(f"--{named[0]} and --{named[1]} do not go together; leave one out")
    if command.engine not in (None, _LOCAL, _RAY):
        raise UnknownNameError("engine", command.engine, (_LOCAL, _RAY))
    if command.address is not None and command.engine != _RAY:
        raise ConfigurationError("--address is of use only with --engine ray; leave it out")
    if command.resume is not None:
        _check_resume(command)


def _check_resume(command: TrainCommand) -> None:
    kept = {"resume", "jobs", "engine", "address", "steps" if command.search is None else "search"}
    for option in fields(command):
        if option.name not in kept and getattr(command, option.name) is not None:
            raise ConfigurationError(f"--{option.name} cannot be changed with --resume; leave it out")


def _kind(command: TrainCommand) -> str:
    """What is trained; with ``--resume``, the folder says it.

    Raises:
        ConfigurationError: an option is of no use there.
    """
    kind = next((name for name in _SEVERAL if getattr(command, name) is not None), None)
    if kind is None and command.resume is not None:
        from ..train.experiments.seeds import kind_of

        kind = kind_of(command.resume)
    if kind is None and command.jobs is not None:
        raise ConfigurationError("--jobs is of use only where there are several trainings; leave it out")
    if kind == "population" and command.resume is not None and command.steps is not None:
        raise ConfigurationError("--steps of a population cannot be changed with --resume; leave it out")
    return kind or "training"


def _config(command: TrainCommand) -> TrainingConfig:
    return load_config(
        command.algo,
        command.config,
        steps=command.steps,
        seed=command.seed,
        n_envs=command.envs,
        initial=None if command.initial is None else str(command.initial),
        population=None if command.population is None else {"members": command.population},
    )


def _folder(command: TrainCommand) -> RunFolder:
    from ..train.run import RunFolder

    if command.resume is None:
        return RunFolder.create(command.out, _config(command))
    folder = RunFolder.open(command.resume)
    if command.steps is not None:
        folder.extend(command.steps)
    for change in folder.changed_versions():
        print(f"note: {change}; the agent may differ in its last bits", file=sys.stderr)
    return folder


def _train(command: TrainCommand) -> int:
    from ..train.experiments.seeds import report_training
    from ..train.progress import TrainingProgress
    from ..train.training import Training

    folder = _folder(command)
    with TrainingProgress(folder.config.steps) as progress:
        outcome = Training(folder, progress.tell).train()
    return report_training(folder, outcome)


def _run(command: TrainCommand, kind: str) -> int:
    """What an engine runs."""
    from ..train.experiments import seeds as studies

    place = studies.Place(command.engine or _LOCAL, command.jobs, command.address)
    place.check()
    if kind == "training":
        return studies.run_training(_folder(command), place)
    if kind == "search":
        return studies.run_search(_search(command), command.search or 1, place)
    if kind == "seeds":
        return studies.run_seeds(_seeds(command), place)
    return studies.run_population(_population(command), place)


def _search(command: TrainCommand) -> Search:
    from ..train.experiments.search import Search

    if command.resume is None:
        return Search.create(command.out, _config(command))
    return Search.open(command.resume)


def _seeds(command: TrainCommand) -> Seeds:
    from ..train.experiments.seeds import Seeds

    if command.resume is None:
        return Seeds.create(command.out, _config(command), command.seeds or 1)
    return Seeds.open(command.resume, command.steps)


def _population(command: TrainCommand) -> Population:
    from ..train.experiments.population import Population

    if command.resume is None:
        return Population.create(command.out, _config(command))
    return Population.open(command.resume)
