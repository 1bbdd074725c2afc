"""The search space of a washout: the numbers of a parameter set that have an effect, as a unit cube."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.errors import ConfigurationError
from ...envs.settings import from_dict, to_dict
from ..washout.families import AnyWashout, family_of

Floats = NDArray[np.float64]

_SIGNIFICANT: Final = 5
"""Digits of a parameter that a file needs: 0.001 % is far below what changes J."""


class WashoutSpace:
    """The numbers of a parameter set that have an effect, as a unit cube.

    The orders of the filters, the blocks that are switched off, the start pose and what acts only after a
    limit was met stay those of the set the search begins with; so does the turntable's gain, which
    ``rate_scale`` makes superfluous.

    Args:
        start: The set a search begins with.
    """

    def __init__(self, start: AnyWashout) -> None:
        self.start = start
        self._values = to_dict(start)
        self.coordinates = tuple(c for c in family_of(start).coordinates if _has_effect(self._values, c.path))

    def __len__(self) -> int:
        """How many numbers there are."""
        return len(self.coordinates)

    def encode(self, parameters: AnyWashout) -> Floats:
        """(dimension,) places of a set's values in [0, 1]; values out of range at the nearer end.

        Raises:
            ConfigurationError: the set has a block switched off that the start has.
        """
        values = to_dict(parameters)
        try:
            return np.array([c.place(_get(values, c.path)) for c in self.coordinates])
        except TypeError:
            raise ConfigurationError(
                f"{parameters.name} has other blocks than {self.start.name}; begin with {parameters.name}"
            ) from None

    def decode(self, places: Floats) -> AnyWashout:
        """The parameter set at (dimension,) places in [0, 1]."""
        if np.shape(places) != (len(self),) or not np.isfinite(places).all():
            raise ConfigurationError(f"places must be {len(self)} finite numbers, found {places!r}")
        values = to_dict(self.start)
        for coordinate, place in zip(self.coordinates, places, strict=True):
            _set(values, coordinate.path, coordinate.value(place))
        return from_dict(type(self.start), values, "search space")

    def result(self, places: Floats, name: str, description: str) -> AnyWashout:
        """The set at these places as a file holds it: five digits a number, with a name of its own."""
        values = to_dict(self.decode(places))
        for coordinate in self.coordinates:
            exact = _get(values, coordinate.path)
            _set(values, coordinate.path, float(f"{exact:.{_SIGNIFICANT}g}"))
        return from_dict(type(self.start), values | {"name": name, "description": description}, name)

    def at_bounds(self, parameters: AnyWashout, tolerance: float = 0.01) -> Iterator[str]:
        """Paths whose value lies at an end of its range, where wider bounds might give more."""
        for coordinate, place in zip(self.coordinates, self.encode(parameters), strict=True):
            if not tolerance < place < 1.0 - tolerance:
                yield coordinate.path


def _has_effect(values: dict[str, Any], path: str) -> bool:
    block, _, field = path.rpartition(".")
    if block.startswith(("tilt", "lpc")):
        return values[block.split(".")[0]] is not None
    if field not in ("frequency", "damping"):
        return True
    order = _get(values, f"{block}.order")
    return bool(order >= (1 if field == "frequency" else 2))


def _get(values: Any, path: str) -> Any:
    for part in path.split("."):
        values = values[int(part)] if part.isdigit() else values[part]
    return values


def _set(values: Any, path: str, value: float) -> None:
    parent, _, last = path.rpartition(".")
    inner = _get(values, parent) if parent else values
    inner[int(last) if last.isdigit() else last] = value
