"""The network of an agent in PyTorch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from .network import Network

_ACTIVATIONS: Final[Mapping[str, Callable[[Tensor], Tensor]]] = {
    "tanh": torch.tanh,
    "relu": torch.relu,
    "elu": nn.functional.elu,
    "silu": nn.functional.silu,
}


class TorchNetwork(nn.Module):
    """A network with its normalisation; see :class:`~.network.Network`.

    Args:
        network: In NumPy.
    """

    def __init__(self, network: Network) -> None:
        super().__init__()
        self._activate = _ACTIVATIONS[network.activation]
        self._squash, self._skip, self._clip = network.squash, network.skip, network.clip
        self._normalises = network.mean is not None
        for name, values in zip(("high", "low", "factor"), network.normalisation, strict=True):
            self.register_buffer(name, torch.from_numpy(values.copy()))
        self.layers = nn.ModuleList(map(_linear, network.weights, network.biases))

    def forward(self, observation: Tensor) -> Tensor:
        """Actions (n, k) in [-1, 1] for observations (n, size)."""
        x = hidden = self._normalised(observation)
        *first, last = self.layers
        for layer in first:
            hidden = self._activate(layer(hidden))
        if self._skip and first:
            hidden = torch.cat([hidden, x], dim=-1)
        out: Tensor = last(hidden)
        return torch.tanh(out) if self._squash == "tanh" else torch.clamp(out, -1.0, 1.0)

    def _normalised(self, x: Tensor) -> Tensor:
        if not self._normalises:
            return x
        high, low, factor = (self.get_buffer(name) for name in ("high", "low", "factor"))
        return torch.clamp((x - high - low) * factor, -self._clip, self._clip)


def _linear(weight: NDArray[Any], bias: NDArray[Any]) -> nn.Linear:
    layer = nn.Linear(weight.shape[1], weight.shape[0])
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(weight.copy()))
        layer.bias.copy_(torch.from_numpy(bias.copy()))
    return layer
