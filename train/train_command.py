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

    algo: Annotated[str | None, arg(metavar="ppo|sac|td3|tqc")] = None
    """Algorithm; its default configuration is what the other arguments change."""
    config: Annotated[Path | None, arg(metavar="FILE.yaml")] = None
    """Configuration: only what differs from the algorithm's default."""
    steps: Annotated[int | None, arg(metavar="N")] = None
    """Actions in all, over all environments."""
    seed: Annotated[int | None, arg(metavar="S")] = None
    """Of everything that is drawn."""
    envs: Annotated[int | None, arg(metavar="N")] = None
    """Environments stepped together."""
    out: Annotated[Path | None, arg(metavar="DIR")] = None
    """New folder for everything that comes of it; default: runs/ALGO-1 and so on."""
    resume: Annotated[Path | None, arg(metavar="DIR")] = None
    """Folder of a training to go on with, from its last checkpoint; --steps may change its length."""


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
    from .progress import TrainingProgress
    from .training import Training

    folder = _folder(command)
    with TrainingProgress(folder.config.steps) as progress:
        outcome = Training(folder, progress.tell).train()
    return _report(folder, outcome)


def _folder(command: TrainCommand) -> RunFolder:
    from .run import RunFolder

    if command.resume is None:
        return RunFolder.create(command.out, _config(command))
    kept = ("resume", "steps")
    for option in fields(command):
        if option.name not in kept and getattr(command, option.name) is not None:
            raise ConfigurationError(f"--{option.name} cannot be changed with --resume; leave it out")
    folder = RunFolder.open(command.resume)
    if command.steps is not None and command.steps != folder.config.steps:
        folder.extend(command.steps)
    return folder


def _config(command: TrainCommand) -> TrainingConfig:
    return load_config(
        command.algo, command.config, steps=command.steps, seed=command.seed, n_envs=command.envs
    )


def _report(folder: RunFolder, outcome: Outcome) -> int:
    steps = outcome.status.steps
    if outcome.interrupted:
        print(
            f"stopped after {steps:,} steps; go on with: motion-cueing train --resume {folder.path}",
            file=sys.stderr,
        )
        return _INTERRUPTED
    print(f"{folder.final_agent}: the agent after {steps:,} steps")
    if folder.best_agent.exists():
        print(f"{folder.best_agent}: the best on the validation drives")
    return _SUCCESS
