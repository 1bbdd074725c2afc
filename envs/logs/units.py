"""Units of the signals of a log: as people type them, and as files write them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Final

FORCES: Final = ("force_x", "force_y", "force_z")
"""Specific force along the axes of the device."""

RATES: Final = ("rate_x", "rate_y", "rate_z")
"""Angular velocity about the axes of the device."""

ATTITUDE: Final = ("roll", "pitch")
"""Attitude of the device, which adds gravity to a force without it."""

_FORCE_UNITS: Final = {"m/s2": 1.0, "g": 9.80665, "mg": 9.80665e-3, "ft/s2": 0.3048}
_RATE_UNITS: Final = {"rad/s": 1.0, "deg/s": math.radians(1.0)}
_ANGLE_UNITS: Final = {"rad": 1.0, "deg": math.radians(1.0)}

UNITS: Final[Mapping[str, Mapping[str, float]]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "hhmmss": 1.0},
    **dict.fromkeys(FORCES, _FORCE_UNITS),
    **dict.fromkeys(RATES, _RATE_UNITS),
    "speed": {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704, "kn": 1852.0 / 3600.0},
    "course": _ANGLE_UNITS,
    **dict.fromkeys(ATTITUDE, _ANGLE_UNITS),
}
"""Signals an import knows, each with its units and their SI values; the first unit is the default."""

_SPELLINGS: Final[Mapping[str, str]] = {
    "m/s2": "m/s2 m/s² m/s^2 m/s/s m/sec2 m/sec^2 ms-2 ms^-2 m.s-2 m·s⁻² m*s^-2 m/(s*s) mps2 m/s**2",
    "g": "g gee gn g0 g_n",
    "mg": "mg milli-g",
    "ft/s2": "ft/s2 ft/s^2 ft/s² fps2",
    "rad/s": "rad/s rad/sec rad*s^-1 rads-1 rps radians/s",
    "deg/s": "deg/s °/s º/s dps deg/sec degrees/s degrees/sec deg*s^-1 °/sec grad/s",
    "m/s": "m/s mps m/sec ms-1 m*s^-1 m.s-1",
    "km/h": "km/h kmh kph kmph kmh-1 km/hr km/hour",
    "mph": "mph mi/h miles/h",
    "kn": "kn kt kts knot knots kn/h",
    "rad": "rad radian radians",
    "deg": "deg ° º degree degrees grad",
    "s": "s sec secs second seconds",
    "ms": "ms msec millis milliseconds",
    "us": "us µs μs usec micros microseconds",
    "ns": "ns nsec nanos nanoseconds",
    "hhmmss": "hhmmss hhmmss.ss hhmmss.sss",
}
_KNOWN: Final = {spelling: unit for unit, line in _SPELLINGS.items() for spelling in line.split()}
_OTHERS: Final = {
    "m", "km", "ft", "v", "a", "w", "hz", "rpm", "1/min", "min", "h", "%", "-", "bar", "kpa", "psi", "hpa",
    "c", "°c", "ºc", "f", "k", "nm", "n", "count", "counts", "#", "bool", "enum", "v/v", "lambda", "gear",
    "ut", "µt", "1", "m3", "l", "l/h", "kg", "date", "unix", "utc", "minutes", "mm", "cm", "text", "iso8601",
}  # fmt: skip
"""Units of other quantities, and what stands in a row of units besides."""


def known_unit(text: str) -> str:
    """The unit that a file means by ``text``, or whatever unit of another quantity; empty if it is none."""
    bare = re.sub(r"\s+", "", text).lower()
    return _KNOWN.get(bare, bare if bare in _OTHERS else "")


def unit_of(signal: str, text: str) -> str | None:
    """The unit of ``signal`` that a file means by ``text``; None if it is none of its units."""
    found = known_unit(text)
    return found if found in UNITS[signal] else None
