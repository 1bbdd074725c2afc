"""Stable-Baselines3's algorithms as a learner."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import torch
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from ..envs.errors import ConfigurationError
from .agent import Network
from .base_policy import base_policy
from .config import TrainingConfig
from .from_sb3 import load_network, network_of
from .hyperparameters import arguments
from .initial import initial_network
from .learner import Boundary, State
from .monitor import Monitor
from .sb3_state import restore, restore_random, state_of
from .vec_env import DrivingSimulatorVecEnv

_NUMBER: Final = (int, float, np.number)
_INITIAL_WEIGHT: Final = 1e5
"""Observations that the normalisation of an initial agent counts for."""
CLASSES: Final[dict[str, type[BaseAlgorithm]]] = {"ppo": PPO, "sac": SAC, "td3": TD3, "tqc": TQC}


def make_learner(config: TrainingConfig) -> SB3Learner:
    """The learner of a configuration whose ``algo`` is one of :data:`CLASSES`."""
    return SB3Learner(config)


class SB3Learner:
    """A Stable-Baselines3 model with its environments; see :class:`~.learner.Learner`.

    Args:
        config: The training.

    Raises:
        ConfigurationError: a hyperparameter is unknown or of the wrong type.
    """

    def __init__(self, config: TrainingConfig) -> None:
        torch.set_num_threads(config.threads)
        algorithm, self._total = CLASSES[config.algo], config.steps
        # Checked before the drives are made, which takes seconds.
        arguments(algorithm, config.hyperparameters, 1)
        base = base_policy(config.base, config.task)
        self.simulators = DrivingSimulatorVecEnv(config.n_envs, config.task, base=base, device=config.device)
        self.normalize = _normalized(self.simulators, config)
        env: VecEnv = self.normalize or self.simulators
        (size,) = self.simulators.action_space.shape or (0,)
        hyperparameters = arguments(algorithm, config.hyperparameters, size)
        self.model = _model(algorithm, env, config, hyperparameters)
        initial = initial_network(config)
        if initial is not None:
            load_network(initial, self.model, self.normalize, _INITIAL_WEIGHT)
        self.model.set_logger(Logger(None, output_formats=[]))
        self.monitor = Monitor()
        self._resumed: State | None = None

    @property
    def steps(self) -> int:
        """Actions so far."""
        return int(self.model.num_timesteps)

    def learn(self, boundary: Boundary) -> None:
        """Learn until the configuration's steps, or a boundary raises :class:`StopTraining`."""
        left = self._total - self.steps
        if left <= 0:
            return
        callback = _Callback(self._at(boundary), self.monitor, self.simulators)
        # No Generic method: the classes' own differ in the default of log_interval alone.
        learn: Any = self.model.learn
        learn(left, callback=callback, log_interval=None, reset_num_timesteps=False)

    def _at(self, boundary: Boundary) -> Boundary:
        def settled() -> None:
            if self._resumed is not None:
                restore_random(self._resumed, self.model)
                self._resumed = None
            boundary()

        return settled

    def scalars(self) -> dict[str, float]:
        """Means over what was played since the last call, and what the update told last."""
        told = self._told()
        self.model.logger.name_to_value.clear()
        self.model.logger.name_to_count.clear()
        return {**self.monitor.take(), **told}

    def _told(self) -> dict[str, float]:
        values: dict[str, Any] = self.model.logger.name_to_value
        return {name: float(value) for name, value in values.items() if isinstance(value, _NUMBER)}

    def network(self) -> Network:
        """The deterministic policy with its normalisation."""
        return network_of(self.model, self.normalize)

    def state(self) -> dict[str, Any]:
        """Weights, optimizers, replay buffer, normalisation, environments, random generators, log."""
        whole = state_of(self.model, self.simulators, self.normalize)
        return {**whole, "monitor": self.monitor.state(), "told": self._told()}

    def restore(self, state: State) -> None:
        """Go on from a state."""
        restore(state, self.model, self.simulators, self.normalize)
        self._resumed = {name: state[name] for name in ("random", "noise", "walks")}
        self.monitor.restore(state["monitor"])
        self.model.logger.name_to_value.update(state["told"])


def _model(
    algorithm: type[BaseAlgorithm], env: VecEnv, config: TrainingConfig, hyperparameters: dict[str, Any]
) -> BaseAlgorithm:
    try:
        return algorithm(env=env, seed=config.seed, device=config.device, **hyperparameters)
    except (AssertionError, TypeError, ValueError) as error:
        # Values that are right by themselves, but do not go together.
        raise ConfigurationError(f"hyperparameters: {' '.join(str(error).split())}") from None


def _normalized(env: DrivingSimulatorVecEnv, config: TrainingConfig) -> VecNormalize | None:
    options = config.normalize
    if not (options.observation or options.reward):
        return None
    gamma: Any = config.hyperparameters.get("gamma", 0.99)
    return VecNormalize(
        env,
        norm_obs=options.observation,
        norm_reward=options.reward,
        clip_obs=options.clip,
        clip_reward=options.clip,
        gamma=float(gamma),
    )


class _Callback(BaseCallback):
    """Tells the monitor of every step, and the training of every boundary."""

    def __init__(self, boundary: Boundary, monitor: Monitor, simulators: DrivingSimulatorVecEnv) -> None:
        super().__init__()
        self._boundary, self._monitor, self._simulators = boundary, monitor, simulators

    def _on_rollout_start(self) -> None:
        self._boundary()

    def _on_step(self) -> bool:
        arrays = self._simulators.batch.arrays
        self._monitor.step(arrays.reward.pull(), arrays.terms.pull(), self.locals["infos"])
        return True
