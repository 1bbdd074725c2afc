"""Policies of Stable-Baselines3 as networks of NumPy and back; a policy with a skip connection for PPO."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib import TQC, TRPO, CrossQ, RecurrentPPO
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from sb3_contrib.common.torch_layers import BatchRenorm1d
from sb3_contrib.crossq.policies import CrossQPolicy
from sb3_contrib.tqc.policies import TQCPolicy
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.distributions import DiagGaussianDistribution, Distribution
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import FlattenExtractor
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.sac.policies import SACPolicy
from stable_baselines3.td3.policies import TD3Policy
from torch import nn

from ....envs import ENVIRONMENTS, provenance
from ....envs.errors import DataError
from ....envs.task import TaskOptions
from ....envs.task.options import load_task
from ...agents import Agent, Network, PolicyNetwork, Record, RecurrentNetwork
from ...agents.network import EPSILON, LstmLayer
from ...networks import TORCH_ACTIVATIONS, HiddenLayers, linear_layers, load_weights, weights_of


class _ActorAndCritic(nn.Module):
    """What Stable-Baselines3 calls the extractor: hidden layers of actor and critic."""

    def __init__(self, size: int, actor: Sequence[int], critic: Sequence[int], activation: str) -> None:
        super().__init__()
        self.policy_net = HiddenLayers(size, actor, activation)
        self.value_net = HiddenLayers(size, critic, activation)
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
    """Actor and critic with a skip connection; the mean action goes through a tanh, as in ``networks.Actor``.

    It takes the arguments of ``MlpPolicy``; ``net_arch`` is a list, or a mapping with ``pi`` and ``vf``.
    """

    def _build_mlp_extractor(self) -> None:
        arch: Any = self.net_arch
        actor, critic = (arch["pi"], arch["vf"]) if isinstance(arch, dict) else (arch, arch)
        names = {kind: name for name, kind in TORCH_ACTIVATIONS.items()}
        extractor: Any = _ActorAndCritic(self.features_dim, actor, critic, names[self.activation_fn])
        self.mlp_extractor = extractor.to(self.device)

    def _get_action_dist_from_latent(self, latent_pi: torch.Tensor) -> Distribution:
        # use_sde, which has another distribution, is refused in sb3.py.
        assert isinstance(self.action_dist, DiagGaussianDistribution)
        return self.action_dist.proba_distribution(torch.tanh(self.action_net(latent_pi)), self.log_std)


CLASSES: Final[dict[str, type[BaseAlgorithm]]] = {
    "ppo": PPO,
    "trpo": TRPO,
    "recurrent-ppo": RecurrentPPO,
    "sac": SAC,
    "td3": TD3,
    "tqc": TQC,
    "crossq": CrossQ,
}
"""Algorithms by name."""
_KNOWN: Final = ", ".join(kind.__name__ for kind in CLASSES.values())
_NAMES: Final = {module: name for name, module in TORCH_ACTIVATIONS.items()}


def agent_of(
    model: BaseAlgorithm,
    task: TaskOptions | str | Path,
    name: str,
    normalize: VecNormalize | None = None,
    base: Any = None,
) -> Agent:
    """A model as an agent: its deterministic policy with its environment, which NumPy alone runs.

    Args:
        model: As :func:`network_of` takes it.
        task: The environment it was trained in, by options, id, name or YAML file.
        name: Of the agent.
        normalize: The wrapper the model was trained in; None for the one it has now, if any.
        base: The controller under the agent, as :class:`~...agents.Agent` takes it; None for the task's.

    Raises:
        DataError: the policy cannot become a network, or its sizes are not the task's; or the wrapper that
            normalized its observations is missing.
        ConfigurationError: there is no such task; or the base is missing or of no use.
    """
    # ``gymnasium.make`` takes an id with the module that registers it before.
    environment = str(task).removeprefix("motion_cueing.envs:")
    options = load_task(ENVIRONMENTS.get(environment, {"task": task}).get("task"))
    normalize = normalize or model.get_vec_normalize_env()
    # Algorithms on policy keep this only where they learned in VecNormalize.
    if normalize is None and isinstance(model, OnPolicyAlgorithm) and model._last_original_obs is not None:
        raise DataError(
            f"{name}: the model was trained in VecNormalize; give its statistics too, normalize=..., "
            "which VecNormalize.save writes"
        )
    record = Record(
        algo=next((name for name, kind in CLASSES.items() if type(model) is kind), type(model).__name__),
        seed=model.seed or 0,
        steps=model.num_timesteps,
        versions=provenance.versions(),
        created=provenance.now(),
    )
    return Agent(name, options, network_of(model, normalize), record, base)


def network_of(model: BaseAlgorithm, normalize: VecNormalize | None = None) -> PolicyNetwork:
    """``model.predict(deterministic=True)`` with the normalization before it.

    Args:
        model: One of :data:`CLASSES`, or another with their actor, on a flat observation.
        normalize: The wrapper the model was trained in; its running mean and variance go into the network.

    Raises:
        DataError: the policy is not a chain of linear layers with one kind of activation, LSTM layers
            before it or not; or its actions are no vector within one bound.
    """
    layers, squash, skip = _actor(model)
    bound = _bound(model.action_space)
    mean, variance, clip = None, None, 10.0
    if normalize is not None and normalize.norm_obs:
        statistics: Any = normalize.obs_rms
        mean, clip = statistics.mean.copy(), float(normalize.clip_obs)
        variance = statistics.var + (normalize.epsilon - EPSILON)
    head = partial(
        Network,
        *weights_of(_folded(layers)),
        activation=_activation(layers),  # type: ignore[arg-type]
        squash="tanh" if squash else "clip",
        skip=skip,
        bound=bound,
    )
    if isinstance(model.policy, RecurrentActorCriticPolicy):
        return RecurrentNetwork(_lstm_layers(model.policy.lstm_actor), head(), mean, variance, clip)
    return head(mean=mean, variance=variance, clip=clip)


_LSTM: Final = ("weight_ih_l", "weight_hh_l", "bias_ih_l", "bias_hh_l")
"""Parameters of a layer in PyTorch, before its number."""


def _lstm_layers(lstm: nn.LSTM) -> tuple[LstmLayer, ...]:
    if lstm.bidirectional or lstm.proj_size or not lstm.bias:
        raise DataError("policy_kwargs.lstm_kwargs: an agent holds LSTM layers of the plain kind alone")
    layers = []
    for k in range(lstm.num_layers):
        inputs, recurrent, *biases = (
            lstm.get_parameter(f"{name}{k}").detach().cpu().numpy() for name in _LSTM
        )
        layers.append(LstmLayer(inputs, recurrent, biases[0] + biases[1]))
    return tuple(layers)


@torch.no_grad()
def _load_lstm(lstm: nn.LSTM, layers: Sequence[LstmLayer]) -> None:
    for k, (inputs, recurrent, bias) in enumerate(layers):
        for name, values in zip(_LSTM, (inputs, recurrent, bias, np.zeros_like(bias)), strict=True):
            lstm.get_parameter(f"{name}{k}").copy_(torch.from_numpy(values.copy()))


def _bound(space: spaces.Space[Any]) -> float:
    """The largest absolute value of an action, the same in every entry."""
    if isinstance(space, spaces.Box):
        high = float(space.high.flat[0])
        if len(space.shape) == 1 and np.all(space.high == high) and np.all(space.low == -high):
            return high
    raise DataError(f"the model's actions are {space}; those of an agent are a vector within +-bound")


def load_network(
    network: PolicyNetwork, model: BaseAlgorithm, normalize: VecNormalize | None, weight: float
) -> None:
    """Give a model the deterministic policy of a network.

    Args:
        network: Of a model built in the same way.
        model: Its policy is changed, its critics stay as they are.
        normalize: The wrapper around its environment; takes over mean and variance.
        weight: Observations that mean and variance are counted for; new ones move them on.

    Raises:
        DataError: the network is built in another way, or the model has batch normalization.
    """
    layers, squash, skip = _actor(model)
    if any(isinstance(layer, BatchRenorm1d) for layer in layers):
        raise DataError(
            "initial: an agent's file has no batch statistics, which CrossQ needs to go on; leave initial "
            "out, or set hyperparameters.policy_kwargs.batch_norm to false"
        )
    linear, head = linear_layers(layers), network.head
    recurrent = model.policy if isinstance(model.policy, RecurrentActorCriticPolicy) else None
    lstm = () if recurrent is None else _lstm_layers(recurrent.lstm_actor)
    ours = (
        [tuple(layer.weight.shape) for layer in linear],
        _activation(layers),
        squash,
        skip,
        [x.inputs.shape for x in lstm],
    )
    theirs = (
        [w.shape for w in head.weights],
        head.activation,
        head.squash == "tanh",
        head.skip,
        [layer.inputs.shape for layer in network.lstm],
    )
    if ours != theirs:
        raise DataError(
            "initial: the agent's network is built in another way; it has "
            f"{f'LSTM layers {[x.units for x in network.lstm]}, ' if network.lstm else ''}hidden layers "
            f"{[w.shape[0] for w in head.weights[:-1]]} and activation {head.activation}"
            f"{', its last layer also sees the observation' if head.skip else ''}, and ends with "
            f"{head.squash}"
        )
    _load_statistics(network, normalize, weight)
    load_weights(linear, head)
    if recurrent is not None:
        _load_lstm(recurrent.lstm_actor, network.lstm)
    target = getattr(model.policy, "actor_target", None)
    if target is not None:
        target.load_state_dict(model.policy.actor.state_dict())  # type: ignore[union-attr]


def _load_statistics(network: PolicyNetwork, normalize: VecNormalize | None, weight: float) -> None:
    normalized = normalize is not None and normalize.norm_obs
    if normalized != (network.mean is not None):
        needed = "true" if network.mean is not None else "false"
        raise DataError(f"initial: the agent was trained with normalize.observation {needed}; set it so")
    if normalize is not None and network.mean is not None and network.variance is not None:
        statistics: Any = normalize.obs_rms
        statistics.mean, statistics.var = network.mean.copy(), network.variance.copy()
        statistics.count = weight


def _actor(model: BaseAlgorithm) -> tuple[list[nn.Module], bool, bool]:
    """Layers from observation (or memory) to action; whether a tanh follows; whether they skip."""
    if not isinstance(model.policy, ActorCriticPolicy | SACPolicy | TD3Policy | TQCPolicy | CrossQPolicy):
        raise DataError(
            f"{type(model).__name__}: network_of cannot convert its policy: it is none of {_KNOWN}; make a "
            "motion_cueing.train.agents.Network of it"
        )
    on_policy, td3 = isinstance(model.policy, ActorCriticPolicy), isinstance(model.policy, TD3Policy)
    skip = isinstance(model.policy, SkipPolicy)
    policy: Any = model.policy
    actor = policy if on_policy else policy.actor
    if not isinstance(actor.features_extractor, FlattenExtractor):
        raise DataError("the policy's features extractor is not the plain one; it cannot become a network")
    if skip:
        return [*policy.mlp_extractor.policy_net.hidden, policy.action_net], True, True
    if on_policy:
        return [*policy.mlp_extractor.policy_net, policy.action_net], bool(policy.squash_output), False
    if td3:
        return _flat(actor.mu)[:-1], True, False
    return [*_flat(actor.latent_pi), *_flat(actor.mu)], True, False


def _flat(module: nn.Module) -> list[nn.Module]:
    return list(module) if isinstance(module, nn.Sequential) else [module]


def _folded(layers: Iterable[nn.Module]) -> list[nn.Linear]:
    """Linear layers, each with the batch normalization before it made part of its weights."""
    folded: list[nn.Linear] = []
    before: BatchRenorm1d | None = None
    for layer in layers:
        if isinstance(layer, BatchRenorm1d):
            before = layer
        elif isinstance(layer, nn.Linear):
            folded.append(layer if before is None else _fold(before, layer))
            before = None
    return folded


@torch.no_grad()
def _fold(normalization: BatchRenorm1d, layer: nn.Linear) -> nn.Linear:
    """``layer`` on the normalized input, as one layer, with the running statistics as in evaluation."""
    mean = normalization.get_buffer("ra_mean").double()
    gain = (normalization.get_buffer("ra_var").double() + normalization.eps).rsqrt()
    offset = -mean * gain
    if normalization.affine:
        scale = normalization.scale.double()
        gain, offset = gain * scale, offset * scale + normalization.bias.double()
    weight = layer.weight.double()
    folded = nn.Linear(layer.in_features, layer.out_features)
    folded.weight.copy_(weight * gain)
    folded.bias.copy_(weight @ offset + layer.bias.double())
    return folded


def _activation(layers: Iterable[nn.Module]) -> str:
    kinds = {type(layer) for layer in layers if not isinstance(layer, nn.Linear | BatchRenorm1d)}
    if not kinds:
        return "tanh"
    if len(kinds) > 1 or not kinds <= _NAMES.keys():
        names = ", ".join(sorted(kind.__name__ for kind in kinds))
        hint = "; with use_sde set policy_kwargs.clip_mean to 0" if nn.Hardtanh in kinds else ""
        raise DataError(
            f"the policy has layers {names}; a network has one of {', '.join(TORCH_ACTIVATIONS)}{hint}"
        )
    return _NAMES[kinds.pop()]
