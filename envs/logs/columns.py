"""Import options: which column of a log is which signal, and how it is resampled, filtered and mounted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, field_validator

from ..cues import Floats, read_table
from ..errors import ConfigurationError, DataError, suggest
from ..settings import NonNegative, Positive, Vector3, configuration

Sign = Literal["estimate", "keep", "flip"]


@configuration
class ImportOptions:
    """How a log becomes cues. Angles are in degrees because a person types them."""

    rate_hz: Annotated[float, Field(ge=2.0, le=1000.0)] = 100.0
    """Sample rate of the result, 2 to 1000 Hz: the estimates need signals up to 0.5 Hz, and no device in
    a car gives more than a thousand samples a second."""

    cutoff_hz: Positive = 5.0
    """Cut-off of the zero-phase low-pass on force and rates, Hz. Driving itself ends near 3 Hz;
    what is above is road, engine and the holder of the device. Below half the rate."""

    start_s: NonNegative = 0.0
    """What comes earlier in the log is left out, s from its first stamp."""

    end_s: Positive | None = None
    """What comes later in the log is left out, s from its first stamp."""

    gaps: Literal["refuse", "bridge"] = "refuse"
    """Refuse missing data (long steps, repeated stamps, empty cells), or bridge it by interpolation."""

    longest_step_s: Positive = 0.2
    """A longer step between samples is a gap, s."""

    longest_gap_s: Positive = 2.0
    """A longer gap is refused even when bridging, s."""

    standstill_m_s: NonNegative = 0.3
    """The car counts as standing below this speed, m/s."""

    roll_deg: float | None = None
    """Roll of the device in the car, right side down positive; estimated from gravity if not given."""

    pitch_deg: float | None = None
    """Pitch of the device in the car, nose up positive; estimated from gravity if not given."""

    yaw_deg: float | None = None
    """Yaw of the device in the car, to the right positive; estimated from dv/dt and v r if not given."""

    lateral_sign: Sign = "estimate"
    """Whether the lateral axis is mirrored (left-handed force axes); estimated from v r."""

    rate_sign: Sign = "estimate"
    """Whether the angular rates are reversed; estimated from the course, if there is one."""

    gravity_m_s2: Positive | None = None
    """Gravity as the device measures it; estimated if not given. The difference to 9.81 is taken as a
    bias of the vertical axis."""

    rate_bias_deg_s: Vector3 | None = None
    """Bias of the rates about the car's axes; estimated if not given."""

    speed_delay_s: float | None = None
    """How long the speed lags behind the force; estimated if not given, s."""

    @field_validator("cutoff_hz")
    @classmethod
    def _below_half_the_rate(cls, cutoff_hz: float, info: ValidationInfo) -> float:
        # A rate that is itself wrong is missing here, and is reported on its own.
        rate_hz = info.data.get("rate_hz")
        if rate_hz is not None and cutoff_hz >= 0.5 * rate_hz:
            raise ValueError(f"must be below half of rate_hz, {0.5 * rate_hz:g} Hz")
        return cutoff_hz


# Columns: signal, unit and sign.


FORCES: Final = ("force_x", "force_y", "force_z")
"""Specific force along the axes of the device."""

RATES: Final = ("rate_x", "rate_y", "rate_z")
"""Angular velocity about the axes of the device."""

_FORCE_UNITS: Final = {"m/s2": 1.0, "g": 9.80665}
_RATE_UNITS: Final = {"rad/s": 1.0, "deg/s": math.radians(1.0)}

UNITS: Final[Mapping[str, Mapping[str, float]]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    **dict.fromkeys(FORCES, _FORCE_UNITS),
    **dict.fromkeys(RATES, _RATE_UNITS),
    "speed": {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704},
    "course": {"rad": 1.0, "deg": math.radians(1.0)},
}
"""Signals an import knows, each with its units and their SI values; the first unit is the default."""

REQUIRED: Final = ("time", *FORCES, *RATES)
"""Signals an import cannot do without."""


@dataclass(frozen=True)
class RawLog:
    """Signals of a log in SI units, as recorded.

    Attributes:
        time: (n,) s, starting at 0; may be broken in every way a log can be.
        signals: Each (n,), SI units, device axes; NaN where a cell was empty.
        rows: (n,) number of each data row in the file, from 1, for messages.
    """

    time: Floats
    signals: Mapping[str, Floats]
    rows: NDArray[np.intp]


def parse_columns(texts: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Read ``signal=column`` and ``signal=column:unit`` into columns and units by signal.

    Raises:
        ConfigurationError: a text has no ``=``, or a signal is unknown or given twice.
    """
    columns: dict[str, str] = {}
    units: dict[str, str] = {}
    for text in texts:
        signal, equals, column = text.partition("=")
        if not equals or not column:
            raise ConfigurationError(f"column {text!r}: expected signal=column or signal=column:unit")
        _check_signal(signal)
        if signal in columns:
            raise ConfigurationError(f"column {signal!r} is given twice; name it once")
        name, colon, unit = column.rpartition(":")
        columns[signal] = name if colon else column
        if colon:
            units[signal] = unit
    return columns, units


def read_log(path: str | Path, columns: Mapping[str, str], units: Mapping[str, str]) -> RawLog:
    """Read the named columns of a CSV file and convert them to SI units.

    Args:
        path: A CSV file with a header row; ``.csv.gz`` is unpacked.
        columns: Column of each signal. A leading ``-`` reverses it; a number instead of a
            column stands for a constant, in the same unit.
        units: Unit of each signal; SI where none is given.

    Raises:
        ConfigurationError: a signal or unit is unknown, or a required signal has no column.
        DataError: the file cannot be read, or a column is missing or holds text.
    """
    factors = _factors(columns, units)
    table = read_table(path, sorted({_bare(c) for c in columns.values() if _constant(c) is None}))
    n = len(next(iter(table.values())))

    def signal(name: str) -> Floats:
        column = columns[name]
        constant = _constant(column)
        values = table[_bare(column)] if constant is None else np.full(n, constant)
        return values * (-factors[name] if constant is None and column.startswith("-") else factors[name])

    stamps = table[_bare(columns["time"])]
    if not np.any(np.isfinite(stamps)):
        raise DataError(f"{path}: column {columns['time']} holds no time stamp")
    # Subtracting before scaling keeps the digits of stamps counted from 1970.
    time = (stamps - stamps[np.isfinite(stamps)][0]) * factors["time"]
    signals = {name: signal(name) for name in columns if name != "time"}
    return RawLog(time, signals, np.arange(1, n + 1))


def _factors(columns: Mapping[str, str], units: Mapping[str, str]) -> dict[str, float]:
    for name in (*columns, *units):
        _check_signal(name)
    missing = [name for name in REQUIRED if name not in columns]
    if missing:
        raise ConfigurationError(
            f"no column for {', '.join(missing)}; name one with signal=column, or give a constant"
        )
    if _constant(columns["time"]) is not None or columns["time"].startswith("-"):
        raise ConfigurationError(f"time={columns['time']}: time has to be a column as it stands")
    return {name: _factor(name, units.get(name)) for name in columns}


def _factor(signal: str, unit: str | None) -> float:
    known = UNITS[signal]
    if unit is None:
        return next(iter(known.values()))
    if unit not in known:
        raise ConfigurationError(f"unit {unit!r} of {signal} is unknown; use {' or '.join(known)}")
    return known[unit]


def _check_signal(signal: str) -> None:
    if signal not in UNITS:
        raise ConfigurationError(f"unknown signal {signal!r}. {suggest(signal, UNITS)}")


def _bare(column: str) -> str:
    return column.removeprefix("-")


def _constant(column: str) -> float | None:
    try:
        value = float(column)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
