"""``motion-cueing train``, ``search`` and ``population``: trainings of agents, one or many."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass, fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from ..envs.errors import ConfigurationError, DataError
from ..envs.storage import check_folder
from .arguments import Fresh, Whole, Workers, named, option, several

if TYPE_CHECKING:
    from ..train.config import TrainingConfig
    from ..train.experiments.seeds import Place, Seeds
    from ..train.run import RunFolder

_NEEDED: Final = ("torch", "stable_baselines3", "sb3_contrib", "tensorboard", "optuna", "safetensors")
_FIXED: Final = {"algorithm": "algo", "seed": "seed", "envs": "n_envs", "initial": "initial"}
"""Options that a training keeps to its end, and their fields in its configuration."""
_ELSE: Final = "leave it out, name another --out, or add --fresh to begin anew"
_FOR_A_PLATFORM: Final = Path("for-platform")
"""Recipe of agents for one motion base."""


@dataclass(frozen=True, kw_only=True)
class TrainingOptions:
    """Options of every command that trains."""

    algorithm: Annotated[
        str | None, option("NAME", alias="--algo", completer=named("Training algorithms"))
    ] = None
    """Algorithm, of those that `motion-cueing list` names; the other options change its default
    configuration. `predict` trains a predictor of the cues ahead, for `evaluate --preview predicted`."""
    config: Annotated[Path | None, option("FILE.yaml|NAME")] = None
    """Configuration: only what differs from the algorithm's default; or the name of a shipped agent's."""
    platform: Annotated[
        str | None, option("NAME|FILE.yaml", alias="--for", completer=named("Motion bases"))
    ] = None
    """Motion base that the agent is for, by name or file. Without --config an agent for any motion base,
    without preview, is trained on for this one: some ten minutes of one core."""
    initial: Annotated[str | None, option("NAME|FILE.safetensors")] = None
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


@dataclass(frozen=True, kw_only=True)
class TrainCommand(TrainingOptions):
    """Train an agent on random drives.

    Ctrl-C stops after the update at hand and leaves a checkpoint; a second one stops at once. The same
    command goes on from the last checkpoint in --out; another --steps makes it longer.
    """

    seeds: Annotated[tuple[int, ...], several("SEED ...")] = ()
    """Train with each of these seeds, which follow each other, such as 0 1 2 3."""


@dataclass(frozen=True, kw_only=True)
class SearchCommand(TrainingOptions):
    """Search for an algorithm's best hyperparameters.

    The field `search` of the configuration says what is varied, --steps how long each training is. Hopeless
    trainings are broken off early. The same command goes on from what is in --out; another --trials makes it
    longer.
    """

    trials: Whole
    """Trainings in all."""


@dataclass(frozen=True, kw_only=True)
class PopulationCommand(TrainingOptions):
    """Train a population: the worst go on from the best, with other values of what is varied.

    The field `search` of the configuration says what is varied, the field `population` how. The same command
    goes on from what is in --out.
    """

    members: Whole | None = None
    """Trainings in the population; default: as the configuration says."""


def run(command: TrainCommand) -> int:
    """Train."""
    if command.algorithm == PREDICT:
        return _predict(command)
    from ..train.experiments import seeds as studies

    check(command)
    if command.seeds or (command.out is not None and studies.is_seeds(command.out)):
        seeds = _seeds(command)
        status = studies.run_seeds(seeds, place(command))
        return _with_curves(status, [job.path for job in seeds.jobs])
    if command.engine == "ray":
        where, folder = place(command), _folder(command)
        return _with_curves(studies.run_training(folder, where), [folder.path])
    if command.workers is not None:
        raise ConfigurationError("--workers is of use only where there are several trainings; leave it out")
    return _train(command)


PREDICT: Final = "predict"
"""Algorithm whose result is no agent but a predictor."""


def _predict(command: TrainCommand) -> int:
    """Train a predictor."""
    from ..evaluation.reporting.text import words_of
    from ..train.algorithms.predict.predict import load_predict_config, train_predictor

    check(command)
    useless = [
        name
        for name in ("initial", "steps", "envs", "workers", "address")
        if getattr(command, name) is not None
    ]
    if useless or command.seeds or command.engine != "local":
        raise ConfigurationError(
            f"--algo predict takes --config, --seed and --out alone; leave --{(useless or ['seeds'])[0]} out"
        )
    config = load_predict_config(command.config, seed=command.seed)
    out = command.out or Path("runs") / PREDICT
    if command.fresh and out.is_dir():
        shutil.rmtree(out)
    train_predictor(config, out, " ".join(words_of("train", command)))
    print(f"{out / 'predictor.safetensors'}: `motion-cueing predict` measures it")
    return 0


def _train(command: TrainCommand) -> int:
    from ..train.experiments.seeds import TrainingProgress, report_training
    from ..train.training import Training

    folder = _folder(command)
    with TrainingProgress(folder.config.steps) as progress:
        outcome = Training(folder, progress.tell).train()
    return _with_curves(report_training(folder, outcome), [folder.path])


def _with_curves(status: int, folders: list[Path]) -> int:
    """Draw what was learned in each folder, and say where, unless the trainings were stopped."""
    from .curves import draw_learning

    if status == 0:
        for folder in folders:
            print(f"{draw_learning(folder)}: J over the actions")
    return status


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


def run_search(command: SearchCommand) -> int:
    """Search."""
    from ..train.experiments.search import Search
    from ..train.experiments.seeds import run_search as search_with

    check(command)
    where = place(command)
    if command.out is None or not goes_on(command, "search"):
        return search_with(Search.create(command.out, new_config(command)), command.trials, where)
    search = Search.open(command.out)
    if command.steps not in (None, search.config.steps):
        raise ConfigurationError(
            f"--steps {command.steps}: {command.out} was begun with {search.config.steps}; leave it out, or "
            "name another --out"
        )
    check_same(replace(command, steps=None), search.config)
    return search_with(search, command.trials, where)


def run_population(command: PopulationCommand) -> int:
    """Train."""
    from ..train.experiments.population import Population
    from ..train.experiments.seeds import run_population as train_with

    check(command)
    where = place(command)
    if command.out is None or not goes_on(command, "population"):
        members = None if command.members is None else {"members": command.members}
        return train_with(Population.create(command.out, new_config(command, population=members)), where)
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
    return train_with(population, where)


def check_installed() -> None:
    """Refuse to go on without the libraries of trainings."""
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigurationError(
            f"training needs {', '.join(missing)}: pip install 'motion-cueing-gym[train]'"
        )


def check(command: TrainingOptions) -> None:
    """Refuse options that do not go together."""
    check_installed()
    for name in ("workers", "trials", "members"):
        value = getattr(command, name, None)
        if value is not None and value < 1:
            raise ConfigurationError(f"--{name} must be at least 1, found {value}")
    if command.address is not None and command.engine != "ray":
        raise ConfigurationError("--address is of use only with --engine ray; leave it out")


def place(command: TrainingOptions) -> Place:
    """Where trainings run, checked before anything is written."""
    from ..train.experiments.seeds import Place

    place = Place(command.engine, command.workers, command.address)
    place.check()
    return place


def new_config(command: TrainingOptions, **others: Any) -> TrainingConfig:
    """The configuration of a new training.

    Args:
        command: The options.
        **others: Further fields of it.
    """
    from ..train.config import load_config

    return load_config(
        command.algorithm,
        _config(command),
        steps=command.steps,
        seed=command.seed,
        n_envs=command.envs,
        initial=command.initial,
        task=_task(command),
        **others,
    )


def _config(command: TrainingOptions) -> Path | None:
    """The file or recipe; for a motion base alone that of agents for one motion base."""
    if command.platform is not None and command.config is None and command.algorithm is None:
        return _FOR_A_PLATFORM
    return command.config


def _task(command: TrainingOptions) -> dict[str, str] | None:
    return None if command.platform is None else {"platform": command.platform}


def goes_on(command: TrainingOptions, kind: str) -> bool:
    """Whether --out holds work of this kind to go on from; with --fresh, that is removed first.

    Args:
        command: The options.
        kind: "training", "seeds", "search" or "population".
    """
    out = command.out
    if out is None or not out.is_dir() or not any(out.iterdir()):
        return False
    from ..train.experiments.seeds import kind_of

    begun = kind_of(out)
    if begun is None:
        raise DataError(
            f"--out {out}: there is something already that no training wrote; name another folder"
        )
    if begun != kind:
        raise DataError(
            f"--out {out} holds a {begun}; {_COMMAND[begun]} goes on with it; or name another folder"
        )
    # Not while another process trains there.
    check_folder("--out", out)
    if command.fresh:
        shutil.rmtree(out)
    return not command.fresh


_COMMAND: Final = {
    "training": "`motion-cueing train` without --seeds",
    "seeds": "`motion-cueing train`",
    "search": "`motion-cueing search`",
    "population": "`motion-cueing population`",
}


def check_same(command: TrainingOptions, begun: TrainingConfig) -> None:
    """Refuse options that differ from those that the training in --out was begun with; --steps may."""
    from ..envs.settings import to_dict
    from ..train.config import load_config

    for flag, name in _FIXED.items():
        given, was = getattr(command, flag), getattr(begun, name)
        if given is not None and str(given) != str(was):
            raise ConfigurationError(f"--{flag} {given}: {command.out} was begun with {was}; {_ELSE}")
    if command.config is None and command.platform is None:
        return
    fixed = {name: getattr(begun, name) for name in ("steps", "seed", "n_envs", "initial")}
    fixed["population"] = to_dict(begun.population)
    given = load_config(command.algorithm, _config(command), task=_task(command), **fixed)
    other = [
        field.name for field in fields(begun) if getattr(given, field.name) != getattr(begun, field.name)
    ]
    if other:
        flag = f"--for {command.platform}" if command.config is None else f"--config {command.config}"
        raise ConfigurationError(f"{flag}: {command.out} was begun with another {', '.join(other)}; {_ELSE}")
