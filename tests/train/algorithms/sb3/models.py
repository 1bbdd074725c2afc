"""Models of Stable-Baselines3 for a task, without the simulator behind it."""

from __future__ import annotations

import gymnasium
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.envs.task.options import TaskOptions, load_task
from motion_cueing.train.algorithms.sb3.policy import CLASSES

ID = "motion_cueing/CueingPreview-v0"
NAME = "cueing-preview"
_OFF_POLICY = {"learning_starts": 4, "batch_size": 4, "buffer_size": 100}
_ON_POLICY = {"n_steps": 8, "batch_size": 8}


class Spaces(gymnasium.Env):
    """Noise in an observation of a task's size; actions do nothing."""

    def __init__(self, task: TaskOptions) -> None:
        size = layout_of(task.observation, task.action.mode, task.action.size).size
        bound = task.action.bound
        self.observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = spaces.Box(-bound, bound, (task.action.size,), np.float32)

    def _observation(self) -> np.ndarray:
        return self.np_random.normal(0.5, 2.0, self.observation_space.shape).astype(np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observation(), {}

    def step(self, action):
        return self._observation(), 0.0, False, False, {}


def learned(algo: str, normalized: bool = True, steps: int = 16, **policy) -> BaseAlgorithm:
    """A model that has learned a little, of :data:`ID`."""
    env = DummyVecEnv([lambda: Spaces(load_task(NAME))])
    if normalized:
        env = VecNormalize(env, clip_obs=3.0)
    env.seed(1)
    hyperparameters = _ON_POLICY if algo in ("ppo", "trpo", "recurrent-ppo") else _OFF_POLICY
    kwargs = {"net_arch": [16, 12], **policy}
    name = "MlpLstmPolicy" if algo == "recurrent-ppo" else "MlpPolicy"
    model = CLASSES[algo](name, env, seed=3, policy_kwargs=kwargs, **hyperparameters)
    return model.learn(steps)


def seen(model: BaseAlgorithm) -> np.ndarray:
    """Observations, (n, size)."""
    size = model.observation_space.shape[0]
    return np.random.default_rng(2).normal(0.5, 2.0, (50, size)).astype(np.float32)


def actions(model: BaseAlgorithm, observations: np.ndarray) -> np.ndarray:
    """What the model does, with the normalization around its environment."""
    normalize = model.get_vec_normalize_env()
    normalized = observations if normalize is None else normalize.normalize_obs(observations)
    return model.predict(normalized, deterministic=True)[0]
