"""The deterministic policy of a Stable-Baselines3 model as a network that needs no PyTorch."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.torch_layers import FlattenExtractor
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from ..envs.errors import DataError
from .actor import ACTIVATIONS
from .agent import Network

_NAMES = {module: name for name, module in ACTIVATIONS.items()}


def network_of(model: BaseAlgorithm, normalize: VecNormalize | None = None) -> Network:
    """``model.predict(deterministic=True)`` with the normalisation before it.

    Args:
        model: PPO, SAC, TD3, TQC, or another with their actor, on a flat observation.
        normalize: The wrapper the model was trained in; its running mean and variance go into the network.

    Raises:
        DataError: the policy is not a chain of linear layers with one kind of activation.
    """
    layers, squash = _actor(model)
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    mean, variance, clip = None, None, 10.0
    if normalize is not None and normalize.norm_obs:
        statistics: Any = normalize.obs_rms
        mean, variance, clip = statistics.mean.copy(), statistics.var.copy(), float(normalize.clip_obs)
    return Network(
        weights=tuple(_numpy(layer.weight) for layer in linear),
        biases=tuple(_numpy(layer.bias) for layer in linear),
        activation=_activation(layers),  # type: ignore[arg-type]
        squash="tanh" if squash else "clip",
        mean=mean,
        variance=variance,
        clip=clip,
    )


def _actor(model: BaseAlgorithm) -> tuple[list[nn.Module], bool]:
    """Layers from the observation to the action, and whether a tanh follows them."""
    policy: Any = model.policy
    actor = policy if isinstance(model, OnPolicyAlgorithm) else policy.actor
    if not isinstance(actor.features_extractor, FlattenExtractor):
        raise DataError("the policy's features extractor is not the plain one; it cannot become a network")
    if isinstance(model, OnPolicyAlgorithm):
        return [*policy.mlp_extractor.policy_net, policy.action_net], bool(policy.squash_output)
    if hasattr(actor, "latent_pi"):
        return [*_flat(actor.latent_pi), *_flat(actor.mu)], True
    return _flat(actor.mu)[:-1], True


def _flat(module: nn.Module) -> list[nn.Module]:
    return list(module) if isinstance(module, nn.Sequential) else [module]


def _activation(layers: Iterable[nn.Module]) -> str:
    kinds = {type(layer) for layer in layers if not isinstance(layer, nn.Linear)}
    if not kinds:
        return "tanh"
    if len(kinds) > 1 or not kinds <= _NAMES.keys():
        found = ", ".join(sorted(kind.__name__ for kind in kinds))
        hint = "; with use_sde set policy_kwargs.clip_mean to 0" if nn.Hardtanh in kinds else ""
        raise DataError(f"the policy has layers {found}; a network has one of {', '.join(ACTIVATIONS)}{hint}")
    return _NAMES[kinds.pop()]


def _numpy(tensor: torch.Tensor) -> NDArray[np.float32]:
    array: NDArray[np.float32] = tensor.detach().cpu().numpy().copy()
    return array
