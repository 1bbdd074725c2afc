"""The multilayer perceptron in PyTorch: :class:`Actor` to train, :class:`TorchNetwork` to export.

Both are the layers of :class:`~.agents.Network` (hidden layers, skip connection, output layer), which NumPy
runs. An actor becomes a network by :meth:`Actor.network` and a network an actor by :meth:`Actor.load`.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from ..envs.errors import DataError
from ..envs.platform.kernels.step import AXES
from ..envs.task.batch import Batch
from ..envs.task.kernels.observation import MACHINE, Layout
from .agents import Network

Floats = NDArray[np.float32]

TORCH_ACTIVATIONS: Final[dict[str, type[nn.Module]]] = {
    "tanh": nn.Tanh,
    "relu": nn.ReLU,
    "elu": nn.ELU,
    "silu": nn.SiLU,
}
"""Activations of :data:`~.agents.network.ACTIVATIONS` as modules."""


class HiddenLayers(nn.Module):
    """Hidden layers with their activations; the skip connection appends the observation to their output.

    Args:
        size: Entries of an observation.
        hidden: Units of each layer.
        activation: One of :data:`TORCH_ACTIVATIONS`.
        skip: Whether there is a skip connection.
    """

    def __init__(self, size: int, hidden: Sequence[int], activation: str, skip: bool = True) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        inputs = size
        for outputs in hidden:
            layers += [nn.Linear(inputs, outputs), TORCH_ACTIVATIONS[activation]()]
            inputs = outputs
        self.hidden = nn.Sequential(*layers)
        # Without hidden layers there is nothing to skip.
        self.activation, self.skip = activation, skip and bool(hidden)
        self.size = inputs + size * self.skip

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """(n, self.size) for observations (n, size)."""
        hidden: torch.Tensor = self.hidden(observation)
        return torch.cat([hidden, observation], dim=-1) if self.skip else hidden


def linear_layers(modules: Iterable[nn.Module]) -> list[nn.Linear]:
    """The layers that have weights."""
    return [module for module in modules if isinstance(module, nn.Linear)]


def weights_of(layers: Sequence[nn.Linear]) -> tuple[tuple[Floats, ...], tuple[Floats, ...]]:
    """Weights and biases, the first arguments of a :class:`~.agents.Network`."""
    return tuple(_numpy(layer.weight) for layer in layers), tuple(_numpy(layer.bias) for layer in layers)


@torch.no_grad()
def load_weights(layers: Iterable[nn.Linear], network: Network) -> None:
    """Give layers the weights of a network of the same shapes."""
    for layer, weight, bias in zip(layers, network.weights, network.biases, strict=True):
        layer.weight.copy_(torch.from_numpy(weight.copy()))
        layer.bias.copy_(torch.from_numpy(bias.copy()))


class TorchNetwork(nn.Module):
    """A network with its normalization in PyTorch, in the order of :class:`~.agents.Network`."""

    def __init__(self, network: Network) -> None:
        super().__init__()
        self._squash, self._clip, self._normalizes = network.squash, network.clip, network.mean is not None
        self._bound = network.bound
        for name, values in zip(("high", "low", "factor"), network.normalization, strict=True):
            self.register_buffer(name, torch.from_numpy(values.copy()))
        units = [weight.shape[0] for weight in network.weights]
        self.latent = HiddenLayers(network.size, units[:-1], network.activation, network.skip)
        self.head = nn.Linear(self.latent.size, network.action_size)
        load_weights([*linear_layers(self.latent.hidden), self.head], network)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Actions (n, k) within the bound for observations (n, size)."""
        if self._normalizes:
            high, low, factor = (self.get_buffer(name) for name in ("high", "low", "factor"))
            observation = torch.clamp((observation - high - low) * factor, -self._clip, self._clip)
        out: torch.Tensor = self.head(self.latent(observation))
        if self._squash == "tanh":
            return self._bound * torch.tanh(out)
        return torch.clamp(out, -self._bound, self._bound)


class Actor(nn.Module):
    """Deterministic policy: normalization, hidden layers with a skip connection, output layer, scale, tanh.

    Mean and deviation of the observation and the scale of each action (``reach``) are not trained. They give
    the weights a common size, so that one learning rate suits all. They start as 0, 1 and 1.

    Args:
        size: Entries of an observation.
        action_size: Entries of an action.
        hidden: Units of each hidden layer.
        activation: One of :data:`TORCH_ACTIVATIONS`.
    """

    mean: torch.Tensor
    deviation: torch.Tensor
    reach: torch.Tensor

    def __init__(self, size: int, action_size: int, hidden: Sequence[int], activation: str = "elu") -> None:
        super().__init__()
        self.latent = HiddenLayers(size, hidden, activation)
        self.head = nn.Linear(self.latent.size, action_size)
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("deviation", torch.ones(size))
        self.register_buffer("reach", torch.ones(action_size))

    @property
    def layers(self) -> list[nn.Linear]:
        """Hidden layers and output layer."""
        return [*linear_layers(self.latent.hidden), self.head]

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """(n, action_size) in (-1, 1) for observations (n, size)."""
        normalized = (observation - self.mean) / self.deviation
        return torch.tanh(self.reach * self.head(self.latent(normalized)))

    @torch.no_grad()
    def set_normalization(self, mean: torch.Tensor, deviation: torch.Tensor, reach: torch.Tensor) -> None:
        """Set mean and deviation (size,) and scale of actions (action_size,); the policy stays the same.

        Hidden layers that the output layer does not use yet keep their weights, as an initialization.
        """
        first, size = self.layers[0], mean.numel()
        if first is not self.head and self.head.weight[:, :-size].any():
            _rescale_input(first.weight, first.bias, mean, deviation)
        _rescale_input(self.head.weight[:, -size:], self.head.bias, mean, deviation)
        self.head.weight.div_(reach[:, None])
        self.head.bias.div_(reach)
        self.mean.copy_(mean)
        self.deviation.copy_(deviation)
        self.reach.copy_(reach)

    @torch.no_grad()
    def _fold_normalization(self) -> None:
        """Make mean, deviation and scale part of the weights."""
        first, size = self.layers[0], self.mean.numel()
        back = -self.mean / self.deviation, 1.0 / self.deviation
        if first is not self.head:
            _rescale_input(first.weight, first.bias, *back)
        _rescale_input(self.head.weight[:, -size:], self.head.bias, *back)
        self.head.weight.mul_(self.reach[:, None])
        self.head.bias.mul_(self.reach)
        self.mean.zero_()
        self.deviation.fill_(1.0)
        self.reach.fill_(1.0)

    def network(self) -> Network:
        """The same policy in NumPy, with the normalization folded into its weights."""
        plain = copy.deepcopy(self)
        plain._fold_normalization()
        activation: Any = self.latent.activation
        return Network(*weights_of(plain.layers), activation=activation, squash="tanh", skip=True)

    def load(self, network: Network) -> None:
        """Take over the weights of a network.

        Raises:
            DataError: the network has other layers.
        """
        same = network.skip and network.squash == "tanh" and network.mean is None
        same = same and network.activation == self.latent.activation
        if not same or [w.shape for w in network.weights] != [tuple(x.weight.shape) for x in self.layers]:
            raise DataError(
                "initial: the agent's network is built in another way; use its hidden layers and activation, "
                f"which are {[w.shape[0] for w in network.weights[:-1]]} and {network.activation}"
            )
        self._fold_normalization()
        load_weights(self.layers, network)


def _rescale_input(
    weight: torch.Tensor, bias: torch.Tensor, mean: torch.Tensor, deviation: torch.Tensor
) -> None:
    """Make a layer on observations one on (observation - mean) / deviation, in place."""
    bias += weight @ mean
    weight *= deviation


def _numpy(tensor: torch.Tensor) -> Floats:
    array: Floats = tensor.detach().cpu().numpy().copy()
    return array


# Initial policies: linear in the observation.

_SPRINGS: Final = {"carriage": 0.3, "hexapod": 1.0}
"""Natural frequency of spring and damper at the start, rad/s."""

_TURNTABLE_DAMPING: Final = 0.5
"""Of the turntable at the start, 1/s."""


def start_linear(actor: Actor, gains: Floats) -> None:
    """Make an actor linear in the observation: its output layer ignores the hidden ones.

    Args:
        actor: The policy.
        gains: (action_size, size) from the observation to actions before the tanh.
    """
    with torch.no_grad():
        actor.head.weight.zero_()
        actor.head.weight[:, -gains.shape[1] :] = torch.from_numpy(gains)
        actor.head.bias.zero_()


def start_as_spring_damper(actor: Actor, batch: Batch) -> None:
    """Make an actor a critically damped spring to neutral on each axis: acceleration = -w^2 x - 2 w v.

    Training starts with a machine that moves and stays within its travel, so that every gradient is useful.
    """
    layout: Layout = batch.layout
    gains = np.zeros((len(AXES), layout.frame))
    rows = {row.name: row for row in layout.rows}
    for first, position, rate, subsystem in (
        (0, "carriage", "carriage_rate", "carriage"),
        (2, "displacement", "velocity", "hexapod"),
        (5, "beta", "beta_rate", "hexapod"),
    ):
        w = _SPRINGS[subsystem]
        for k in range(rows[position].size):
            gains[first + k, layout.first(position) + k] = -w * w * rows[position].scale
            gains[first + k, layout.first(rate) + k] = -2.0 * w * rows[rate].scale
    gains[8, layout.first("turntable_rate")] = -_TURNTABLE_DAMPING * rows["turntable_rate"].scale
    # As a share of the acceleration that an action of 1 stands for.
    moving = batch.usual_scale > 0.0
    gains[moving] /= batch.usual_scale[moving, None]
    gains[~moving] = 0.0
    start_linear(actor, as_shown(gains, batch))


def as_shown(gains: NDArray[np.float64], batch: Batch) -> Floats:
    """Gains (k, frame) of what a batch shows and takes, for gains (9, frame) in the rows' physical scales."""
    entries = [AXES.index(axis) for axis in batch.options.action.axes]
    return (gains[entries] / batch.layout.gains[: batch.layout.frame]).astype(np.float32)


# Normalization by a rollout. Rows of an observation are scaled to what can happen, and an action of 1 is all
# the machine can do. A good policy's errors are a hundredth of the one, and its actions of the other.

_LEAST_DEVIATION: Final = 0.02
"""Smallest deviation of an observation: what hardly moves under the first policy may move later."""

_LEAST_DEVIATION_OF_MACHINE: Final = 0.3
"""The same of the rows that describe the machine: few machines are met at first."""

_LEAST_REACH: Final = 0.01
"""Smallest scale of an action."""


def normalize_by_rollout(actor: Actor, batch: Batch, actions: int) -> None:
    """Normalize an actor by the observations and actions of a rollout of its own.

    Args:
        actor: The policy, not normalized so far.
        batch: Its environments; they begin anew.
        actions: Length of the rollout.
    """
    everywhere = np.ones(batch.n, dtype=bool)
    batch.begin(everywhere)
    batch.observe(everywhere)
    observations, taken = [], []
    for _ in range(actions):
        observations.append(batch.arrays.observation.pull().copy())
        with torch.no_grad():
            taken.append(actor(torch.from_numpy(observations[-1])).numpy())
        batch.write(taken[-1])
        batch.step()
    machine = {row.name for row in MACHINE}
    least = [
        _LEAST_DEVIATION_OF_MACHINE if row.name in machine else _LEAST_DEVIATION
        for row in batch.layout.rows
        for _ in range(row.size)
    ]
    every = np.tile(least, batch.layout.stack)
    normalize_by(actor, np.concatenate(observations), np.concatenate(taken), every)


def normalize_by(
    actor: Actor, observations: Floats, actions: Floats, least: NDArray[np.float64] | float = _LEAST_DEVIATION
) -> None:
    """Normalize an actor by mean and deviation of observations and the deviation of actions.

    Args:
        actor: The policy, not normalized so far.
        observations: (k, size).
        actions: (k, action_size).
        least: Smallest deviation of an observation, (size,) or one for all.
    """
    deviation = np.maximum(observations.std(axis=0, dtype=np.float64), least)
    reach = np.maximum(actions.std(axis=0, dtype=np.float64), _LEAST_REACH)
    values = observations.mean(axis=0, dtype=np.float64), deviation, reach
    actor.set_normalization(*(torch.from_numpy(value).float() for value in values))
