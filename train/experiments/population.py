"""Population based training: hyperparameters that change while a population is trained.

Jaderberg et al., "Population Based Training of Neural Networks", 2017, arXiv:1711.09846, in generations.
Truncation selection (section 4.1.1): the worst take over weights and values of the best. Exploration: values
are perturbed or drawn anew. Each member of a generation has a folder of its own, which starts from the last
checkpoint of its parent in the generation before. Nothing is written over, so that a population that was
stopped goes on to the same bits.
"""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...envs.errors import ConfigurationError, DataError
from ...envs.settings import load, save
from ...envs.storage import copy_file, write_text
from ..config import Choice, PopulationOptions, TrainingConfig
from ..run import RunFolder, free_folder
from ..training import rating
from .engine import Ending, Engine, Listener, run_jobs
from .job import TrainingJob, write_table
from .search import check_space, varied

Values = dict[str, Any]
"""What is varied, by path."""


@dataclass
class Member:
    """A member in one generation.

    Args:
        values: Its values, by path.
        parent: Member of the generation before that it goes on from; None in the first.
        rating: Of its last validation, lower is better; None until it is done.
        best: Rating of the best agent among its ancestors and itself.
    """

    values: Values
    parent: int | None = None
    rating: float | None = None
    best: float | None = None


def draw(space: Mapping[str, Choice], random: np.random.Generator) -> Values:
    """Values of a member at the start."""
    return {name: _drawn(choice, random) for name, choice in space.items()}


def next_generation(
    ratings: Sequence[float],
    values: Sequence[Values],
    space: Mapping[str, Choice],
    options: PopulationOptions,
    random: np.random.Generator,
) -> list[Member]:
    """Truncation selection and exploration: the members of the next generation.

    Args:
        ratings: Of each member, lower is better; one that is not finite is worst.
        values: Of each member.
        space: The choice of each field.
        options: Shares and factors.
        random: Of everything that is drawn.

    Returns:
        A successor for each member: itself with the same values or, of the worst, one of the best with
        others.
    """
    finite = [rating if math.isfinite(rating) else math.inf for rating in ratings]
    ranked = sorted(range(len(finite)), key=finite.__getitem__)
    count = max(1, int(options.replaced * len(ranked)))
    best, worst = ranked[:count], set(ranked[-count:])
    successors = []
    for member, own in enumerate(values):
        if member not in worst:
            successors.append(Member(dict(own), member))
            continue
        parent = int(random.choice(best))
        successors.append(Member(explored(values[parent], space, options, random), parent))
    return successors


def explored(
    values: Values, space: Mapping[str, Choice], options: PopulationOptions, random: np.random.Generator
) -> Values:
    """Values near others, or, with the probability ``options.redrawn``, any; each on its own."""
    return {
        name: _drawn(choice, random)
        if random.random() < options.redrawn
        else _near(values[name], choice, options, random)
        for name, choice in space.items()
    }


def _drawn(choice: Choice, random: np.random.Generator) -> Any:
    if choice.choices:
        return choice.choices[int(random.integers(len(choice.choices)))]
    low, high = choice.low or 0.0, choice.high or 0.0
    if choice.integer and not choice.log:
        return int(random.integers(int(low), int(high) + 1))
    value = (
        math.exp(random.uniform(math.log(low), math.log(high))) if choice.log else random.uniform(low, high)
    )
    return _clamped(value, choice)


def _near(value: Any, choice: Choice, options: PopulationOptions, random: np.random.Generator) -> Any:
    if choice.choices:
        place = choice.choices.index(value) + int(random.choice((-1, 1)))
        return choice.choices[min(max(place, 0), len(choice.choices) - 1)]
    moved = value * float(random.choice(options.factors))
    if choice.integer and round(moved) == value:
        # Small whole numbers would stay where they are.
        moved = value + math.copysign(1.0, moved - value)
    return _clamped(moved, choice)


def _clamped(value: float, choice: Choice) -> float | int:
    held = min(max(value, choice.low or 0.0), choice.high or 0.0)
    return round(held) if choice.integer else held


_CONFIG: Final = "config.yaml"
_STATE: Final = "population.json"
_TABLE: Final = "results.csv"
_ROOTS: Final = ("hyperparameters.", "task.reward.")
_SHAPES: Final = ("policy", "policy_kwargs", "net_arch", "activation_fn", "buffer_size")
"""Hyperparameters that a checkpoint is made for."""


class Population:
    """A population in its folder.

    Args:
        path: The folder.
        config: What all members have in common; ``search`` says what they differ in.

    Raises:
        ConfigurationError: there is nothing to vary, or it cannot change in the middle of a training.
    """

    def __init__(self, path: Path, config: TrainingConfig) -> None:
        self.path, self.config, self.options = path, config, config.population
        self.generations: list[list[Member]] = []
        check_space(config)
        _check(config)

    @classmethod
    def create(cls, path: Path | None, config: TrainingConfig) -> Population:
        """A new population."""
        population = cls(free_folder(path, f"{config.algo}-population"), config)
        members = range(config.population.members)
        first = [Member(draw(config.search, population._random(0, member))) for member in members]
        population.generations.append(first)
        save(config, population.path / _CONFIG)
        population._save()
        return population

    @classmethod
    def open(cls, path: Path) -> Population:
        """A population that was begun."""
        population = cls(path, load(TrainingConfig, path / _CONFIG))
        try:
            state = json.loads((path / _STATE).read_text(encoding="utf-8"))
            population.generations = [[Member(**member) for member in members] for members in state]
        except (OSError, ValueError, TypeError) as error:
            raise DataError(f"{path / _STATE}: not the state of a population ({error})") from None
        return population

    def _random(self, *place: int) -> np.random.Generator:
        return np.random.default_rng([self.config.seed, *place])

    @property
    def interval(self) -> int:
        """Actions of a generation."""
        return self.options.interval * self.config.validation.every

    @property
    def total(self) -> int:
        """Generations in all."""
        return math.ceil(self.config.steps / self.interval)

    @property
    def best_agent(self) -> Path:
        """The agent that was best on the validation drives, of all members."""
        return self.path / "best.safetensors"

    def run(self, engine: Engine, listener: Listener) -> bool:
        """Train until the last generation is done; returns whether Ctrl-C stopped it."""
        while True:
            if any(member.rating is None for member in self.generations[-1]):
                endings, interrupted = run_jobs(engine, self.jobs(), listener)
                if interrupted:
                    return True
                self._note(endings)
            if len(self.generations) >= self.total:
                self._finish()
                return False
            self._next_generation()

    def jobs(self) -> list[TrainingJob]:
        """What there is to do in the latest generation."""
        number, latest = len(self.generations), self.generations[-1]
        until = number * self.interval if number < self.total else None
        folder = self._folder(number)
        folder.mkdir(parents=True, exist_ok=True)
        jobs, last_only = [], replace(self.config.checkpoints, keep=1)
        for i, member in enumerate(latest):
            seed = self.config.seed + i
            config = varied(self.config, member.values, seed=seed, checkpoints=last_only)
            before = self._folder(number - 1) / f"member-{member.parent}"
            parent = None if member.parent is None else before
            jobs.append(TrainingJob(f"member-{i}", folder / f"member-{i}", config, until, parent))
        return jobs

    def _folder(self, number: int) -> Path:
        return self.path.resolve() / f"generation-{number:03d}"

    def _note(self, endings: Mapping[str, Ending]) -> None:
        wrong = [f"{name} ({ending.error})" for name, ending in endings.items() if ending.error is not None]
        if wrong:
            raise DataError(f"failed: {'; '.join(wrong)}; the same command tries again")
        latest = self.generations[-1]
        for i, member in enumerate(latest):
            status = endings[f"member-{i}"].result.status
            member.rating, member.best = rating(status.score, self.config.validation.best), status.best
        if not any(math.isfinite(member.rating or 0.0) for member in latest):
            raise DataError(f"generation {len(self.generations)}: no member's validation is finite")
        self._save()
        # The children of the generation before are done: its checkpoints are of no use any more.
        for path in self._folder(len(self.generations) - 1).glob("*/checkpoints"):
            shutil.rmtree(path)

    def _next_generation(self) -> None:
        """The next generation."""
        latest = self.generations[-1]
        ratings = [math.inf if member.rating is None else member.rating for member in latest]
        random = self._random(len(self.generations))
        values = [member.values for member in latest]
        self.generations.append(next_generation(ratings, values, self.config.search, self.options, random))
        self._save()

    def _finish(self) -> None:
        """The best agent there ever was, and that of the member that is best at the end."""
        latest = self.generations[-1]
        folders = [
            RunFolder(self._folder(self.total) / f"member-{i}", self.config) for i in range(len(latest))
        ]
        best = min(range(len(latest)), key=lambda i: _finite(latest[i].best))
        final = min(range(len(latest)), key=lambda i: _finite(latest[i].rating))
        copy_file(folders[best].best_agent, self.best_agent)
        copy_file(folders[final].final_agent, self.path / "final.safetensors")

    def _save(self) -> None:
        state = [[asdict(member) for member in members] for members in self.generations]
        write_text(self.path / _STATE, json.dumps(state, indent=1) + "\n")
        names = list(self.config.search)
        rows: list[list[Any]] = [["generation", "member", "parent", "rating", "best", *names]]
        for number, members in enumerate(self.generations, start=1):
            for i, member in enumerate(members):
                # None becomes an empty cell.
                row = [member.parent, member.rating, member.best]
                rows.append([number, i, *row, *(member.values[name] for name in names)])
        write_table(self.path / _TABLE, rows)


def is_population(path: Path) -> bool:
    """Whether a folder is that of a population."""
    return (path / _STATE).exists()


def _finite(value: float | None) -> float:
    return value if value is not None and math.isfinite(value) else math.inf


def _check(config: TrainingConfig) -> None:
    for name in config.search:
        if not name.startswith(_ROOTS) or set(name.split(".")) & set(_SHAPES):
            raise ConfigurationError(
                f"search: {name} cannot change in the middle of a training; a population varies "
                "hyperparameters other than the network's shape, and task.reward"
            )
    rewarded = [name for name in config.search if name.startswith("task.reward.")]
    if rewarded and config.validation.best == "reward":
        raise ConfigurationError(
            f"validation.best: members with another {rewarded[0]} cannot be compared by reward; use cue_error"
        )
