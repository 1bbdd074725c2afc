"""Analytic policy gradient: the reward's own gradient, through policy and machine.

Every round drives a window in each environment with the policy, leads the gradient of the cost back through
every time step, and takes a step along it. A window is a whole episode, or it is shorter and the next one
goes on where it ended; then a learned value of its end can stand for what is still to come (the short-horizon
actor-critic, SHAC, of Xu et al. 2022). No action is ever sampled.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from ....envs.errors import ConfigurationError
from ....envs.maneuvers import drive_seeds
from ....envs.settings import Positive, configuration, from_dict
from ....envs.task.batch import Batch
from ....envs.task.kernels.reward import TERMS
from ....envs.task.options import PositiveCount
from ....envs.task.unroll import TaskUnroll
from ...agents import Network
from ...config import TrainingConfig
from ...networks import TORCH_ACTIVATIONS, Actor, standardize
from ...optimizers import Descent
from ...registry import Boundary, State, restoring
from ...training import begin
from .gradients import Ahead, ThroughTime, ValueOptions, tamed

_USUAL: Final = 0.1
"""Weight of a new window in what a drive usually costs."""

Floats = NDArray[np.float64]


@configuration
class GradientHyperparameters:
    """What an analytic policy gradient is given.

    Args:
        learning_rate: Largest, of Adam; it rises linearly in the first tenth and falls as a cosine.
        hidden_rate: Largest step of a hidden layer's matrix, in its spectral norm, by Muon; it rises and
            falls likewise. None: hidden layers, too, by Adam.
        net_arch: Entries of each hidden layer.
        activation_fn: Of the hidden layers.
        max_grad_norm: Longer gradients are shortened to it.
        outlier: An environment's own gradient is shortened to so many times the median one's.
        offset: The cost of a drive counts relative to this plus what the drive usually costs: every drive by
            its relative gain, a wild one as much as a gentle one.
        standardize: Whether the policy sees observations relative to mean and deviation under the first one,
            and acts relative to what that does. None: if the training goes on from an agent; the spring that
            it begins with otherwise moves too little to be a measure.
        window: How far gradients are led, s; None: to the end of the episode.
        value: Of what comes after a window; None: nothing does.
    """

    learning_rate: Positive = 2e-3
    hidden_rate: Positive | None = None
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    activation_fn: Annotated[str, Field(pattern="|".join(TORCH_ACTIVATIONS))] = "elu"
    max_grad_norm: Positive = 1.0
    outlier: Positive = 2.0
    offset: Positive = 0.2
    standardize: bool | None = None
    window: Positive | None = None
    value: ValueOptions | None = None


def make_learner(config: TrainingConfig) -> GradientLearner:
    """The learner of a configuration."""
    return GradientLearner(config)


class GradientLearner:
    """See :class:`~.learner.Learner`.

    Args:
        config: The training.

    Raises:
        ConfigurationError: a hyperparameter is wrong, or the task has no gradients.
    """

    def __init__(self, config: TrainingConfig) -> None:
        where = "hyperparameters"
        self.given = from_dict(GradientHyperparameters, dict(config.hyperparameters), where)
        _check(config, self.given.window)
        torch.set_num_threads(config.threads)
        torch.manual_seed(config.seed)
        self._total, n = config.steps, config.n_envs
        self.batch = Batch(n, config.task, device=config.device)
        everywhere, seeds = np.ones(n, dtype=bool), drive_seeds(n, config.seed)
        self.batch.seed(everywhere, seeds)
        self._episode = round(float(config.task.episode.duration or 0.0) / self.batch.time_step)
        window = self.given.window
        self._length = self._episode if window is None else round(window / self.batch.time_step)
        self._unroll = TaskUnroll(self.batch, self._length)
        size, actions = self.batch.layout.size, self.batch.action_size
        self.actor = Actor(size, actions, self.given.net_arch, self.given.activation_fn)
        begin(self.actor, self.batch, config)
        if self.given.standardize or (self.given.standardize is None and config.initial is not None):
            standardize(self.actor, self.batch, self._episode)
            self.batch.seed(everywhere, seeds)
        given = self.given
        self._descent = Descent(self.actor, given.learning_rate, given.hidden_rate, given.max_grad_norm)
        self._ahead = Ahead(self.given.value, self.actor, self._length, self.batch.time_step)
        # Actions to the end of each episode, and what each drive usually costs on each machine.
        self._left = np.zeros(n, dtype=np.int64)
        self._usual = np.full((len(self.batch.drives), len(self.batch.simulator.platforms)), math.nan)
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
        self._go_on()
        drive = ThroughTime(self._unroll, self.actor)
        costs = self._unroll.costs
        norm = 0.0 if self._ahead.waits(self._rounds) else self._improve(drive, costs)
        self._rounds += 1
        self._note(costs, {"train/gradient_norm": norm, **self._ahead.learn(drive.seen, costs)})

    def _improve(self, drive: ThroughTime, costs: Floats) -> float:
        """Take a step of the policy; returns the length of the gradient, 0 for one that is not finite."""
        seen, end = drive.seen[:-1], drive.seen[-1]
        whole = self._ahead.whole(costs, end)
        weights = np.where(np.isfinite(whole), self._weights(whole), 0.0) / self.batch.n
        gradients = drive.lead_back(self._ahead.weights(weights), self._ahead.gradient(end, weights))
        gradients, left_out = tamed(gradients, self.given.outlier)
        self._left_out += left_out
        self._descent.forget()
        torch.sum(self.actor(seen) * gradients).backward()  # type: ignore[no-untyped-call]
        norm = self._descent.clip()
        if not math.isfinite(norm) or norm == 0.0:
            self._skipped += 1
            return 0.0
        self._descent.step(self.steps / self._total)
        return norm

    def _go_on(self) -> None:
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
        self._usual[there] = (1.0 - _USUAL) * known + _USUAL * costs
        return np.asarray(1.0 / (self.given.offset + np.maximum(known, costs)))

    def _note(self, costs: Floats, told: dict[str, float]) -> None:
        terms, means = self._unroll.terms, costs.mean(axis=0)
        row = {f"terms/{name}": float(value) for name, value in zip(TERMS, terms, strict=True)}
        row |= {"rollout/reward": -float(means.mean()), "rollout/median_cost": float(np.median(means))}
        for name, value in (row | told).items():
            self._sums[name] = self._sums.get(name, 0.0) + value
        self._logged += 1

    def scalars(self) -> dict[str, float]:
        """Means since the last call, and what was skipped since the beginning for not being finite."""
        means = {name: total / self._logged for name, total in self._sums.items()}
        self._sums, self._logged = {}, 0
        skipped = {"train/skipped_rounds": self._skipped, "train/skipped_episodes": self._left_out}
        return {**means, **skipped, "train/learning_rate": self._descent.learning_rate}

    def network(self) -> Network:
        """The policy as it is now."""
        return self.actor.network()

    def state(self) -> dict[str, Any]:
        """Weights, optimizer, environments, counts."""
        return {
            "actor": self.actor.state_dict(),
            "descent": self._descent.state(),
            "batch": self.batch.snapshot(),
            "window": {"left": self._left.copy(), "usual": self._usual.copy(), **self._unroll.snapshot()},
            "ahead": self._ahead.state(),
            "counts": [self._rounds, self._skipped, self._left_out, self._logged],
            "sums": dict(self._sums),
        }

    def restore(self, state: State) -> None:
        """Go on from a state, bit for bit."""
        with restoring():
            self.actor.load_state_dict(state["actor"])
            self._descent.restore(state["descent"])
            self.batch.restore(state["batch"])
            self._unroll.restore(state["window"])
            self._left, self._usual = state["window"]["left"].copy(), state["window"]["usual"].copy()
            self._ahead.restore(state["ahead"])
            counts = (int(count) for count in state["counts"])
            self._rounds, self._skipped, self._left_out, self._logged = counts
            self._sums = dict(state["sums"])


def _check(config: TrainingConfig, window: float | None) -> None:
    duration = config.task.episode.duration
    if duration is None:
        raise ConfigurationError(
            "task.episode.duration must say how long an episode is, s; 20 is a good start"
        )
    if window is not None and not math.isclose(duration / window, max(round(duration / window), 1)):
        raise ConfigurationError(
            f"hyperparameters.window {window:g} must be a whole part of task.episode.duration {duration:g}"
        )
    if config.task.episode.terminate_on_failure:
        raise ConfigurationError("task.episode.terminate_on_failure has no gradient; leave it off for apg")
    if config.normalize.observation or config.normalize.reward:
        raise ConfigurationError("normalize must be off for apg: gradients need the scales of the machine")
    if not str(config.device).startswith("cpu"):
        raise ConfigurationError(f"device {config.device}: apg runs on the CPU")
