"""``motion-cueing train``: train an agent, go on with one, or search for hyperparameters."""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from tyro.conf import arg

from ..envs.errors import ConfigurationError
from .config import TrainingConfig, load_config
from .registry import algorithm_names

if TYPE_CHECKING:
    from .run import RunFolder
    from .training import Outcome

_INTERRUPTED: Final = 130
_SUCCESS: Final = 0
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
    """Folder of a training to go on with, from its last checkpoint; --steps may change its length. Or of a
    search, to go on with --search."""
    search: Annotated[int | None, arg(metavar="N")] = None
    """Search for hyperparameters instead, until N trainings are done; the field `search` of the configuration
    says what is varied, --steps how long each is."""
    jobs: Annotated[int | None, arg(metavar="N")] = None
    """Trainings of a search at a time, each in a process of its own; default: 1."""


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
    return _search(command) if command.search is not None else _train(command)


def _check(command: TrainCommand) -> None:
    if command.search is None and command.jobs is not None:
        raise ConfigurationError("--jobs is of use only with --search; leave it out")
    for name in ("search", "jobs"):
        value = getattr(command, name)
        if value is not None and value < 1:
            raise ConfigurationError(f"--{name} must be at least 1, found {value}")
    if command.resume is None:
        return
    kept = ("resume", "search", "jobs") if command.search is not None else ("resume", "steps")
    for option in fields(command):
        if option.name not in kept and getattr(command, option.name) is not None:
            raise ConfigurationError(f"--{option.name} cannot be changed with --resume; leave it out")


def _config(command: TrainCommand) -> TrainingConfig:
    return load_config(
        command.algo,
        command.config,
        steps=command.steps,
        seed=command.seed,
        n_envs=command.envs,
        initial=None if command.initial is None else str(command.initial),
    )


def _train(command: TrainCommand) -> int:
    from .progress import TrainingProgress
    from .run import RunFolder
    from .training import Training

    if command.resume is None:
        folder = RunFolder.create(command.out, _config(command))
    else:
        folder = RunFolder.open(command.resume)
        if command.steps is not None:
            folder.extend(command.steps)
        for change in folder.changed_versions():
            print(f"note: {change}; the agent may differ in its last bits", file=sys.stderr)
    with TrainingProgress(folder.config.steps) as progress:
        outcome = Training(folder, progress.tell).train()
    return _report(folder, outcome)


def _report(folder: RunFolder, outcome: Outcome) -> int:
    steps = outcome.status.steps
    if outcome.interrupted:
        _stopped(f"stopped after {steps:,} steps; go on with: motion-cueing train --resume {folder.path}")
        return _INTERRUPTED
    print(f"{folder.final_agent}: the agent after {steps:,} steps")
    if folder.best_agent.exists():
        print(f"{folder.best_agent}: the best on the validation drives")
    return _SUCCESS


def _search(command: TrainCommand) -> int:
    from .search import Search

    if command.resume is None:
        search = Search.create(command.out, _config(command))
    else:
        search = Search.open(command.resume)
    trials = command.search or 1
    interrupted = search.run(trials, command.jobs or 1)
    if interrupted:
        _stopped(f"stopped; go on with: motion-cueing train --resume {search.path} --search {trials}")
        return _INTERRUPTED
    best = search.best()
    if best is not None:
        print(f"{search.best_config}: trial {best.number}, {best.value:.4g}")
    return _SUCCESS


def _stopped(message: str) -> None:
    print(message, file=sys.stderr)
