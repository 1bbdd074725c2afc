"""Networks of agents: their layers, and inference in NumPy.

:class:`Network`, a multilayer perceptron, is the one declaration of a policy's layers, activations and
normalization. ``train/networks.py`` builds the PyTorch forms from it: one to train, one to export.
:class:`~.recurrent.RecurrentNetwork` has LSTM layers before one. NumPy alone runs both, by one interface,
:class:`PolicyNetwork`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

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


def _silu(x: Array) -> Array:
    # x times the logistic function, which overflows nowhere in this form.
    half = _HALF * x
    return np.asarray(half + half * np.tanh(half))


def _silu_slope(x: Array) -> Array:
    logistic = _ONE / (_ONE + np.exp(-x))
    return np.asarray(logistic * (_ONE + x * (_ONE - logistic)))


class ActivationFunctions(NamedTuple):
    """An activation in NumPy, elementwise: the function and its derivative."""

    function: Callable[[Array], Array]
    derivative: Callable[[Array], Array]


ACTIVATIONS: Final[Mapping[str, ActivationFunctions]] = {
    "tanh": ActivationFunctions(np.tanh, lambda x: _ONE - np.tanh(x) ** 2),
    "relu": ActivationFunctions(lambda x: np.maximum(x, _ZERO), lambda x: (x > _ZERO).astype(np.float32)),
    "elu": ActivationFunctions(
        lambda x: np.maximum(x, _ZERO) + np.expm1(np.minimum(x, _ZERO)),
        lambda x: np.exp(np.minimum(x, _ZERO)),
    ),
    "silu": ActivationFunctions(_silu, _silu_slope),
}
"""Activations by name."""


class LstmLayer(NamedTuple):
    """Weights of one LSTM layer, float32; rows of input gate, forget gate, candidate and output gate.

    Args:
        inputs: (4 units, inputs) on the layer's input.
        recurrent: (4 units, units) on its output of the step before.
        bias: (4 units,) of both.
    """

    inputs: Array
    recurrent: Array
    bias: Array

    @property
    def units(self) -> int:
        """Entries of its output."""
        return int(self.recurrent.shape[1])


class PolicyNetwork(ABC):
    """A policy from observations to actions within +-``bound``, with a memory or without one.

    The observation is normalized, (x - mean) / sqrt(variance + EPSILON), and clipped to +-``clip``.

    Attributes:
        mean: (size,) mean of the observation, float64; None leaves it as it is.
        variance: (size,) its variance; given with ``mean``.
        clip: Largest absolute value of a normalized observation.
        bound: Largest absolute value of an action.
        lstm: Layers with a memory; none for a multilayer perceptron.
        head: The multilayer perceptron: all of it, or what follows the layers with a memory.
    """

    mean: NDArray[np.float64] | None
    variance: NDArray[np.float64] | None
    clip: float
    bound: float
    lstm: tuple[LstmLayer, ...]
    head: Network

    @property
    @abstractmethod
    def size(self) -> int:
        """Entries of an observation."""

    @property
    @abstractmethod
    def action_size(self) -> int:
        """Entries of an action."""

    @abstractmethod
    def step(self, observation: ArrayLike, state: Any = None, begins: Any = None) -> tuple[Array, Any]:
        """Actions for observations, unchecked, and the memory after them.

        Args:
            observation: (n, size) or (size,).
            state: What the last call returned, a row an environment; None where all begin.
            begins: (n,) whether an episode begins, before which nothing is remembered; None for nowhere.

        Returns:
            (n, action_size) or (action_size,), and the next state.

        Raises:
            DataError: the state is not one of these environments.
        """

    def acting(self) -> Callable[[ArrayLike], Array]:
        """The policy from the beginning of episodes to their end, with a memory of its own."""
        state: Any = None

        def act(observation: ArrayLike) -> Array:
            nonlocal state
            action, state = self.step(observation, state)
            return action

        return act

    def _take(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _take_normalization(self) -> None:
        """Check mean, variance and clip, and take read-only copies."""
        if (self.mean is None) != (self.variance is None):
            raise DataError("network: give mean and variance together, or neither")
        for name in ("mean", "variance"):
            if getattr(self, name) is not None:
                self._take(name, array_of(name, getattr(self, name), 1, np.float64))
                shape = getattr(self, name).shape
                if shape != (self.size,):
                    raise DataError(f"network: {name} has shape {shape}, expected {(self.size,)}")
        if self.variance is not None and self.variance.min() < 0.0:
            raise DataError(f"network: variance must not be negative, found {self.variance.min()}")
        check_positive("clip", self.clip)

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

    def _normalized(self, x: Array) -> Array:
        if self.mean is None:
            return x
        high, low, factor = self.normalization
        lowest, highest = self._bounds
        normalized: Array = np.minimum(np.maximum((x - high - low) * factor, lowest), highest)
        return normalized


@dataclass(frozen=True, eq=False)
class Network(PolicyNetwork):
    """Multilayer perceptron from observations to actions within +-``bound``.

    The observation is normalized, (x - mean) / sqrt(variance + EPSILON), and clipped to +-``clip``. Hidden
    layers with an activation follow, then a linear output layer. Its output is clipped to the bound, or goes
    through bound tanh(.).

    Args:
        weights: (outputs, inputs) of each layer, float32.
        biases: (outputs,) of each layer, float32.
        activation: Of the hidden layers.
        squash: "clip" or "tanh", of the output layer.
        skip: Skip connection: the output layer takes [last hidden layer, normalized observation] instead of
            the last hidden layer alone.
        mean: (size,) mean of the observation, float64; None leaves it as it is.
        variance: (size,) its variance; given with ``mean``.
        clip: Largest absolute value of a normalized observation.
        bound: Largest absolute value of an action.

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
    bound: float = 1.0

    def __post_init__(self) -> None:
        _check_choice("activation", self.activation, get_args(Activation))
        _check_choice("squash", self.squash, get_args(Squash))
        self._take("weights", _arrays("weights", self.weights, 2))
        self._take("biases", _arrays("biases", self.biases, 1))
        check_positive("bound", self.bound)
        self._check_shapes()
        self._take_normalization()

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

    @property
    def size(self) -> int:
        """Entries of an observation."""
        return int(self.weights[0].shape[1])

    @property
    def action_size(self) -> int:
        """Entries of an action."""
        return int(self.weights[-1].shape[0])

    @property
    def head(self) -> Network:  # type: ignore[override]
        """The network itself."""
        return self

    @property
    def lstm(self) -> tuple[LstmLayer, ...]:  # type: ignore[override]
        """No layers with a memory."""
        return ()

    @cached_property
    def _largest(self) -> Array:
        return np.array(self.bound, dtype=np.float32)

    def __call__(self, observation: ArrayLike) -> Array:
        """Actions (n, action_size) or (action_size,) for observations (n, size) or (size,), unchecked."""
        x = np.asarray(observation, dtype=np.float32)
        if x.ndim == 2 and len(x) == 1:
            # A vector is quicker than a matrix of one row.
            return self._forward(x[0])[None]
        return self._forward(x)

    def step(self, observation: ArrayLike, state: Any = None, begins: Any = None) -> tuple[Array, Any]:
        """The same actions, and the state as it came: there is no memory."""
        return self(observation), state

    def widened(self, places: NDArray[np.intp], size: int) -> Network:
        """The same policy of observations with more entries, which have no effect.

        Args:
            places: (self.size,) where its own entries are in the larger observation.
            size: Entries of that.
        """

        def wide(values: NDArray[Any], fill: float = 0.0) -> NDArray[Any]:
            out = np.full((*values.shape[:-1], size), fill, dtype=values.dtype)
            out[..., places] = values
            return out

        weights = list(self.weights)
        if len(weights) > 1 and self.skip:
            own = weights[-1].shape[1] - self.size
            weights[-1] = np.concatenate((weights[-1][:, :own], wide(weights[-1][:, own:])), axis=1)
        weights[0] = wide(weights[0])
        mean = None if self.mean is None else wide(self.mean)
        variance = None if self.variance is None else wide(self.variance, 1.0)
        return replace(self, weights=tuple(weights), mean=mean, variance=variance)

    def _forward(self, x: Array) -> Array:
        x = hidden = self._normalized(x)
        activate = ACTIVATIONS[self.activation].function
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            hidden = activate(hidden.dot(weight.T) + bias)
        if self.skip and len(self.weights) > 1:
            hidden = np.concatenate([hidden, x], axis=-1)
        out = hidden.dot(self.weights[-1].T) + self.biases[-1]
        largest = self._largest
        if self.squash == "tanh":
            squashed: Array = np.tanh(out) if self.bound == 1.0 else largest * np.tanh(out)
            return squashed
        return np.asarray(np.minimum(np.maximum(out, -largest), largest))


def check_positive(name: str, value: float) -> None:
    """Refuse what is not a positive number."""
    if not (np.isfinite(value) and value > 0.0):
        raise DataError(f"network: {name} must be positive, found {value}")


def _check_choice(name: str, value: Any, known: Sequence[str]) -> None:
    if value not in known:
        raise DataError(f"network: {name} must be one of {', '.join(known)}, found {value!r}")


def _arrays(name: str, values: Sequence[ArrayLike], rank: int) -> tuple[NDArray[Any], ...]:
    return tuple(array_of(f"{name} {k}", value, rank, np.float32) for k, value in enumerate(values))


def array_of(name: str, value: ArrayLike, rank: int, kind: type[np.floating[Any]]) -> NDArray[Any]:
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
