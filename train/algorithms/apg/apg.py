"""Analytic policy gradient (APG): the gradient of the cost itself, through the differentiable simulator.

A round: drive a window in every environment with the policy (:class:`.backpropagation.Rollout`), lead the
gradient of its cost back through time to the actions and on to the weights, take a step of the optimizer. No
action is ever sampled. A window is a whole episode, or shorter; the next one then goes on where it ended,
and a learned value can stand for the later cost (:mod:`.value`; the short-horizon actor-critic,
SHAC).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from torch import nn

from ....envs.errors import ConfigurationError
from ....envs.maneuvers import drive_seeds
from ....envs.settings import Positive, configuration, from_dict, renamed
from ....envs.task.batch import Batch
from ....envs.task.kernels.reward import TERMS
from ....envs.task.options import PositiveCount
from ....envs.task.unroll import TaskUnroll
from ...agents import Network
from ...config import TrainingConfig
from ...networks import TORCH_ACTIVATIONS, Actor, linear_layers, normalize_by_rollout
from ...registry import Boundary, Learner, State, restoring
from ...training import check_episodes, start_actor, warm_cosine
from .backpropagation import Rollout, clip_outliers
from .value import ValueBootstrap, ValueOptions

Floats = NDArray[np.float64]

_USUAL_RATE: Final = 0.1
"""Weight of a new window in the usual cost of a drive."""

_RENAMED: Final = {"descent": "optimizers", "ahead": "value"}
"""Parts of a checkpoint by their names in earlier versions."""


@configuration
class ApgHyperparameters:
    """Hyperparameters of the analytic policy gradient.

    Args:
        learning_rate: Largest, of Adam; it rises linearly in the first tenth and falls as a cosine.
        hidden_rate: Largest learning rate of hidden layers by Muon, the spectral norm of a step; it rises and
            falls likewise. None: Adam for hidden layers, too.
        net_arch: Units of each hidden layer.
        activation_fn: Of the hidden layers.
        max_grad_norm: Longer gradients are clipped to it.
        outlier: The gradient of one environment is clipped to so many times the median environment's.
        offset: The cost of a drive counts relative to this plus its usual cost, so that wild and gentle
            drives count alike.
        standardize: Whether observations and actions are normalized by a rollout of the first policy. None:
            if the training starts from an agent; the default start moves too little to be a measure.
        window: Length of backpropagation through time, s; None: to the end of the episode.
        value: Value bootstrap after a window; None: nothing comes after it.
    """

    learning_rate: Positive = 2e-3
    hidden_rate: Positive | None = None
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(TORCH_ACTIVATIONS))] = "elu"
    max_grad_norm: Positive = 1.0
    outlier: Positive = 2.0
    offset: Positive = 0.2
    standardize: Annotated[bool | None, renamed("standardize", "standardise")] = None
    window: Positive | None = None
    value: ValueOptions | None = None


class ActorOptimizer:
    """Adam with clipped gradients and a warm cosine schedule; hidden layers optionally by Muon.

    Muon (Jordan et al. 2024) replaces the gradient of a layer's matrix by the nearest one with equal singular
    values: a step has its size in every direction, not only in the few where the cost is steep.

    Args:
        actor: The policy.
        learning_rate: Largest, of Adam.
        hidden_rate: Largest, of Muon, in the spectral norm; None leaves hidden layers to Adam.
        max_grad_norm: Longer gradients are clipped to it.
    """

    def __init__(
        self, actor: Actor, learning_rate: float, hidden_rate: float | None, max_grad_norm: float
    ) -> None:
        self._actor, self._max_grad_norm = actor, max_grad_norm
        hidden = linear_layers(actor.latent.hidden) if hidden_rate is not None else []
        by_muon = [layer.weight for layer in hidden]
        apart = {id(weight) for weight in by_muon}
        by_adam = [weight for weight in actor.parameters() if id(weight) not in apart]
        adam = torch.optim.Adam(by_adam, lr=learning_rate)
        self._optimizers: list[tuple[torch.optim.Optimizer, float]] = [(adam, learning_rate)]
        if by_muon and hidden_rate is not None:
            muon = torch.optim.Muon(by_muon, lr=hidden_rate, weight_decay=0.0)
            self._optimizers.append((muon, hidden_rate))

    @property
    def learning_rate(self) -> float:
        """Of Adam in the last step."""
        return float(self._optimizers[0][0].param_groups[0]["lr"])

    def step(self, loss: torch.Tensor, progress: float) -> float:
        """A step along the gradient of a loss; returns the gradient's norm, 0 where it is not finite.

        Args:
            loss: A scalar.
            progress: Share of the training that is done.
        """
        for optimizer, _ in self._optimizers:
            optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        norm = float(nn.utils.clip_grad_norm_(self._actor.parameters(), self._max_grad_norm))
        if not math.isfinite(norm) or norm == 0.0:
            return 0.0
        for optimizer, largest in self._optimizers:
            for group in optimizer.param_groups:
                group["lr"] = largest * warm_cosine(progress)
            optimizer.step()
        return norm

    def state(self) -> list[dict[str, Any]]:
        """Everything that changes."""
        return [optimizer.state_dict() for optimizer, _ in self._optimizers]

    def restore(self, state: list[Mapping[str, Any]]) -> None:
        """Go on from a state."""
        for (optimizer, _), own in zip(self._optimizers, state, strict=True):
            optimizer.load_state_dict(dict(own))


class ApgLearner(Learner):
    """See :class:`~...registry.Learner`."""

    def __init__(self, config: TrainingConfig) -> None:
        given = from_dict(ApgHyperparameters, dict(config.hyperparameters), "hyperparameters")
        _check(config, given.window)
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self.given, self._total, n = given, config.steps, config.n_envs
        self.batch = Batch(n, config.task, device=config.device)
        everywhere, seeds = np.ones(n, dtype=bool), drive_seeds(n, config.seed)
        self.batch.seed(everywhere, seeds)
        self._episode = round(float(config.task.episode.duration or 0.0) / self.batch.time_step)
        self._length = self._episode if given.window is None else round(given.window / self.batch.time_step)
        self._unroll = TaskUnroll(self.batch, self._length)
        self.actor = Actor(
            self.batch.layout.size, self.batch.action_size, given.net_arch, given.activation_fn
        )
        start_actor(self.actor, self.batch, config)
        if given.standardize or (given.standardize is None and config.initial is not None):
            normalize_by_rollout(self.actor, self.batch, self._episode)
            self.batch.seed(everywhere, seeds)
        self._optimizer = ActorOptimizer(
            self.actor, given.learning_rate, given.hidden_rate, given.max_grad_norm
        )
        self._value = ValueBootstrap(given.value, self.actor, self._length, self.batch.time_step)
        # Actions to the end of each episode, and what each drive usually costs on each machine.
        self._left = np.zeros(n, dtype=np.int64)
        self._usual = np.full((len(self.batch.drives), len(self.batch.simulator.platforms)), math.nan)
        self._rounds, self._skipped_rounds, self._skipped_episodes = 0, 0, 0
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
        self._next_window()
        rollout, costs = Rollout(self._unroll, self.actor), self._unroll.costs
        norm = 0.0 if self._value.warming_up(self._rounds) else self._update(rollout, costs)
        self._rounds += 1
        self._log(costs, {"train/gradient_norm": norm, **self._value.learn(rollout.observations, costs)})

    def _update(self, rollout: Rollout, costs: Floats) -> float:
        """Update the policy's weights; returns the norm of the gradient, 0 where it is not finite."""
        observations, end = rollout.observations[:-1], rollout.observations[-1]
        cost = self._value.cost(costs, end)
        weights = np.where(np.isfinite(cost), self._weights(cost), 0.0) / self.batch.n
        gradients = rollout.backward(self._value.weights(weights), self._value.gradient(end, weights))
        gradients, skipped = clip_outliers(gradients, self.given.outlier)
        self._skipped_episodes += skipped
        # The chain rule: this surrogate has the gradient dC/da * da/dweights.
        surrogate = torch.sum(self.actor(observations) * gradients)
        norm = self._optimizer.step(surrogate, self.steps / self._total)
        self._skipped_rounds += norm == 0.0
        return norm

    def _next_window(self) -> None:
        """To the next window, in the next episode where one is over."""
        begins = self._left <= 0
        if self._rounds == 0:
            # The first episodes end at different times, so that later windows lie all over an episode.
            windows = max(self._episode // self._length, 1)
            self._left = self._length * (1 + np.arange(self.batch.n) % windows)
        else:
            self._left[begins] = self._episode
        self._unroll.go_on(begins)
        self._left -= self._length

    def _weights(self, costs: Floats) -> Floats:
        """(n,) of the windows: less where a drive is wild, on the machine it is driven on."""
        there = self.batch.simulator.drive_of, self.batch.simulator.platform_of
        known = np.where(np.isnan(self._usual[there]), costs, self._usual[there])
        self._usual[there] = (1.0 - _USUAL_RATE) * known + _USUAL_RATE * costs
        return np.asarray(1.0 / (self.given.offset + np.maximum(known, costs)))

    def _log(self, costs: Floats, scalars: dict[str, float]) -> None:
        means = costs.mean(axis=0)
        row = {f"terms/{name}": float(value) for name, value in zip(TERMS, self._unroll.terms, strict=True)}
        row |= {"rollout/reward": -float(means.mean()), "rollout/median_cost": float(np.median(means))}
        for name, value in (row | scalars).items():
            self._sums[name] = self._sums.get(name, 0.0) + value
        self._logged += 1

    def scalars(self) -> dict[str, float]:
        """Means since the last call, and counts of skipped rounds and episodes, which were not finite."""
        means = {name: total / self._logged for name, total in self._sums.items()}
        self._sums, self._logged = {}, 0
        skipped = {
            "train/skipped_rounds": self._skipped_rounds,
            "train/skipped_episodes": self._skipped_episodes,
        }
        return {**means, **skipped, "train/learning_rate": self._optimizer.learning_rate}

    def network(self) -> Network:
        """The policy as it is now."""
        return self.actor.network()

    def state(self) -> dict[str, Any]:
        """Weights, optimizers, environments, counts."""
        return {
            "actor": self.actor.state_dict(),
            "optimizers": self._optimizer.state(),
            "batch": self.batch.snapshot(),
            "window": {"left": self._left.copy(), "usual": self._usual.copy(), **self._unroll.snapshot()},
            "value": self._value.state(),
            "counts": [self._rounds, self._skipped_rounds, self._skipped_episodes, self._logged],
            "sums": dict(self._sums),
        }

    def restore(self, state: State) -> None:
        """Go on from a state, bit for bit."""
        with restoring():
            state = {_RENAMED.get(name, name): value for name, value in state.items()}
            self.actor.load_state_dict(state["actor"])
            self._optimizer.restore(state["optimizers"])
            self.batch.restore(state["batch"])
            self._unroll.restore(state["window"])
            self._left, self._usual = state["window"]["left"].copy(), state["window"]["usual"].copy()
            self._value.restore(state["value"])
            counts = (int(count) for count in state["counts"])
            self._rounds, self._skipped_rounds, self._skipped_episodes, self._logged = counts
            self._sums = dict(state["sums"])


def _check(config: TrainingConfig, window: float | None) -> None:
    check_episodes(config, "gradients need the scales of the machine")
    duration = config.task.episode.duration or 0.0
    if window is not None and not math.isclose(duration / window, max(round(duration / window), 1)):
        raise ConfigurationError(
            f"hyperparameters.window {window:g} must be a whole part of task.episode.duration {duration:g}"
        )
    if config.task.episode.terminate_on_failure:
        raise ConfigurationError("task.episode.terminate_on_failure has no gradient; leave it off for apg")
