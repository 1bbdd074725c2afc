"""Logs of a motion base: what was requested of its actuators or axes, and what sensors measured.

A log is a CSV file with a column ``time_s`` and pairs such as ``leg_1_setpoint_m`` and ``leg_1_sensor_m``,
of any actuators (:data:`~.machines.ACTUATORS`) and axes (:data:`~.machines.AXES`). The end of a name is the
unit. Columns of other names are given by ``signal=column:unit``.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..errors import ConfigurationError, DataError, reason, suggest
from ..limits import read_table_text
from .machines import ACTUATORS, AXES, SUBSYSTEMS

Floats = NDArray[np.float64]

_LENGTHS: Final = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
_ANGLES: Final = {"rad": 1.0, "mrad": 1e-3, "deg": math.radians(1.0)}
_TIMES: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ROTATIONS: Final = ("roll", "pitch", "yaw", "turntable")
"""Channels that are angles."""

CHANNELS: Final[Mapping[str, str]] = {
    name: SUBSYSTEMS[0] if "carriage" in name else SUBSYSTEMS[2] if name == "turntable" else SUBSYSTEMS[1]
    for name in dict.fromkeys((*ACTUATORS, *AXES))
}
"""Actuators and axes that a log may have, each with its subsystem."""

_SIGNALS: Final = ("time", *(f"{name}_{kind}" for name in CHANNELS for kind in ("setpoint", "sensor")))

SHORTEST: Final = 10.0
"""Duration of the shortest log, s."""

_STEPS: Final = (1e-4, 0.05)
"""Time steps of logs that tell a lag, s; longer ones are probably in another unit."""

_JITTER: Final = 0.5
"""Largest deviation of a time step from the usual one, relative; more is a gap."""


@dataclass(frozen=True, eq=False)
class Channel:
    """One actuator or axis.

    Args:
        name: Its name.
        setpoint: (n,) requested, m or rad.
        sensor: (n,) measured, m or rad.
    """

    name: str
    setpoint: Floats
    sensor: Floats

    @property
    def subsystem(self) -> str:
        """Carriage, hexapod or turntable."""
        return CHANNELS[self.name]


@dataclass(frozen=True, eq=False)
class MotionLog:
    """A log of a motion base.

    Args:
        step: Time step, s.
        channels: Of it; at least one.
    """

    step: float
    channels: tuple[Channel, ...]

    @property
    def duration(self) -> float:
        """From the first sample to the last, s."""
        return self.step * (len(self.channels[0].setpoint) - 1)


def units_of(signal: str) -> Mapping[str, float]:
    """Units of a signal, with their SI values; the first is the default."""
    if signal == "time":
        return _TIMES
    return _ANGLES if signal.rpartition("_")[0] in ROTATIONS else _LENGTHS


def parse_motion_columns(texts: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Read ``signal=column`` and ``signal=column:unit`` into column and unit by signal.

    Raises:
        ConfigurationError: a text has no ``=``, or a signal or unit is unknown or given twice.
    """
    found: dict[str, tuple[str, str]] = {}
    for text in texts:
        signal, equals, column = text.partition("=")
        if not equals or not column:
            raise ConfigurationError(f"column {text!r}: expected signal=column or signal=column:unit")
        if signal not in _SIGNALS:
            raise ConfigurationError(f"unknown signal {signal!r}. {suggest(signal, _SIGNALS)}")
        if signal in found:
            raise ConfigurationError(f"column {signal!r} is given twice; name it once")
        name, colon, unit = column.rpartition(":")
        units = units_of(signal)
        if not colon:
            name, unit = column, next(iter(units))
        if unit not in units:
            raise ConfigurationError(f"unit {unit!r} of {signal} is unknown; use one of {', '.join(units)}")
        found[signal] = name, unit
    return found


def read_motion_log(path: str | Path, columns: Mapping[str, tuple[str, str]] | None = None) -> MotionLog:
    """Read a log.

    Args:
        path: CSV file; packed if its name ends in .gz.
        columns: Column and unit by signal, for columns of other names.

    Raises:
        DataError: the file cannot be read, a column is missing or not numeric, the time does not advance in
            even steps, or the log is too short.
    """
    try:
        table = pd.read_csv(io.StringIO(read_table_text(path)), skipinitialspace=True)
    except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise DataError(f"{path}: {reason(error)}") from None
    except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        raise DataError(f"{path}: not a CSV table: {error}") from None
    table.columns = [str(name).strip() for name in table.columns]
    found = _find_columns(path, [str(name) for name in table.columns], columns or {})
    values = {
        signal: _numbers(path, table[column], column) * units_of(signal)[unit]
        for signal, (column, unit) in found.items()
    }
    time, step = _even_time(path, values.pop("time"))
    names = dict.fromkeys(signal.rpartition("_")[0] for signal in values)
    even = time[0] + step * np.arange(len(time))
    channels = []
    for name in names:
        pair = [values[f"{name}_{kind}"] for kind in ("setpoint", "sensor")]
        if name == "turntable":
            # Sensors of a turn begin anew after it.
            pair = [np.unwrap(one) for one in pair]
        channels.append(Channel(name, *(np.interp(even, time, one) for one in pair)))
    return MotionLog(step, tuple(channels))


def _find_columns(
    path: str | Path, names: list[str], given: Mapping[str, tuple[str, str]]
) -> dict[str, tuple[str, str]]:
    found = dict(given)
    for signal, (column, _) in given.items():
        if column not in names:
            raise DataError(f"{path}: there is no column {column!r} for {signal}. {suggest(column, names)}")
    for signal in _SIGNALS:
        for unit in units_of(signal):
            column = f"{signal}_{unit}"
            if signal not in found and column in names:
                found[signal] = column, unit
    if "time" not in found:
        raise DataError(f"{path}: there is no column time_s; name it by time=COLUMN:UNIT")
    for signal in [one for one in found if one != "time"]:
        name, _, kind = signal.rpartition("_")
        other = f"{name}_{'sensor' if kind == 'setpoint' else 'setpoint'}"
        if other not in found:
            raise DataError(f"{path}: there is {signal}, but no {other}; name it by {other}=COLUMN:UNIT")
    if len(found) == 1:
        raise DataError(
            f"{path}: there is no pair of a set-point and a sensor, such as leg_1_setpoint_m and "
            "leg_1_sensor_m; name the columns by leg_1_setpoint=COLUMN:UNIT leg_1_sensor=COLUMN:UNIT"
        )
    return found


def _numbers(path: str | Path, column: pd.Series[float], name: str) -> Floats:
    numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if len(bad):
        raise DataError(
            f"{path}: column {name!r} holds {str(column.iloc[int(bad[0])])!r} at data row {bad[0] + 1}; "
            "every cell must be a finite number"
        )
    return numbers


def _even_time(path: str | Path, time: Floats) -> tuple[Floats, float]:
    """Time stamps, and their step, s."""
    if len(time) < 2:
        raise DataError(f"{path}: the log has {len(time)} rows; it must last at least {SHORTEST:g} s")
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if len(back):
        raise DataError(
            f"{path}: the clock does not advance at data row {back[0] + 2}, {time[back[0]]:.3f} s"
        )
    step = float(np.median(steps))
    if not _STEPS[0] <= step <= _STEPS[1]:
        raise DataError(
            f"{path}: the time step is {step:.3g} s, expected {_STEPS[0]:g} to {_STEPS[1]:g} s; "
            "if the time is in another unit, name it by time=COLUMN:ms"
        )
    gaps = np.flatnonzero(np.abs(steps - step) > _JITTER * step)
    if len(gaps):
        raise DataError(
            f"{path}: the clock jumps by {1e3 * steps[gaps[0]]:.3g} ms at {time[gaps[0]]:.3f} s, where its "
            f"steps are {1e3 * step:.3g} ms; give a log without gaps"
        )
    duration = float(time[-1] - time[0])
    if duration < SHORTEST:
        raise DataError(f"{path}: the log lasts {duration:.3g} s; it must last at least {SHORTEST:g} s")
    return time, duration / (len(time) - 1)
