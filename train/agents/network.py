"""A multilayer perceptron in NumPy: the whole of a trained policy, with the normalization of its input."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor, nn

from ...envs.errors import DataError

Array = NDArray[np.float32]
Activation = Literal["tanh", "relu", "elu", "silu"]
Squash = Literal["clip", "tanh"]

EPSILON: Final = 1e-8
"""Added to the variance, as Stable-Baselines3's VecNormalize does."""


# NumPy is quicker with arrays of no dimension than with numbers.
_ZERO: Final = np.zeros((), dtype=np.float32)
_ONE: Final = np.ones((), dtype=np.float32)
_HALF: Final = np.full((), 0.5, dtype=np.float32)


def _elu(x: Array) -> Array:
    return np.maximum(x, _ZERO) + np.expm1(np.minimum(x, _ZERO))


def _silu(x: Array) -> Array:
    # x times the logistic function, which overflows nowhere in this form.
    half = _HALF * x
    silu: Array = half + half * np.tanh(half)
    return silu


def _relu(x: Array) -> Array:
    return np.maximum(x, _ZERO)


ACTIVATIONS: Final[Mapping[str, Callable[[Array], Array]]] = {
    "tanh": np.tanh,
    "relu": _relu,
    "elu": _elu,
    "silu": _silu,
}
"""What each name of an activation computes."""


@dataclass(frozen=True, eq=False)
class Network:
    """From observations to actions in [-1, 1].

    The input is normalized, (x - mean) / sqrt(variance + EPSILON), clipped to +-``clip``, goes through
    hidden layers with the activation and a last linear layer, and is squashed.

    Args:
        weights: (outputs, inputs) of each layer, float32.
        biases: (outputs,) of each layer, float32.
        activation: Of the hidden layers.
        squash: "clip" or "tanh" of the last layer.
        skip: Whether the last layer sees [last hidden layer, normalized observation] instead of the
            hidden layer alone.
        mean: (size,) mean of the observation, float64; None leaves it as it is.
        variance: (size,) its variance; given with ``mean``.
        clip: Largest absolute value of a normalized observation.

    Raises:
        DataError: a shape does not fit, a value is not finite, or a name is unknown.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    activation: Activation = "tanh"
    squash: Squash = "clip"
    skip: bool = False
    mean: NDArray[np.float64] | None = None
    variance: NDArray[np.float64] | None = None
    clip: float = 10.0

    def __post_init__(self) -> None:
        _check_choice("activation", self.activation, get_args(Activation))
        _check_choice("squash", self.squash, get_args(Squash))
        self._take("weights", _arrays("weights", self.weights, 2))
        self._take("biases", _arrays("biases", self.biases, 1))
        if (self.mean is None) != (self.variance is None):
            raise DataError("network: give mean and variance together, or neither")
        for name in ("mean", "variance"):
            if getattr(self, name) is not None:
                self._take(name, _array(name, getattr(self, name), 1, np.float64))
        if not (np.isfinite(self.clip) and self.clip > 0.0):
            raise DataError(f"network: clip must be positive, found {self.clip}")
        self._check_shapes()

    def _take(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _check_shapes(self) -> None:
        if not self.weights or len(self.weights) != len(self.biases):
            raise DataError(
                f"network: {len(self.weights)} weights and {len(self.biases)} biases, expected one for one"
            )
        inputs = self.size
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            extra = self.size if self.skip and k > 0 and k == len(self.weights) - 1 else 0
            if weight.shape[1] != inputs + extra:
                raise DataError(
                    f"network: weights {k} take {weight.shape[1]} inputs, expected {inputs + extra}"
                )
            inputs = weight.shape[0]
            if bias.shape != (inputs,):
                raise DataError(f"network: biases {k} have shape {bias.shape}, expected {(inputs,)}")
        for name in ("mean", "variance"):
            values = getattr(self, name)
            if values is not None and values.shape != (self.size,):
                raise DataError(f"network: {name} has shape {values.shape}, expected {(self.size,)}")
        if self.variance is not None and self.variance.min() < 0.0:
            raise DataError(f"network: variance must not be negative, found {self.variance.min()}")

    @property
    def size(self) -> int:
        """Entries of an observation."""
        return int(self.weights[0].shape[1])

    @property
    def action_size(self) -> int:
        """Entries of an action."""
        return int(self.weights[-1].shape[0])

    @cached_property
    def normalization(self) -> tuple[Array, Array, Array]:
        """(size,) mean, what float32 loses of the mean, and factor.

        Taking the mean off in two parts is as exact as float64: a nearly constant entry has a large factor.
        """
        mean = np.zeros(self.size) if self.mean is None else self.mean
        variance = np.ones(self.size) - EPSILON if self.variance is None else self.variance
        high = mean.astype(np.float32)
        return high, (mean - high).astype(np.float32), (1.0 / np.sqrt(variance + EPSILON)).astype(np.float32)

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        return np.array(-self.clip, dtype=np.float32), np.array(self.clip, dtype=np.float32)

    def __call__(self, observation: ArrayLike) -> Array:
        """Actions (n, action_size) or (action_size,) for observations (n, size) or (size,), unchecked."""
        x = np.asarray(observation, dtype=np.float32)
        if x.ndim == 2 and len(x) == 1:
            # A vector is quicker than a matrix of one row.
            return self._forward(x[0])[None]
        return self._forward(x)

    def _forward(self, x: Array) -> Array:
        x = hidden = self._normalized(x)
        activate = ACTIVATIONS[self.activation]
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            hidden = activate(hidden.dot(weight.T) + bias)
        if self.skip and len(self.weights) > 1:
            hidden = np.concatenate([hidden, x], axis=-1)
        out = hidden.dot(self.weights[-1].T) + self.biases[-1]
        squashed: Array = np.tanh(out) if self.squash == "tanh" else np.minimum(np.maximum(out, -_ONE), _ONE)
        return squashed

    def _normalized(self, x: Array) -> Array:
        if self.mean is None:
            return x
        high, low, factor = self.normalization
        lowest, highest = self._bounds
        normalized: Array = np.minimum(np.maximum((x - high - low) * factor, lowest), highest)
        return normalized


def _check_choice(name: str, value: Any, known: Sequence[str]) -> None:
    if value not in known:
        raise DataError(f"network: {name} must be one of {', '.join(known)}, found {value!r}")


def _arrays(name: str, values: Sequence[ArrayLike], rank: int) -> tuple[NDArray[Any], ...]:
    return tuple(_array(f"{name} {k}", value, rank, np.float32) for k, value in enumerate(values))


def _array(name: str, value: ArrayLike, rank: int, kind: type[np.floating[Any]]) -> NDArray[Any]:
    """A read-only copy of its own."""
    try:
        array = np.array(value, dtype=kind, order="C")
    except (TypeError, ValueError):
        raise DataError(f"network: {name} is not an array of numbers") from None
    if array.ndim != rank or array.size == 0:
        raise DataError(f"network: {name} has shape {array.shape}, expected {rank} dimensions, none empty")
    if not np.isfinite(array).all():
        raise DataError(f"network: {name} is not finite")
    array.setflags(write=False)
    return array


# The network of an agent in PyTorch.


_ACTIVATIONS: Final[Mapping[str, Callable[[Tensor], Tensor]]] = {
    "tanh": torch.tanh,
    "relu": torch.relu,
    "elu": nn.functional.elu,
    "silu": nn.functional.silu,
}


class TorchNetwork(nn.Module):
    """A network with its normalization; see :class:`~.network.Network`.

    Args:
        network: In NumPy.
    """

    def __init__(self, network: Network) -> None:
        super().__init__()
        self._activate = _ACTIVATIONS[network.activation]
        self._squash, self._skip, self._clip = network.squash, network.skip, network.clip
        self._normalizes = network.mean is not None
        for name, values in zip(("high", "low", "factor"), network.normalization, strict=True):
            self.register_buffer(name, torch.from_numpy(values.copy()))
        self.layers = nn.ModuleList(map(_linear, network.weights, network.biases))

    def forward(self, observation: Tensor) -> Tensor:
        """Actions (n, k) in [-1, 1] for observations (n, size)."""
        x = hidden = self._normalized(observation)
        *first, last = self.layers
        for layer in first:
            hidden = self._activate(layer(hidden))
        if self._skip and first:
            hidden = torch.cat([hidden, x], dim=-1)
        out: Tensor = last(hidden)
        return torch.tanh(out) if self._squash == "tanh" else torch.clamp(out, -1.0, 1.0)

    def _normalized(self, x: Tensor) -> Tensor:
        if not self._normalizes:
            return x
        high, low, factor = (self.get_buffer(name) for name in ("high", "low", "factor"))
        return torch.clamp((x - high - low) * factor, -self._clip, self._clip)


def _linear(weight: NDArray[Any], bias: NDArray[Any]) -> nn.Linear:
    layer = nn.Linear(weight.shape[1], weight.shape[0])
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(weight.copy()))
        layer.bias.copy_(torch.from_numpy(bias.copy()))
    return layer
