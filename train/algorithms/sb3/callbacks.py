"""Callbacks for PPO: a critic that learns first, noise that falls, and updates of one size.

They work with any ``learn`` of Stable-Baselines3, as ``callback=AnnealedNoise(0.5, 0.1)``.
"""

from __future__ import annotations

import math
from typing import Any, Final

import torch
from stable_baselines3.common.callbacks import BaseCallback

_APART: Final = 1.5
"""Factor from its target at which the divergence changes the learning rate, and by which it does."""

_RATES: Final = (1e-5, 4e-3)
"""Least and largest learning rate."""

_LEAST: Final = 0.1
"""Least share of the target that is left at the end."""


class CriticFirst(BaseCallback):
    """The critic learns alone for a while: one that knows nothing would lead the actor astray.

    Args:
        rollouts: As many as the actor stays what it is.
    """

    def __init__(self, rollouts: int) -> None:
        super().__init__()
        self._rollouts = rollouts

    def _on_rollout_start(self) -> None:
        policy: Any = self.model.policy
        per_rollout = self.model.n_steps * self.training_env.num_envs  # type: ignore[attr-defined]
        acts = self.num_timesteps >= self._rollouts * per_rollout
        for layers in (policy.mlp_extractor.policy_net, policy.action_net):
            layers.requires_grad_(acts)

    def _on_step(self) -> bool:
        return True


class AnnealedNoise(BaseCallback):
    """Exploration that falls from one standard deviation to another, geometrically over the training.

    A learned deviation falls as soon as noise costs more than it finds out, and then little is found out any
    more. One that stays leaves a policy that is good at living with noise.

    Args:
        start: Standard deviation of every entry of an action at first.
        end: The same at the end of ``learn``.
    """

    def __init__(self, start: float, end: float) -> None:
        super().__init__()
        self._start, self._end = start, end

    def _on_rollout_start(self) -> None:
        policy: Any = self.model.policy
        done = min(self.num_timesteps / self.locals["total_timesteps"], 1.0)
        with torch.no_grad():
            policy.log_std.fill_(math.log(self._start) + done * math.log(self._end / self._start))
        policy.log_std.requires_grad_(False)

    def _on_step(self) -> bool:
        return True


class AdaptiveLearningRate(BaseCallback):
    """A learning rate that keeps the divergence of an update from the policy before at a target.

    It falls by a factor of 1.5 after an update that moved the policy by more than 1.5 times the target. It
    rises by it after one that moved it by less than the target over 1.5. The target falls linearly to a
    tenth.

    Args:
        target: Mean Kullback-Leibler divergence of an update at first.
        rate: Learning rate at first.
    """

    def __init__(self, target: float, rate: float = 1e-3) -> None:
        super().__init__()
        self._target, self.rate = target, rate
        self.adapted_at = 0  # actions; a checkpoint of this rollout needs no second change

    def _on_rollout_start(self) -> None:
        done = min(self.num_timesteps / self.locals["total_timesteps"], 1.0)
        target = self._target * max(1.0 - done, _LEAST)
        moved = self.logger.name_to_value.get("train/approx_kl")
        if moved is not None and self.num_timesteps > self.adapted_at:
            self.adapted_at = self.num_timesteps
            if moved > _APART * target:
                self.rate = max(self.rate / _APART, _RATES[0])
            elif moved < target / _APART:
                self.rate = min(self.rate * _APART, _RATES[1])
        model: Any = self.model
        model.lr_schedule = self._schedule

    def _schedule(self, remaining: float) -> float:
        return self.rate

    def _on_step(self) -> bool:
        return True
