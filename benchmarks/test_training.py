"""How much of PPO's wall time passes in 64 environments; from random weights, PyTorch on one thread.

From random weights an agent drives the machine from limit to limit, where a step costs most.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import pytest
import torch
from stable_baselines3 import PPO

from motion_cueing.train.algorithms.sb3.sb3 import SB3Learner
from motion_cueing.train.config import load_config
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

from .test_step import describe

ENVIRONMENTS = 64
STEPS = 128
"""Of each environment in a rollout."""
ROLLOUTS = 5
DRIVES = 16
"""In the library: the presets have more, which only the making of an environment takes time for."""


@dataclass
class Stopwatch:
    """Wall time that passes in an environment's steps, resets in them included."""

    seconds: float = 0.0

    def on(self, env: DrivingSimulatorVecEnv) -> None:
        """Time the steps of an environment from now on."""
        for name in ("step_async", "step_wait"):
            setattr(env, name, self._timed(getattr(env, name)))

    def _timed(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            began = time.perf_counter()
            try:
                return call(*arguments)
            finally:
                self.seconds += time.perf_counter() - began

        return timed


def share(benchmark: Any, case: str, env: DrivingSimulatorVecEnv, learn: Callable[[], Any], n: int) -> None:
    """Learn once, for ``n`` actions of each environment, and keep the share of the environment."""
    describe(benchmark, case, "PPO", ENVIRONMENTS, n)
    watch = Stopwatch()
    watch.on(env)
    benchmark.pedantic(learn, rounds=1)
    benchmark.extra_info["share"] = watch.seconds / benchmark.stats.stats.total
    assert 0.0 < benchmark.extra_info["share"] < 1.0


@pytest.mark.parametrize(
    ("batch", "epochs", "rollouts"), [(64, 10, 1), (4096, 10, ROLLOUTS), (4096, 3, ROLLOUTS)]
)
def test_plain_environment(benchmark, batch, epochs, rollouts):
    torch.set_num_threads(1)
    env = DrivingSimulatorVecEnv(ENVIRONMENTS)
    model = PPO("MlpPolicy", env, n_steps=STEPS, batch_size=batch, n_epochs=epochs, seed=0, device="cpu")
    model.learn(1)  # to warm up, and to come to the limits
    actions = rollouts * ENVIRONMENTS * STEPS
    case = f"PPO, batch {batch}, {epochs} epochs"
    share(benchmark, case, env, lambda: model.learn(actions, reset_num_timesteps=False), rollouts * STEPS)


def test_preset(benchmark):
    """As ``motion-cueing train --algorithm ppo``: an action is several time steps, each with the washout."""
    config = load_config("ppo")
    episode = replace(config.task.episode, library=DRIVES)
    n = ROLLOUTS * int(str(config.hyperparameters["n_steps"]))
    config = replace(
        config, task=replace(config.task, episode=episode), n_envs=ENVIRONMENTS, steps=ENVIRONMENTS * n
    )
    learner = SB3Learner(config)
    case = f"PPO, preset, {config.task.action.repeat} time steps an action"
    share(benchmark, case, learner.simulators, lambda: learner.learn(lambda: None), n)
