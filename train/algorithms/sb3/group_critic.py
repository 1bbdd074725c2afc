"""A critic that knows how a machine differs from the others in its group; for PPO and TRPO.

In a group the reward is relative to the others'. So the road says little about what is still to come, and the
difference of a machine from the others says much. The critic sees both. The actor sees the observation alone,
which is all there is where the agent is used: an asymmetric critic.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from ....envs.errors import ConfigurationError
from ...vec_env import DrivingSimulatorVecEnv

_UNIT: Final = 0.25
"""Deviation that is shown as 1: those within a group are smaller than what is usual on the road."""


class Deviations(VecEnvWrapper):
    """Each observation, and after it how it differs from the mean of the others in the group.

    Args:
        venv: The machines, in groups.

    Raises:
        ConfigurationError: they are in no groups.
    """

    def __init__(self, venv: DrivingSimulatorVecEnv) -> None:
        if venv.group < 2:
            raise ConfigurationError(
                f"deviations are from others in a group; group must be above 1, found {venv.group}"
            )
        self.simulators = venv
        seen: Any = venv.observation_space
        self._largest = np.tile(seen.high, 2)
        super().__init__(venv, observation_space=spaces.Box(-self._largest, self._largest, dtype=np.float32))

    def reset(self) -> NDArray[np.float32]:
        """Begin new episodes."""
        return self._with_deviations(self.simulators.reset())

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions; ``terminal_observation`` has the deviations at the end, too."""
        seen, reward, ended, infos = self.simulators.step_wait()
        observation = np.asarray(seen)
        if ended.any():
            last = observation.copy()
            for i in np.flatnonzero(ended).tolist():
                last[i] = infos[i]["terminal_observation"]
            last = self._with_deviations(last)
            for i in np.flatnonzero(ended).tolist():
                infos[i]["terminal_observation"] = last[i]
        return self._with_deviations(observation), reward, ended, infos

    def _with_deviations(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        deviation = self.simulators.relative(observation) / _UNIT
        return np.clip(np.hstack([observation, deviation]), -self._largest, self._largest)


class _ActorSeesHalf(MlpExtractor):
    """Hidden layers of a critic that sees everything, and of an actor that sees the first half."""

    def __init__(self, size: int, net_arch: Any, activation_fn: Any, device: Any) -> None:
        super().__init__(size, net_arch, activation_fn, device)
        self._seen = size // 2
        self.policy_net = MlpExtractor(self._seen, net_arch, activation_fn, device).policy_net
        # What is to come grows with a deviation, and a tanh saturates.
        self.value_net = MlpExtractor(size, net_arch, torch.nn.ELU, device).value_net

    def forward_actor(self, features: Any) -> Any:
        return super().forward_actor(features[:, : self._seen])


class _TwoRates(torch.optim.Adam):
    """Adam with a learning rate of its own for the second group; Stable-Baselines3 sets one for all."""

    second_rate: float

    def step(self, closure: Any = None) -> Any:
        self.param_groups[1]["lr"] = self.second_rate
        return super().step(closure)


class GroupCriticPolicy(ActorCriticPolicy):
    """``MlpPolicy`` for :class:`Deviations`: the critic sees them, the actor does not; the critic has ELUs.

    Args:
        *args: Of ``MlpPolicy``.
        critic_learning_rate: Of the critic alone, which need not wait for the actor's small steps.
        **kwargs: Of ``MlpPolicy``.
    """

    def __init__(self, *args: Any, critic_learning_rate: float = 1e-3, **kwargs: Any) -> None:
        self._critic_learning_rate = critic_learning_rate
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = _ActorSeesHalf(self.features_dim, self.net_arch, self.activation_fn, self.device)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        critic = [*self.mlp_extractor.value_net.parameters(), *self.value_net.parameters()]
        actor = [one for one in self.parameters() if not any(one is other for other in critic)]
        groups = [{"params": actor}, {"params": critic}]
        self.optimizer = _TwoRates(groups, lr=lr_schedule(1.0), eps=self.optimizer.defaults["eps"])
        self.optimizer.second_rate = self._critic_learning_rate
