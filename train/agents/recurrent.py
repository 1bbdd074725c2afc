"""A network with a memory: LSTM layers before a multilayer perceptron, in NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...baselines.policy import wrong_state
from ...envs.errors import DataError
from .network import Array, LstmLayer, Network, PolicyNetwork, array_of

_HALF: Final = np.full((), 0.5, dtype=np.float32)
_GATES: Final = 4


@dataclass(frozen=True, eq=False)
class RecurrentNetwork(PolicyNetwork):
    """LSTM layers (Hochreiter and Schmidhuber 1997, with forget gates as in PyTorch), then a network.

    Its state is an array with a row an environment: output and cell of the first layer, of the second, and
    so on. It is zero where an episode begins.

    Args:
        lstm: The layers, first to last.
        head: From the last layer's output to the action; it normalizes nothing.
        mean: See :class:`~.network.PolicyNetwork`, as the following.
        variance: Given with ``mean``.
        clip: Of the normalized observation.

    Raises:
        DataError: a shape does not fit, or a value is not finite.
    """

    lstm: tuple[LstmLayer, ...]
    head: Network
    mean: NDArray[np.float64] | None = None
    variance: NDArray[np.float64] | None = None
    clip: float = 10.0

    def __post_init__(self) -> None:
        layers = [
            LstmLayer(
                array_of(f"lstm {k} inputs", layer.inputs, 2, np.float32),
                array_of(f"lstm {k} recurrent", layer.recurrent, 2, np.float32),
                array_of(f"lstm {k} bias", layer.bias, 1, np.float32),
            )
            for k, layer in enumerate(self.lstm)
        ]
        self._take("lstm", tuple(layers))
        self._check_shapes()
        self._take_normalization()

    def _check_shapes(self) -> None:
        if not self.lstm:
            raise DataError("network: a recurrent one needs an LSTM layer")
        inputs = self.size
        for k, layer in enumerate(self.lstm):
            rows = _GATES * layer.units
            expected = LstmLayer((rows, inputs), (rows, layer.units), (rows,))  # type: ignore[arg-type]
            for name, values, shape in zip(LstmLayer._fields, layer, expected, strict=True):
                if values.shape != shape:
                    raise DataError(f"network: lstm {k} {name} has shape {values.shape}, expected {shape}")
            inputs = layer.units
        if self.head.size != inputs or self.head.mean is not None:
            raise DataError(
                f"network: its head takes {self.head.size} inputs, expected {inputs}, not normalized"
            )

    @property
    def size(self) -> int:
        """Entries of an observation."""
        return int(self.lstm[0].inputs.shape[1])

    @property
    def action_size(self) -> int:
        """Entries of an action."""
        return self.head.action_size

    @property
    def bound(self) -> float:  # type: ignore[override]
        """Largest absolute value of an action."""
        return self.head.bound

    @property
    def memory(self) -> int:
        """Entries of an environment's state."""
        return sum(2 * layer.units for layer in self.lstm)

    def step(self, observation: ArrayLike, state: Any = None, begins: Any = None) -> tuple[Array, Any]:
        """Actions, and the memory after them; see :class:`~.network.PolicyNetwork`."""
        x = self._normalized(np.asarray(observation, dtype=np.float32))
        before = self._remembered(state, begins, x.shape[:-1])
        after, first = np.empty_like(before), 0
        for layer in self.lstm:
            n = layer.units
            output, cell = before[..., first : first + n], before[..., first + n : first + 2 * n]
            gates = x.dot(layer.inputs.T) + output.dot(layer.recurrent.T) + layer.bias
            enter, keep, show = (_logistic(gates[..., k * n : (k + 1) * n]) for k in (0, 1, 3))
            cell = keep * cell + enter * np.tanh(gates[..., 2 * n : 3 * n])
            x = show * np.tanh(cell)
            after[..., first : first + n], after[..., first + n : first + 2 * n] = x, cell
            first += 2 * n
        return self.head(x), after

    def _remembered(self, state: Any, begins: Any, rows: tuple[int, ...]) -> Array:
        """The state, zero where an episode begins."""
        shape = (*rows, self.memory)
        if state is None:
            return np.zeros(shape, dtype=np.float32)
        if not isinstance(state, np.ndarray) or state.shape != shape:
            raise wrong_state(state, int(np.prod(rows)))
        if begins is None or not np.any(begins):
            return state
        fresh: Array = np.where(np.reshape(begins, (*rows, 1)), np.float32(0.0), state)
        return fresh


def _logistic(x: Array) -> Array:
    # This form overflows nowhere.
    return np.asarray(_HALF + _HALF * np.tanh(_HALF * x))
