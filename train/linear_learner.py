"""The best linear washout for random drives, by CMA-ES: a few gains, not a network's thousands of weights.

Every generation tries its candidates all at once, each in the same episodes. The agent is a network whose
hidden layers are silent, so a training by gradients can go on from it.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import cma
import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from ..envs.car import drive_seeds
from ..envs.errors import ConfigurationError
from ..envs.settings import Positive, configuration, from_dict
from ..envs.task.batch import Batch
from ..envs.task.options import PositiveCount
from .actor import ACTIVATIONS, Actor, begin_as
from .agent import Network
from .config import TrainingConfig
from .learner import Boundary, State, restoring
from .linear_washout import LinearWashout, coordinates, gains, washout_at

Floats = NDArray[np.float64]


@configuration
class LinearHyperparameters:
    """What the search is given.

    Args:
        start: The gains it begins with.
        sigma: Standard deviation of its first generation, in logarithms of gains and in shares.
        population: Candidates of a generation.
        offset: The cost of an episode counts as log(offset + cost), as for apg.
        net_arch: Entries of each hidden layer of the network, which are silent.
        activation_fn: Of the hidden layers.
    """

    start: LinearWashout = LinearWashout()
    sigma: Positive = 0.3
    population: Annotated[int, Field(ge=4)] = 12
    offset: Positive = 0.2
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(ACTIVATIONS))] = "elu"


def make_learner(config: TrainingConfig) -> LinearLearner:
    """The learner of a configuration."""
    return LinearLearner(config)


class LinearLearner:
    """See :class:`~.learner.Learner`.

    Args:
        config: The training; every candidate drives ``n_envs`` episodes of ``task.episode.duration``.

    Raises:
        ConfigurationError: a hyperparameter is wrong, or the task is one that has no linear washout.
    """

    def __init__(self, config: TrainingConfig) -> None:
        self.given = from_dict(LinearHyperparameters, dict(config.hyperparameters), "hyperparameters")
        _check(config)
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self._total, self._each = config.steps, config.n_envs
        self._seeds = drive_seeds(self._each, config.seed)
        self.batch = Batch(config.n_envs * self.given.population, config.task)
        self._everywhere = np.ones(self.batch.n, dtype=bool)
        self._length = round(float(config.task.episode.duration or 0.0) / self.batch.time_step)
        layout = self.batch.layout
        self.actor = Actor(layout.size, self.batch.action_size, self.given.net_arch, self.given.activation_fn)
        begin = coordinates(self.given.start, len(config.task.observation.memory))
        options = {"seed": config.seed + 1, "popsize": self.given.population, "verbose": -9}
        self._search = cma.CMAEvolutionStrategy(begin, self.given.sigma, options)
        self._told: list[list[float]] = []
        self._best, self._least = begin, math.inf
        self._costs = np.zeros((0, 0))

    @property
    def steps(self) -> int:
        """Actions so far."""
        return len(self._told) * self._length * self.batch.n

    def learn(self, boundary: Boundary) -> None:
        """Search until the configuration's steps, or a boundary raises :class:`StopTraining`."""
        while self.steps < self._total:
            boundary()
            points = self._search.ask()
            self._tell(points, self._tried(points))

    def _tell(self, points: list[Floats], values: list[float]) -> None:
        self._search.tell(points, values)
        self._told.append(values)
        least = int(np.argmin(values))
        if values[least] < self._least:
            self._best, self._least = np.array(points[least]), values[least]

    def _tried(self, points: list[Floats]) -> list[float]:
        """What each candidate costs, in the same episodes of every generation."""
        batch, arrays = self.batch, self.batch.arrays
        matrices = np.array([self._gains(point) for point in points])
        batch.seed(self._everywhere, self._seeds * len(points))
        batch.begin(self._everywhere)
        batch.observe(self._everywhere)
        costs = np.zeros(batch.n)
        for _ in range(self._length):
            seen = arrays.observation.pull().reshape(len(points), self._each, -1)
            action = np.tanh(np.einsum("pes,pas->pea", seen, matrices))
            batch.write(action.reshape(batch.n, -1))
            batch.step()
            costs -= arrays.reward.pull()
        self._costs = (costs / self._length).reshape(len(points), self._each)
        # Logarithms: every drive by its relative gain, a wild one as much as a gentle one.
        values: list[float] = np.log(self.given.offset + self._costs).mean(axis=1).tolist()
        return values

    def _gains(self, point: Floats) -> NDArray[np.float32]:
        return gains(washout_at(point), self.batch.layout, self.batch.usual_scale).astype(np.float32)

    @property
    def washout(self) -> LinearWashout:
        """The best gains so far."""
        return washout_at(self._best)

    def scalars(self) -> dict[str, float]:
        """Of the last generation, and the best so far."""
        told = {"train/sigma": float(self._search.sigma)}
        if self._told:
            told |= {"rollout/reward": -float(self._costs.mean(axis=1).min()), "train/least": self._least}
        return told

    def network(self) -> Network:
        """The best gains so far as a network."""
        begin_as(self.actor, self._gains(self._best))
        return self.actor.network()

    def state(self) -> dict[str, Any]:
        """What each generation came to; the search is repeated from it."""
        return {"told": [list(values) for values in self._told]}

    def restore(self, state: State) -> None:
        """Go on from a state, bit for bit."""
        with restoring():
            for values in state["told"]:
                self._tell(self._search.ask(), [float(value) for value in values])


def _check(config: TrainingConfig) -> None:
    task = config.task
    if task.episode.duration is None:
        raise ConfigurationError("task.episode.duration must say how long the episodes are, s")
    if task.action.mode != "acceleration" or task.observation.stack > 1:
        raise ConfigurationError("linear needs task.action.mode acceleration and task.observation.stack 1")
    if task.action.frame != "cab" or task.observation.frame != "cab":
        raise ConfigurationError("task.action.frame and task.observation.frame must be cab for linear")
    if config.normalize.observation or config.normalize.reward:
        raise ConfigurationError("normalize must be off for linear: gains need the scales of the machine")
    if not str(config.device).startswith("cpu"):
        raise ConfigurationError(f"device {config.device}: linear runs on the CPU")
