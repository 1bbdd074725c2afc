"""Analytic policy gradient: the reward's own gradient, through policy and machine, over a whole episode.

Every round draws an episode in each environment, drives it with the policy, leads the gradient of the cost
back through every time step, and takes a step of Adam. There is no critic, and nothing is sampled.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from ..envs.errors import ConfigurationError
from ..envs.settings import Positive, configuration, from_dict
from ..envs.task.batch import Batch
from ..envs.task.options import PositiveCount
from ..envs.task.reward_kernel import TERMS
from ..envs.task.unroll import TaskUnroll
from .actor import ACTIVATIONS, Actor
from .agent import Network
from .config import TrainingConfig
from .initial import begin
from .learner import Boundary, State, restoring
from .schedule import warm_cosine

_TINY: Final = 1e-30

Floats = NDArray[np.float64]


@configuration
class GradientHyperparameters:
    """What an analytic policy gradient is given.

    Args:
        learning_rate: Largest, of Adam; it rises linearly in the first tenth and falls as a cosine.
        net_arch: Entries of each hidden layer.
        activation_fn: Of the hidden layers.
        max_grad_norm: Longer gradients are shortened to it.
        outlier: An episode's own gradient is shortened to so many times the median episode's.
        offset: The cost of an episode counts as log(offset + cost): every drive by its relative gain, a wild
            one as much as a gentle one.
    """

    learning_rate: Positive = 2e-3
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(ACTIVATIONS))] = "elu"
    max_grad_norm: Positive = 1.0
    outlier: Positive = 2.0
    offset: Positive = 0.2


def make_learner(config: TrainingConfig) -> GradientLearner:
    """The learner of a configuration."""
    return GradientLearner(config)


class GradientLearner:
    """See :class:`~.learner.Learner`.

    Args:
        config: The training; ``task.episode.duration`` is how far gradients are led.

    Raises:
        ConfigurationError: a hyperparameter is wrong, or the task has no gradients.
    """

    def __init__(self, config: TrainingConfig) -> None:
        where = "hyperparameters"
        self.given = from_dict(GradientHyperparameters, dict(config.hyperparameters), where)
        _check(config)
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self._total, n = config.steps, config.n_envs
        self.batch = Batch(n, config.task, device=config.device)
        self._everywhere = np.ones(n, dtype=bool)
        self.batch.seed(self._everywhere, [config.seed + i for i in range(n)])
        self._length = round(float(config.task.episode.duration or 0.0) / self.batch.time_step)
        self._unroll = TaskUnroll(self.batch, self._length)
        size, actions = self.batch.layout.size, self.batch.action_size
        self.actor = Actor(size, actions, self.given.net_arch, self.given.activation_fn)
        begin(self.actor, self.batch, config)
        self._optimizer = torch.optim.Adam(self.actor.parameters(), lr=self.given.learning_rate)
        self._rounds, self._skipped, self._left_out = 0, 0, 0
        self._sums: dict[str, float] = {}
        self._logged = 0

    @property
    def steps(self) -> int:
        """Actions so far."""
        return self._rounds * self._length * self.batch.n

    def learn(self, boundary: Boundary) -> None:
        """Learn until the configuration's steps, or a boundary raises :class:`StopTraining`."""
        while self.steps < self._total:
            boundary()
            self._round()

    def _round(self) -> None:
        seen = self._drive()
        costs = self._unroll.costs
        weights = 1.0 / (self.given.offset + costs) / self.batch.n
        self._optimizer.zero_grad()
        self._lead_back(seen, np.where(np.isfinite(costs), weights, 0.0))
        norm = float(torch.nn.utils.clip_grad_norm_(self.actor.parameters(), self.given.max_grad_norm))
        for group in self._optimizer.param_groups:
            group["lr"] = self.given.learning_rate * warm_cosine(self.steps / self._total)
        if math.isfinite(norm) and norm > 0.0:
            self._optimizer.step()
        else:
            self._skipped += 1
        self._rounds += 1
        self._note(costs, norm)

    def _drive(self) -> list[torch.Tensor]:
        """Play an episode everywhere; returns what was seen before each action."""
        self.batch.begin(self._everywhere)
        self._unroll.begin()
        seen = []
        with torch.no_grad():
            for k in range(self._length):
                observation = torch.from_numpy(self._unroll.observe(k))
                seen.append(observation)
                self._unroll.act(k, self.actor(observation).numpy())
        return seen

    def _lead_back(self, seen: list[torch.Tensor], weights: Floats) -> None:
        """Gather the gradient of the weighted costs in the actor's parameters."""
        self._unroll.weigh(weights)
        gradients: list[torch.Tensor] = []
        for k in reversed(range(self._length)):
            gradients.append(torch.from_numpy(self._unroll.back_through_act(k).copy()))
            observation = seen[k].detach().requires_grad_(True)
            (back,) = torch.autograd.grad(self.actor(observation), observation, gradients[-1])
            self._unroll.back_through_observe(k, back.numpy())
        of_actions = self._tamed(torch.stack(gradients[::-1]))
        torch.sum(self.actor(torch.stack(seen)) * of_actions).backward()  # type: ignore[no-untyped-call]

    def _tamed(self, gradients: torch.Tensor) -> torch.Tensor:
        """(actions, n, k) gradients, where no episode pulls much harder than the others.

        An episode in which policy and limits chatter has a gradient that grows with every step back, and
        would be all there is in the sum. One that is not finite is left out.
        """
        norms = gradients.flatten(2).pow(2).sum(dim=(0, 2)).sqrt()
        sound = torch.isfinite(norms)
        self._left_out += int((~sound).sum())
        if not sound.any():
            return torch.zeros_like(gradients)
        largest = self.given.outlier * norms[sound].median()
        factors = torch.where(sound, torch.clamp(largest / norms.clamp_min(_TINY), max=1.0), 0.0)
        return torch.nan_to_num(gradients, 0.0, 0.0, 0.0) * factors[None, :, None]

    def _note(self, costs: Floats, norm: float) -> None:
        terms = self._unroll.terms
        row = {f"terms/{name}": float(value) for name, value in zip(TERMS, terms, strict=True)}
        row |= {"rollout/reward": -float(costs.mean()), "rollout/median_cost": float(np.median(costs))}
        row |= {"train/gradient_norm": norm if math.isfinite(norm) else 0.0}
        for name, value in row.items():
            self._sums[name] = self._sums.get(name, 0.0) + value
        self._logged += 1

    def scalars(self) -> dict[str, float]:
        """Means since the last call, and what was skipped since the beginning for not being finite."""
        means = {name: total / self._logged for name, total in self._sums.items()}
        self._sums, self._logged = {}, 0
        rate = self._optimizer.param_groups[0]["lr"]
        skipped = {"train/skipped_rounds": self._skipped, "train/skipped_episodes": self._left_out}
        return {**means, **skipped, "train/learning_rate": float(rate)}

    def network(self) -> Network:
        """The policy as it is now."""
        return self.actor.network()

    def state(self) -> dict[str, Any]:
        """Weights, optimizer, environments, counts."""
        return {
            "actor": self.actor.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "batch": self.batch.snapshot(),
            "counts": [self._rounds, self._skipped, self._left_out, self._logged],
            "sums": dict(self._sums),
        }

    def restore(self, state: State) -> None:
        """Go on from a state, bit for bit."""
        with restoring():
            self.actor.load_state_dict(state["actor"])
            self._optimizer.load_state_dict(state["optimizer"])
            self.batch.restore(state["batch"])
            counts = (int(count) for count in state["counts"])
            self._rounds, self._skipped, self._left_out, self._logged = counts
            self._sums = dict(state["sums"])


def _check(config: TrainingConfig) -> None:
    if config.task.episode.duration is None:
        raise ConfigurationError(
            "task.episode.duration must say how far gradients are led, s; 20 is a good start"
        )
    if config.task.episode.terminate_on_failure:
        raise ConfigurationError("task.episode.terminate_on_failure has no gradient; leave it off for apg")
    if config.normalize.observation or config.normalize.reward:
        raise ConfigurationError("normalize must be off for apg: gradients need the scales of the machine")
    if not str(config.device).startswith("cpu"):
        raise ConfigurationError(f"device {config.device}: apg runs on the CPU")
