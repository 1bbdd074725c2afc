"""The rollout buffer whose advantages are over the rest of the group."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.train.algorithms.sb3.groups import GroupRolloutBuffer
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

STEPS, N, GROUP = 50, 6, 3
SPACE = gymnasium.spaces.Box(-1.0, 1.0, (1,))


def filled(buffer: RolloutBuffer, road: float, seed: int = 0) -> RolloutBuffer:
    """A buffer with random rewards, of which ``road`` times a number is common to each group."""
    rng = np.random.default_rng(seed)
    common = road * rng.normal(size=(STEPS, N // GROUP)).repeat(GROUP, axis=1)
    for rewards in common + rng.normal(size=(STEPS, N)):
        starts, zeros = np.zeros(N), np.zeros((N, 1))
        buffer.add(zeros, zeros, rewards, starts, torch.from_numpy(rng.normal(size=N)), torch.zeros(N))
    buffer.compute_returns_and_advantage(torch.zeros(N), np.zeros(N, dtype=bool))
    return buffer


def test_the_mean_of_the_others_is_taken_off():
    plain = filled(RolloutBuffer(STEPS, SPACE, SPACE, n_envs=N), 2.0)
    grouped = filled(GroupRolloutBuffer(STEPS, SPACE, SPACE, n_envs=N, group=GROUP), 2.0)
    for i in range(N):
        others = [k for k in range(N) if k // GROUP == i // GROUP and k != i]
        expected = plain.advantages[:, i] - plain.advantages[:, others].mean(axis=1)
        assert np.allclose(grouped.advantages[:, i], expected, atol=1e-5)
    # What the critic learns stays what it was.
    assert np.array_equal(grouped.returns, plain.returns)


def test_a_group_of_one_is_a_plain_buffer():
    plain = filled(RolloutBuffer(STEPS, SPACE, SPACE, n_envs=N), 2.0)
    single = filled(GroupRolloutBuffer(STEPS, SPACE, SPACE, n_envs=N), 2.0)
    assert np.array_equal(single.advantages, plain.advantages)


def test_the_share_that_is_the_drives():
    """Without a common part it is about 0; with one of three times the deviation nearly 9 of 10."""
    shares = [
        filled(GroupRolloutBuffer(STEPS, SPACE, SPACE, n_envs=N, group=GROUP, gae_lambda=0.0), road).shared
        for road in (0.0, 3.0)
    ]
    assert abs(shares[0]) < 0.15
    assert 0.7 < shares[1] < 0.95


def test_ppo_takes_it_by_public_arguments():
    envs = DrivingSimulatorVecEnv(
        4, "cueing", group=2, episode={"library": 2, "drive_duration": 3.0, "duration": 1.0}
    )
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=16,
        rollout_buffer_class=GroupRolloutBuffer,
        rollout_buffer_kwargs={"group": 2},
        device="cpu",
    )
    model.learn(64)
    # Flat by now, environment after environment.
    pairs = model.rollout_buffer.advantages.reshape(2, 2, 16)
    assert np.allclose(pairs.sum(axis=1), 0.0, atol=1e-5)
    with pytest.raises(ConfigurationError, match="no multiple"):
        PPO(
            "MlpPolicy",
            envs,
            rollout_buffer_class=GroupRolloutBuffer,
            rollout_buffer_kwargs={"group": 3},
            device="cpu",
        )
