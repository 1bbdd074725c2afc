"""Noise that is annealed, and a learning rate that follows the divergence of the updates."""

from __future__ import annotations

import itertools

import gymnasium
import numpy as np
import pytest
import torch
from sb3_contrib import TRPO
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import DummyVecEnv

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.train.algorithms.sb3.callbacks import AdaptiveLearningRate, AnnealedNoise, CriticFirst
from motion_cueing.train.algorithms.sb3.sb3 import arguments, callbacks_of


class Look(BaseCallback):
    """What the model is like when each rollout begins."""

    def __init__(self):
        super().__init__()
        self.deviations, self.rates, self.divergences = [], [], []

    def _on_rollout_start(self):
        self.deviations.append(np.exp(self.model.policy.log_std.detach().numpy()))
        self.rates.append(self.model.lr_schedule(1.0))
        self.divergences.append(self.logger.name_to_value.get("train/approx_kl"))

    def _on_step(self):
        return True


def learned(callback, steps: int, **options) -> Look:
    env, look = DummyVecEnv([lambda: gymnasium.make("Pendulum-v1")]), Look()
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=32, seed=0, device="cpu", **options)
    model.set_logger(Logger(None, output_formats=[]))
    model.learn(steps, callback=[*np.ravel(callback), look], log_interval=None)
    return look


def test_noise_falls_geometrically_whatever_is_learned():
    look = learned(AnnealedNoise(0.8, 0.1), 256)
    np.testing.assert_allclose(
        np.squeeze(look.deviations), 0.8 * (1.0 / 8.0) ** (np.arange(4) / 4.0), rtol=1e-5
    )


def test_the_learning_rate_follows_the_divergence():
    look = learned(AdaptiveLearningRate(0.02, rate=1e-3), 64 * 12, learning_rate=1e-3)
    rates, done = np.array(look.rates), np.arange(12) / 12.0
    target = 0.02 * np.maximum(1.0 - done, 0.1)
    assert look.divergences[0] is None
    for k in range(1, 12):
        moved = look.divergences[k]
        factor = 1.0 / 1.5 if moved > 1.5 * target[k] else 1.5 if moved < target[k] / 1.5 else 1.0
        assert rates[k] == pytest.approx(np.clip(rates[k - 1] * factor, 1e-5, 4e-3))
    assert len(set(rates)) > 3


def test_the_critic_learns_alone_at_first():
    before: list[dict] = []

    class Keep(BaseCallback):
        def _on_rollout_start(self):
            before.append({name: value.clone() for name, value in self.model.policy.state_dict().items()})

        def _on_step(self):
            return True

    learned([CriticFirst(2), Keep()], 64 * 4)
    moved = [
        {name for name in last if not torch.equal(last[name], now[name])}
        for last, now in itertools.pairwise(before)
    ]
    critic = {name for name in before[0] if "value" in name}
    assert moved[0] == moved[1] == critic | {"log_std"}
    assert moved[2] == set(before[0])


def test_they_are_hyperparameters_of_ppo():
    given = {"critic_first": 2, "annealed_std": [0.5, 0.1], "adaptive_kl": 0.02, "learning_rate": 5e-4}
    kinds = [type(one) for one in callbacks_of(given)]
    assert kinds == [CriticFirst, AdaptiveLearningRate, AnnealedNoise]
    assert callbacks_of(given)[1].rate == 5e-4
    assert arguments(PPO, given, 4).keys() == {"learning_rate", "policy", "policy_kwargs"}
    with pytest.raises(ConfigurationError, match="unknown field 'critic_first'"):
        arguments(TRPO, given, 4)
    for wrong in (
        {"critic_first": -1},
        {"annealed_std": 0.5},
        {"annealed_std": [0.5, 0.0]},
        {"adaptive_kl": -1.0},
    ):
        with pytest.raises(ConfigurationError, match=next(iter(wrong))):
            arguments(PPO, wrong, 4)
    with pytest.raises(ConfigurationError, match="a number with adaptive_kl"):
        arguments(PPO, {"adaptive_kl": 0.02, "learning_rate": "lin_1e-3"}, 4)
