"""The network that training moves: its last layer sees the hidden ones and the observation itself."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from ..envs.errors import DataError
from ..envs.platform.kernels.step import AXES
from ..envs.task.batch import Batch
from ..envs.task.observation import MACHINE, Layout
from .agents import Network
from .agents.network import ACTIVATIONS

TORCH_ACTIVATIONS: Final[dict[str, type[nn.Module]]] = {
    "tanh": nn.Tanh,
    "relu": nn.ReLU,
    "elu": nn.ELU,
    "silu": nn.SiLU,
}
"""Names of activations."""

_SPRINGS: Final = {"carriage": 0.3, "hexapod": 1.0}
"""Natural frequency of the spring and damper a training begins with, rad/s."""

_TURNTABLE_DAMPING: Final = 0.5
"""Of the turntable at the beginning, 1/s."""


class Latent(nn.Module):
    """[last hidden layer, observation]: what the last layer sees.

    Args:
        size: Entries of an observation.
        hidden: Entries of each hidden layer.
        activation: One of :data:`TORCH_ACTIVATIONS`.
    """

    def __init__(self, size: int, hidden: Sequence[int], activation: str) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        inputs = size
        for outputs in hidden:
            layers += [nn.Linear(inputs, outputs), TORCH_ACTIVATIONS[activation]()]
            inputs = outputs
        self.hidden = nn.Sequential(*layers)
        self.activation = activation
        self.size = inputs + size

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """(n, self.size) for observations (n, size)."""
        return torch.cat([self.hidden(observation), observation], dim=-1)


class Actor(nn.Module):
    """Observation -> standardized -> hidden layers -> [hidden, standardized] -> linear -> reach -> tanh.

    Mean and deviation of the observation and the reach of each action are no weights: they give the weights a
    scale that a learning rate can be chosen for. Until :meth:`standardize` they change nothing.

    Args:
        size: Entries of an observation.
        action_size: Entries of an action.
        hidden: Entries of each hidden layer.
        activation: One of :data:`TORCH_ACTIVATIONS`.
    """

    mean: torch.Tensor
    deviation: torch.Tensor
    reach: torch.Tensor

    def __init__(self, size: int, action_size: int, hidden: Sequence[int], activation: str = "elu") -> None:
        super().__init__()
        self.latent = Latent(size, hidden, activation)
        self.head = nn.Linear(self.latent.size, action_size)
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("deviation", torch.ones(size))
        self.register_buffer("reach", torch.ones(action_size))

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """(n, action_size) in (-1, 1) for observations (n, size)."""
        standard = (observation - self.mean) / self.deviation
        action: torch.Tensor = torch.tanh(self.reach * self.head(self.latent(standard)))
        return action

    @torch.no_grad()
    def standardize(self, mean: torch.Tensor, deviation: torch.Tensor, reach: torch.Tensor) -> None:
        """Take a standard of observations (size,) and actions (action_size,); what is done stays the same.

        Only hidden layers that the last one does not listen to keep their weights: theirs is a beginning.
        """
        first, size = self._linear[0], mean.numel()
        if first is not self.head and self.head.weight[:, :-size].any():
            _see_relative(first.weight, first.bias, mean, deviation)
        _see_relative(self.head.weight[:, -size:], self.head.bias, mean, deviation)
        self.head.weight.div_(reach[:, None])
        self.head.bias.div_(reach)
        self.mean.copy_(mean)
        self.deviation.copy_(deviation)
        self.reach.copy_(reach)

    def network(self) -> Network:
        """The same in NumPy, its standard within its weights."""
        plain = copy.deepcopy(self)
        plain._forget_standard()
        return Network(
            weights=tuple(_numpy(layer.weight) for layer in plain._linear),
            biases=tuple(_numpy(layer.bias) for layer in plain._linear),
            activation=self.latent.activation,  # type: ignore[arg-type]
            squash="tanh",
            skip=True,
        )

    @torch.no_grad()
    def _forget_standard(self) -> None:
        """Make mean, deviation and reach part of the weights."""
        first, size = self._linear[0], self.mean.numel()
        back = -self.mean / self.deviation, 1.0 / self.deviation
        if first is not self.head:
            _see_relative(first.weight, first.bias, *back)
        _see_relative(self.head.weight[:, -size:], self.head.bias, *back)
        self.head.weight.mul_(self.reach[:, None])
        self.head.bias.mul_(self.reach)
        self.mean.zero_()
        self.deviation.fill_(1.0)
        self.reach.fill_(1.0)

    def load(self, network: Network) -> None:
        """Take over the weights of a network.

        Raises:
            DataError: the network is built in another way.
        """
        same = network.skip and network.squash == "tanh" and network.mean is None
        same = same and network.activation == self.latent.activation
        if not same or [w.shape for w in network.weights] != [tuple(x.weight.shape) for x in self._linear]:
            raise DataError(
                "initial: the agent's network is built in another way; use its hidden layers and activation, "
                f"which are {[w.shape[0] for w in network.weights[:-1]]} and {network.activation}"
            )
        with torch.no_grad():
            self._forget_standard()
            for layer, weight, bias in zip(self._linear, network.weights, network.biases, strict=True):
                layer.weight.copy_(torch.from_numpy(weight.copy()))
                layer.bias.copy_(torch.from_numpy(bias.copy()))

    @property
    def _linear(self) -> list[nn.Linear]:
        return [layer for layer in self.latent.hidden if isinstance(layer, nn.Linear)] + [self.head]


def begin_at_rest(actor: Actor, batch: Batch) -> None:
    """Make an actor a spring and damper to neutral, and nothing else.

    So a training begins with a machine that stays in its travel, and moves at all: every gradient is useful.
    """
    begin_as(actor, _springs(batch.layout, batch.usual_scale))


def begin_as(actor: Actor, gains: NDArray[np.float32]) -> None:
    """Make an actor linear in the observation; its last layer does not listen to the hidden ones.

    Args:
        actor: The network.
        gains: (action_size, size) of its last layer on the observation.
    """
    with torch.no_grad():
        actor.head.weight.zero_()
        actor.head.weight[:, -gains.shape[1] :] = torch.from_numpy(gains)
        actor.head.bias.zero_()


def _springs(layout: Layout, scale: NDArray[np.float64]) -> NDArray[np.float32]:
    """(9, frame) -w^2 x - 2 w v of each axis, as a share of its largest acceleration."""
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
    moving = scale > 0.0
    gains[moving] /= scale[moving, None]
    gains[~moving] = 0.0
    return gains.astype(np.float32)


def _see_relative(
    weight: torch.Tensor, bias: torch.Tensor, mean: torch.Tensor, deviation: torch.Tensor
) -> None:
    """Make a layer on observations one on (observation - mean) / deviation, in place."""
    bias += weight @ mean
    weight *= deviation


def _numpy(tensor: torch.Tensor) -> NDArray[np.float32]:
    array: NDArray[np.float32] = tensor.detach().cpu().numpy().copy()
    return array


# An actor's steps through a drive and the way back, by hand.
#
# For the few rows of a batch this is several times quicker than to build and follow a graph for each step.


Floats = NDArray[np.float32]

_ONE: Final = np.ones((), dtype=np.float32)
_ZERO: Final = np.zeros((), dtype=np.float32)


def _slope_of_silu(x: Floats) -> Floats:
    logistic = _ONE / (_ONE + np.exp(-x))
    return np.asarray(logistic * (_ONE + x * (_ONE - logistic)))


_SLOPES: Final[dict[str, Callable[[Floats], Floats]]] = {
    "tanh": lambda x: _ONE - np.tanh(x) ** 2,
    "relu": lambda x: (x > _ZERO).astype(np.float32),
    "elu": lambda x: np.exp(np.minimum(x, _ZERO)),
    "silu": _slope_of_silu,
}
"""Derivative of each activation."""


class ActorSteps:
    """The steps of an actor, whose weights stay as they are meanwhile.

    Args:
        actor: The network.
    """

    def __init__(self, actor: Actor) -> None:
        layers = [layer for layer in actor.latent.hidden if isinstance(layer, nn.Linear)]
        self._weights = [layer.weight.detach().numpy() for layer in layers]
        self._biases = [layer.bias.detach().numpy() for layer in layers]
        self._mean, self._factor = actor.mean.numpy(), 1.0 / actor.deviation.numpy()
        reach = actor.reach.numpy()
        head = actor.head.weight.detach().numpy() * reach[:, None]
        size = len(self._mean)
        self._of_hidden, self._of_seen = head[:, :-size], head[:, -size:]
        self._head_bias = actor.head.bias.detach().numpy() * reach
        self._activate, self._slope = ACTIVATIONS[actor.latent.activation], _SLOPES[actor.latent.activation]
        self._steps: list[tuple[list[Floats], Floats]] = []

    def act(self, observation: Floats) -> Floats:
        """(n, action_size) for observations (n, size); the step is kept for :meth:`back`."""
        seen = hidden = (observation - self._mean) * self._factor
        before = []
        for weight, bias in zip(self._weights, self._biases, strict=True):
            before.append(hidden @ weight.T + bias)
            hidden = self._activate(before[-1])
        out = seen @ self._of_seen.T + self._head_bias
        if before:
            out = out + hidden @ self._of_hidden.T
        action: Floats = np.tanh(out)
        self._steps.append((before, action))
        return action

    def back(self, gradient: Floats) -> Floats:
        """(n, size) gradient with respect to what was seen, of the last step that is kept, which goes.

        Args:
            gradient: (n, action_size) with respect to its action.
        """
        before, action = self._steps.pop()
        of_out = gradient * (_ONE - action * action)
        of_seen = of_out @ self._of_seen
        if before:
            of_hidden = of_out @ self._of_hidden
            for weight, x in zip(reversed(self._weights), reversed(before), strict=True):
                of_hidden = (of_hidden * self._slope(x)) @ weight
            of_seen = of_seen + of_hidden
        found: Floats = of_seen * self._factor
        return found


# Observations and actions relative to what they are under a first policy, as a network learns best.
#
# The rows of an observation have the scale of what can happen, and an action of 1 is all the machine
# can do; a
# good policy's errors are a hundredth of the one, and its actions of the other.


_LEAST_SEEN: Final = 0.02
"""Smallest deviation of an observation: what hardly moves under the first policy may move later."""

_LEAST_TOLD: Final = 0.3
"""The same of what a machine can do: few are met at first, and others are met later."""

_LEAST_DONE: Final = 0.01
"""Smallest reach of an action."""


def standardize(actor: Actor, batch: Batch, actions: int) -> None:
    """Give an actor the standard of what it sees and does as it is.

    Args:
        actor: The network, without a standard so far.
        batch: Its environments; they begin anew.
        actions: How many are taken in each.
    """
    everywhere = np.ones(batch.n, dtype=bool)
    batch.begin(everywhere)
    batch.observe(everywhere)
    seen, done = [], []
    for _ in range(actions):
        seen.append(batch.arrays.observation.pull().copy())
        with torch.no_grad():
            done.append(actor(torch.from_numpy(seen[-1])).numpy())
        batch.write(done[-1])
        batch.step()
    take_standard(actor, np.concatenate(seen), np.concatenate(done), _least_seen(batch.layout))


def _least_seen(layout: Layout) -> NDArray[np.float64]:
    """(size,) smallest deviation of each entry."""
    told = {row.name for row in MACHINE}
    frame = [_LEAST_TOLD if row.name in told else _LEAST_SEEN for row in layout.rows for _ in range(row.size)]
    return np.tile(frame, layout.stack)


def take_standard(
    actor: Actor, seen: Floats, done: Floats, least: NDArray[np.float64] | float = _LEAST_SEEN
) -> None:
    """Give an actor the standard of what is seen and done in a drive.

    Args:
        actor: The network, without a standard so far.
        seen: (k, size) observations.
        done: (k, action_size) actions.
        least: Smallest deviation of what is seen, (size,) or one for all.
    """
    mean, deviation = seen.mean(axis=0, dtype=np.float64), seen.std(axis=0, dtype=np.float64)
    reach = np.maximum(done.std(axis=0, dtype=np.float64), _LEAST_DONE)
    standard = mean, np.maximum(deviation, least), reach
    actor.standardize(*(torch.from_numpy(x).float() for x in standard))
