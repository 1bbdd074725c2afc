"""The environment through Gymnasium, beside Pendulum-v1 in the same run, on one core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv

import motion_cueing.envs
from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE
from motion_cueing.envs.task import DrivingSimulatorVector

from .test_step import describe

LENGTH = 500
"""Actions that a benchmark goes through again and again: the washout's in 5 s of a drive."""


def washouts_actions(n: int) -> list[Any]:
    """What the classical washout does in the first steps of n drives."""
    envs, policy = DrivingSimulatorVector(n), ClassicalWashout()
    observation, _ = envs.reset(seed=0)
    state, begins, actions = None, np.ones(n, dtype=bool), []
    for _ in range(LENGTH):
        acceleration, state = policy.predict(observation[:, :OBSERVATION_SIZE], state, begins)
        begins = np.zeros(n, dtype=bool)
        actions.append(envs.action_of(acceleration))
        observation, *_ = envs.step(actions[-1])
    return actions


def played(envs: Any, actions: list[Any]) -> Callable[[], Any]:
    """Steps through the actions, from the beginning again after the last."""
    k = len(actions)

    def step() -> None:
        nonlocal k
        if k == len(actions):
            envs.reset(seed=0)
            k = 0
        envs.step(actions[k])
        k += 1

    return step


def test_single_environment(benchmark):
    env = gymnasium.make(motion_cueing.envs.ENVIRONMENT_ID)
    describe(benchmark, "environment, single", "environment", 1)
    benchmark(played(env, [action[0] for action in washouts_actions(1)]))


def test_single_pendulum(benchmark):
    describe(benchmark, "environment, single", "Pendulum-v1", 1)
    benchmark(played(gymnasium.make("Pendulum-v1"), [np.zeros(1, dtype=np.float32)] * 200))


@pytest.mark.parametrize("n", [64, 1024, 16384])
def test_batch(benchmark, n):
    envs = gymnasium.make_vec(motion_cueing.envs.ENVIRONMENT_ID, num_envs=n)
    actions = washouts_actions(min(n, 1024))
    describe(benchmark, f"environment, {n}", "environment", n)
    benchmark(played(envs, [np.resize(action, (n, 9)) for action in actions[: 500 if n <= 1024 else 50]]))


@pytest.mark.parametrize("n", [64, 1024])
def test_batch_of_pendulums(benchmark, n):
    envs = SyncVectorEnv([lambda: gymnasium.make("Pendulum-v1")] * n)
    describe(benchmark, f"environment, {n}", "Pendulum-v1", n)
    benchmark(played(envs, [np.zeros((n, 1), dtype=np.float32)] * 200))
