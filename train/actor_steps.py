"""An actor's steps through a drive and the way back, by hand.

For the few rows of a batch this is several times quicker than to build and follow a graph for each step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray
from torch import nn

from .actor import Actor
from .agent.network import ACTIVATIONS

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
