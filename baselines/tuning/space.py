"""The numbers that a search may set in each family of washouts, and their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.errors import ConfigurationError
from ...envs.settings import configuration, from_dict, to_dict
from ..washout.families import AnyWashout, algorithm_of


@configuration
class Coordinate:
    """One number a search may set.

    Args:
        path: Its place in the configuration, as "hps.0.frequency".
        low: Smallest value, in the unit of the parameter.
        high: Largest value.
        log: Whether equal steps are equal factors.
    """

    path: str
    low: float
    high: float
    log: bool = True

    def value(self, place: float) -> float:
        """The value at a place between 0 (``low``) and 1 (``high``)."""
        inside = min(max(float(place), 0.0), 1.0)
        if self.log:
            return float(self.low * (self.high / self.low) ** inside)
        return self.low + (self.high - self.low) * inside

    def place(self, value: float) -> float:
        """Where a value lies; values outside of the range at its nearer end."""
        inside = min(max(value, self.low), self.high)
        if self.log:
            return math.log(inside / self.low) / math.log(self.high / self.low)
        return (inside - self.low) / (self.high - self.low)


_SCALES: Final = (0.2, 1.2)
"""From a fifth of the car's cue to a fifth more than it."""
_FORCE_LIMITS: Final = (0.5, 10.0)
"""From the perception of a force to the limit of a tyre, m/s^2."""
_RATE_LIMITS: Final = (math.radians(3.0), 1.5)
"""From the perception of a rate to what no road asks for, rad/s."""
_DAMPING: Final = (0.4, 2.0)
"""From a quarter of overshoot to two real poles a factor of 14 apart."""
_ROTATION: Final = (0.001, 2.5)
"""rad/s; up to the set of shoarai/washout. The turntable has no end: yaw need not return within a drive."""
_TRANSLATION: Final = (0.03, 2.5)
"""rad/s; up to Reid and Nahon's sets. Below, the machine is not back for what comes half a minute later."""
_HEAVE: Final = (0.1, 10.0)
_ROLL_OFF: Final = (10.0, 200.0)
_TILT: Final = (0.1, 20.0)
"""rad/s; published sets have up to 5, but above that only the limits on rate and acceleration count."""
_TILT_RATE: Final = (math.radians(0.5), math.radians(5.0))
"""Up to the largest limit in use: doi 10.1177/0037549716675955."""
_TILT_ACCELERATION: Final = (math.radians(2.0), math.radians(60.0))
_APPROACH: Final = (0.5, 50.0)
_SPLIT: Final = (0.3, 60.0)


def _axes(path: str, count: int, bounds: tuple[float, float], log: bool = True) -> list[Coordinate]:
    return [Coordinate(path.format(axis), *bounds, log) for axis in range(count)]


_CLASSICAL: Final = (
    *_axes("force_scale.{}", 3, _SCALES, log=False),
    *_axes("rate_scale.{}", 3, _SCALES, log=False),
    *_axes("force_limit.{}", 3, _FORCE_LIMITS),
    *_axes("rate_limit.{}", 3, _RATE_LIMITS),
    *_axes("hpr.{}.frequency", 3, _ROTATION),
    *_axes("hpr.{}.damping", 3, _DAMPING),
    Coordinate("rate_bandwidth", *_ROLL_OFF),
    Coordinate("tilt.low_pass.frequency", *_TILT),
    Coordinate("tilt.low_pass.damping", *_DAMPING),
    Coordinate("tilt.rate", *_TILT_RATE),
    Coordinate("tilt.acceleration", *_TILT_ACCELERATION),
    Coordinate("tilt.approach", *_APPROACH),
    Coordinate("turntable_share", 0.0, 1.0, log=False),
    *_axes("hps.{}.frequency", 2, _TRANSLATION),
    *_axes("hps.{}.damping", 2, _DAMPING),
    *_axes("hpi.{}.frequency", 2, _TRANSLATION),
    *_axes("hpi.{}.damping", 2, _DAMPING),
    Coordinate("hpi.2.frequency", *_HEAVE),
    Coordinate("hpi.2.damping", *_DAMPING),
    Coordinate("lpc.frequency", *_SPLIT),
    Coordinate("lpc.damping", *_DAMPING),
)

_SPEED: Final = (0.001, 10.0)
"""1/s; from a gain that hardly moves in a drive to one that follows every cue."""
_DEPARTURE: Final = (0.03, 3.0)
_TRAVEL: Final = (0.3, 30.0)
"""m; up to where the carriage's ends no longer count."""
_CARRIAGE_SPEED: Final = (0.3, 30.0)
_HEAVE_TRAVEL: Final = (0.02, 2.0)
_ANGLE: Final = (0.02, 100.0)
"""rad; the turntable has no end."""

_ADAPTIVE: Final = (
    *_CLASSICAL,
    *_axes("adaptation.force_speed.{}", 3, _SPEED),
    *_axes("adaptation.rate_speed.{}", 3, _SPEED),
    Coordinate("adaptation.force_departure", *_DEPARTURE),
    Coordinate("adaptation.rate_departure", *_DEPARTURE),
    Coordinate("adaptation.displacement.0", *_TRAVEL),
    Coordinate("adaptation.displacement.1", *_HEAVE_TRAVEL),
    Coordinate("adaptation.velocity.0", *_CARRIAGE_SPEED),
    Coordinate("adaptation.velocity.1", *_HEAVE_TRAVEL),
    *_axes("adaptation.angle.{}", 3, _ANGLE),
)

_BANDWIDTH: Final = (0.03, 10.0)
"""rad/s; from a push that lasts half a minute to the noise of a road."""
_RATE_ERROR: Final = (math.radians(0.3), math.radians(30.0))
"""A tenth of and ten times the indifference zone, beside that of the force, which stays."""
_INTEGRAL: Final = (1.0, 1000.0)
_TILT_SPEED: Final = (math.radians(0.5), 10.0)
_ACCELERATION: Final = (0.3, 100.0)
_TILT_PUSH: Final = (0.03, 30.0)
_HEAVE_INTEGRAL: Final = (0.003, 10.0)
_YAW: Final = (0.3, 1000.0)


def _plane(channel: str) -> list[Coordinate]:
    ranges = {
        "sensed_rate": _RATE_ERROR,
        "integral": _INTEGRAL,
        "displacement": _TRAVEL,
        "velocity": _CARRIAGE_SPEED,
        "tilt_rate": _TILT_SPEED,
        "acceleration": _ACCELERATION,
        "tilt_acceleration": _TILT_PUSH,
    }
    return [Coordinate(f"{channel}.{name}", *bounds) for name, bounds in ranges.items()]


_OPTIMAL: Final = (
    *(c for c in _CLASSICAL if c.path.startswith(("force_", "rate_scale", "rate_limit"))),
    Coordinate("force_bandwidth", *_BANDWIDTH),
    Coordinate("rate_bandwidth", *_BANDWIDTH),
    *_plane("surge"),
    *_plane("sway"),
    Coordinate("heave.integral", *_HEAVE_INTEGRAL),
    Coordinate("heave.displacement", *_HEAVE_TRAVEL),
    Coordinate("heave.velocity", *_HEAVE_TRAVEL),
    Coordinate("heave.acceleration", *_ACCELERATION),
    Coordinate("yaw.angle", *_YAW),
    Coordinate("yaw.rate", *_YAW),
    Coordinate("yaw.acceleration", *_ACCELERATION),
    *(c for c in _CLASSICAL if c.path.startswith(("turntable", "lpc"))),
)

COORDINATES: Final[Mapping[str, tuple[Coordinate, ...]]] = {
    "classical": _CLASSICAL,
    "adaptive": _ADAPTIVE,
    "optimal": _OPTIMAL,
}
"""What a search may set, by algorithm."""

# What a search may change about a washout, and within which bounds: the unit cube and back.


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
        self.coordinates = tuple(
            c for c in COORDINATES[algorithm_of(start)] if _has_effect(self._values, c.path)
        )

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
