"""How a learning rate goes over a training."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import torch
from torch import nn

from .networks import Actor

_WARM_UP: Final = 0.1
"""Share of the training in which the learning rate rises."""

_LAST: Final = 0.02
"""Learning rate at the beginning and the end, as a share of the largest."""


def warm_cosine(done: float) -> float:
    """Share of the largest learning rate: a linear rise in the first tenth, then half a cosine.

    Args:
        done: Share of the training.
    """
    done = min(done, 1.0)
    if done < _WARM_UP:
        return max(done / _WARM_UP, _LAST)
    turn = math.pi * (done - _WARM_UP) / (1.0 - _WARM_UP)
    return _LAST + (1.0 - _LAST) * 0.5 * (1.0 + math.cos(turn))


# Steps of a policy's weights along a gradient: hidden layers by Muon, all else by Adam.
#
# Muon (Jordan et al. 2024) turns the gradient of a layer's matrix into the nearest one that changes
# every input
# by the same amount: a step has its size in each direction, not only in those few in which the cost is steep.


class Descent:
    """The optimizers of an actor.

    Args:
        actor: Whose weights move.
        learning_rate: Largest, of Adam.
        hidden_rate: Largest step of a hidden layer's matrix, in its spectral norm; None leaves them to Adam.
        max_grad_norm: Longer gradients are shortened to it.
    """

    def __init__(
        self, actor: Actor, learning_rate: float, hidden_rate: float | None, max_grad_norm: float
    ) -> None:
        self._actor, self._max_grad_norm = actor, max_grad_norm
        hidden = [] if hidden_rate is None else [layer.weight for layer in _linear(actor.latent.hidden)]
        apart = {id(weight) for weight in hidden}
        rest = [weight for weight in actor.parameters() if id(weight) not in apart]
        self._optimizers: list[tuple[torch.optim.Optimizer, float]] = [
            (torch.optim.Adam(rest, lr=learning_rate), learning_rate)
        ]
        if hidden and hidden_rate is not None:
            muon = torch.optim.Muon(hidden, lr=hidden_rate, weight_decay=0.0)
            self._optimizers.append((muon, hidden_rate))

    @property
    def learning_rate(self) -> float:
        """Of Adam in the last step."""
        return float(self._optimizers[0][0].param_groups[0]["lr"])

    def forget(self) -> None:
        """Set gradients to zero."""
        for optimizer, _ in self._optimizers:
            optimizer.zero_grad()

    def clip(self) -> float:
        """Shorten the gradient; returns its length before."""
        return float(nn.utils.clip_grad_norm_(self._actor.parameters(), self._max_grad_norm))

    def step(self, done: float) -> None:
        """A step along the gradient, after a share ``done`` of the training."""
        for optimizer, largest in self._optimizers:
            for group in optimizer.param_groups:
                group["lr"] = largest * warm_cosine(done)
            optimizer.step()

    def state(self) -> list[dict[str, Any]]:
        """Everything that changes."""
        return [optimizer.state_dict() for optimizer, _ in self._optimizers]

    def restore(self, state: list[Mapping[str, Any]]) -> None:
        """Go on from a state."""
        for (optimizer, _), own in zip(self._optimizers, state, strict=True):
            optimizer.load_state_dict(dict(own))


def _linear(layers: nn.Sequential) -> list[nn.Linear]:
    return [layer for layer in layers if isinstance(layer, nn.Linear)]
