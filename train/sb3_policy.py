"""A policy of Stable-Baselines3 with the actor of :mod:`.actor`, so that it can begin with its weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from stable_baselines3.common.distributions import DiagGaussianDistribution, Distribution
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from .actor import ACTIVATIONS, Latent


class _ActorAndCritic(nn.Module):
    """What Stable-Baselines3 calls the extractor: hidden layers of actor and critic."""

    def __init__(self, size: int, actor: Sequence[int], critic: Sequence[int], activation: str) -> None:
        super().__init__()
        self.policy_net = Latent(size, actor, activation)
        self.value_net = Latent(size, critic, activation)
        self.latent_dim_pi, self.latent_dim_vf = self.policy_net.size, self.value_net.size

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        latent: torch.Tensor = self.policy_net(features)
        return latent

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        latent: torch.Tensor = self.value_net(features)
        return latent


class SkipPolicy(ActorCriticPolicy):
    """Actor and critic whose last layers see the observation, too; the mean action goes through a tanh.

    It takes the arguments of ``MlpPolicy``; ``net_arch`` is a list, or a mapping with ``pi`` and ``vf``.
    """

    def _build_mlp_extractor(self) -> None:
        arch: Any = self.net_arch
        actor, critic = (arch["pi"], arch["vf"]) if isinstance(arch, dict) else (arch, arch)
        names = {kind: name for name, kind in ACTIVATIONS.items()}
        extractor: Any = _ActorAndCritic(self.features_dim, actor, critic, names[self.activation_fn])
        self.mlp_extractor = extractor.to(self.device)

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        # use_sde, which has another distribution, is refused in hyperparameters.py.
        assert isinstance(self.action_dist, DiagGaussianDistribution)
        return self.action_dist.proba_distribution(torch.tanh(self.action_net(latent_pi)), self.log_std)

    @property
    def hidden(self) -> list[nn.Module]:
        """Hidden layers of the actor, with their activations."""
        extractor: Any = self.mlp_extractor
        return list(extractor.policy_net.hidden)
