"""What the commands that train have in common: options, configuration, and going on from a folder."""

# Annotations are objects here: those of a base class are looked up in the modules of the commands otherwise.
import shutil
from collections.abc import Callable
from dataclasses import dataclass, fields
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from ..envs.errors import ConfigurationError, DataError
from .arguments import Fresh, Whole, Workers, option

if TYPE_CHECKING:
    from ..train.config import TrainingConfig
    from ..train.experiments.seeds import Place

_NEEDED: Final = ("torch", "stable_baselines3", "sb3_contrib", "tensorboard", "optuna", "safetensors")
_HELD: Final = {"algorithm": "algo", "seed": "seed", "envs": "n_envs", "initial": "initial"}
"""Options that a training keeps to its end, and their fields in its configuration."""


@dataclass(frozen=True, kw_only=True)
class TrainingOptions:
    """Options of every command that trains."""

    algorithm: Annotated[str | None, option("NAME", alias="--algo")] = None
    """Algorithm, of those that `motion-cueing list` names; the other options change its default
    configuration."""
    config: Annotated[Path | None, option("FILE.yaml|NAME")] = None
    """Configuration: only what differs from the algorithm's default; or the name of a shipped agent's."""
    initial: Annotated[Path | None, option("FILE.safetensors")] = None
    """Agent whose network the training begins with, with the same observation and action."""
    steps: Whole | None = None
    """Actions in all, over all environments, such as 1e6; default: as the configuration says, like the next
    two."""
    seed: Whole | None = None
    """Of everything that is drawn."""
    envs: Whole | None = None
    """Environments stepped together."""
    out: Annotated[Path | None, option("DIR")] = None
    """Folder for everything that comes of it; the command goes on from what is in it. Default: a new folder,
    runs/ALGORITHM-1 and so on."""
    fresh: Fresh = False
    workers: Workers | None = None
    """Trainings at a time, each in a process of its own; default: 1, with Ray one a core."""
    engine: Literal["local", "ray"] = "local"
    """Where trainings run: this machine alone, or Ray."""
    address: Annotated[str | None, option("HOST:PORT")] = None
    """Ray cluster to run on, which this machine is a part of; default: a Ray of its own on this machine."""


def check(command: TrainingOptions) -> None:
    """Refuse options that do not go together.

    Raises:
        ConfigurationError: an option is wrong, or a package is missing.
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"training needs {', '.join(missing)}: pip install 'motion-cueing-gym[train]'"
        )
    for name in ("workers", "trials", "members"):
        value = getattr(command, name, None)
        if value is not None and value < 1:
            raise ConfigurationError(f"--{name} must be at least 1, found {value}")
    if command.address is not None and command.engine != "ray":
        raise ConfigurationError("--address is of use only with --engine ray; leave it out")


def place(command: TrainingOptions) -> "Place":
    """Where trainings run, checked before anything is written.

    Raises:
        ConfigurationError: a package is missing.
    """
    from ..train.experiments.seeds import Place

    found = Place(command.engine, command.workers, command.address)
    found.check()
    return found


def new_config(command: TrainingOptions, **others: Any) -> "TrainingConfig":
    """The configuration of a new training.

    Args:
        command: The options.
        **others: Further fields of it.
    """
    from ..train.config import load_config

    return load_config(
        command.algorithm,
        command.config,
        steps=command.steps,
        seed=command.seed,
        n_envs=command.envs,
        initial=None if command.initial is None else str(command.initial),
        **others,
    )


def goes_on(command: TrainingOptions, kind: str) -> bool:
    """Whether --out holds work of this kind to go on from; with --fresh, that is removed first.

    Args:
        command: The options.
        kind: "training", "seeds", "search" or "population".

    Raises:
        DataError: the folder holds something else.
    """
    out = command.out
    if out is None or not out.is_dir() or not any(out.iterdir()):
        return False
    found = _kind_of(out)
    if found is None:
        raise DataError(
            f"--out {out}: there is something already that no training wrote; name another folder"
        )
    if found != kind:
        raise DataError(
            f"--out {out} holds a {found}; {_COMMAND[found]} goes on with it; or name another folder"
        )
    if command.fresh:
        shutil.rmtree(out)
    return not command.fresh


_COMMAND: Final = {
    "training": "`motion-cueing train` without --seeds",
    "seeds": "`motion-cueing train`",
    "search": "`motion-cueing search`",
    "population": "`motion-cueing population`",
}


def _kind_of(folder: Path) -> str | None:
    """What was begun in a folder; None where nothing was."""
    from ..train.experiments.population import is_population
    from ..train.experiments.search import is_search
    from ..train.experiments.seeds import is_seeds

    kinds: dict[str, Callable[[Path], bool]] = {
        "search": is_search,
        "seeds": is_seeds,
        "population": is_population,
        "training": lambda path: (path / "config.yaml").exists(),
    }
    return next((kind for kind, holds in kinds.items() if holds(folder)), None)


def check_same(command: TrainingOptions, begun: "TrainingConfig") -> None:
    """Refuse options that differ from those that the training in --out was begun with; --steps may.

    Raises:
        ConfigurationError: one does.
    """
    from ..envs.settings import to_dict
    from ..train.config import load_config

    for flag, name in _HELD.items():
        given, was = getattr(command, flag), getattr(begun, name)
        if given is not None and str(given) != str(was):
            raise ConfigurationError(f"--{flag} {given}: {command.out} was begun with {was}; {_ELSE}")
    if command.config is None:
        return
    held = {name: getattr(begun, name) for name in ("steps", "seed", "n_envs", "initial", "population")}
    held["population"] = to_dict(begun.population)
    wanted = load_config(command.algorithm, command.config, **held)
    other = [
        field.name for field in fields(begun) if getattr(wanted, field.name) != getattr(begun, field.name)
    ]
    if other:
        raise ConfigurationError(
            f"--config {command.config}: {command.out} was begun with another {', '.join(other)}; {_ELSE}"
        )


_ELSE: Final = "leave it out, name another --out, or add --fresh to begin anew"
