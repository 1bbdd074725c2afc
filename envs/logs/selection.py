"""From a recording to the signals of an import: columns given or proposed, in SI units, clock by clock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..cues import Floats
from ..errors import ConfigurationError, DataError
from .proposal import Proposal, propose
from .readers.recording import Column, Recording, Table
from .signals import RawLog, check_signal
from .units import FORCES, RATES, UNITS, unit_of

NOWHERE = "none"
"""Column of a signal that shall not be taken from the log."""

_NO_SPEED = -1.0
"""What receivers without a fix give for the speed, where it is the only negative value."""

_NO_VALUES = {
    999.0,
    9999.0,
    99999.0,
    999999.0,
    999.9,
    9999.9,
    32767.0,
    32768.0,
    65535.0,
    2147483647.0,
    2147483648.0,
}
_HUGE = 1e20
"""Sizes of numbers that stand for no value; so does everything that is larger than this."""

_FAR = 5.0
"""Such a number exceeds the 99th percentile of the others by this factor."""


def selected(
    recording: Recording,
    columns: Mapping[str, str],
    units: Mapping[str, str],
    required: tuple[str, ...],
    unused: tuple[str, ...] = (),
) -> Proposal:
    """The columns that an import takes: those given, and the log's own for what is missing.

    Where all required signals are given, no others are added.

    Args:
        recording: From a reader.
        columns: Column, constant, or ``none``, of each signal that is given.
        units: Of signals that are given.
        required: Signals an import cannot do without.
        unused: Signals that are computed, and never taken from the log.

    Raises:
        ConfigurationError: a signal or a unit is unknown, or a required signal is nowhere.
    """
    for name in (*columns, *units):
        check_signal(name)
    timed = any(table.time for table in recording.tables)
    required = tuple(name for name in required if not (timed and name == "time"))
    whole = all(name in columns for name in required)
    proposed = Proposal({}, {}, {}) if whole else propose(recording)
    names = [name for name in UNITS if name in columns or name in proposed.columns]
    names = [name for name in names if name not in unused and columns.get(name) != NOWHERE]
    missing = [name for name in required if name not in names]
    if missing:
        raise ConfigurationError(
            f"no column for {', '.join(missing)}; name one with signal=column, or give a constant"
            + _remedies(missing, {*columns, *proposed.columns})
        )
    taken = {name: columns.get(name, proposed.columns.get(name, "")) for name in names}
    if "time" in columns and (_constant(taken["time"]) is not None or taken["time"].startswith("-")):
        raise ConfigurationError(f"time={columns['time']}: time has to be a column as it stands")
    chosen: dict[str, str] = {}
    for name in names:
        if name in units:
            chosen[name] = _checked_unit(name, units[name])
        elif name not in columns and name in proposed.units:
            chosen[name] = proposed.units[name]
    return Proposal(taken, chosen, {n: text for n, text in proposed.reasons.items() if n not in columns})


def _remedies(missing: list[str], present: set[str]) -> str:
    """Options that do without the missing signals, as the end of a message."""
    remedies = []
    if set(missing) <= set(RATES):
        remedies += ["rates='from-course'"] * ("course" in present)
        remedies += ["rates='from-force'"] * ("speed" in present)
    elif set(missing) <= set(FORCES) and "speed" in present:
        remedies.append("force='from-speed'")
    return f"; or set {' or '.join(remedies)}" if remedies else ""


def take(recording: Recording, selection: Proposal, path: str | Path) -> list[RawLog]:
    """The signals of the selected columns in SI units, one log for each clock; the first has the force.

    Raises:
        DataError: a column is missing, holds text, or has no clock.
    """
    groups: dict[str, dict[str, tuple[Table, Column]]] = {}
    constants: dict[str, float] = {}
    for signal, name in selection.columns.items():
        constant = _constant(name)
        if constant is not None:
            constants[signal] = constant * _factor(signal, selection.units.get(signal))
            continue
        table, column = recording.find(_bare(name), path)
        if column.fault:
            raise DataError(column.fault)
        groups.setdefault(table.name, {})[signal] = (table, column)
    logs = [_raw_log(found, selection, path, len(groups)) for found in groups.values()]
    # Each clock counts from its own first stamp; together they count from the earliest of all.
    start = min(log.first_stamp_s for log in logs)
    several = len(logs) > 1
    if several:
        logs = [replace(log, time=log.time + log.first_stamp_s - start) for log in logs]
    logs.sort(key=lambda log: not any(name.startswith("force") for name in log.signals))
    held = {name: np.full(len(logs[0].time), value) for name, value in constants.items()}
    present = held | dict(logs[0].signals)
    signals = {name: present[name] for name in selection.columns if name in present}
    return [replace(logs[0], signals=signals), *logs[1:]]


def _raw_log(
    found: Mapping[str, tuple[Table, Column]], selection: Proposal, path: str | Path, clocks: int
) -> RawLog:
    table = next(iter(found.values()))[0]
    if "time" in found:
        clock = found["time"][1]
        unit = selection.units.get("time") or _unit_in_file("time", clock) or "s"
    elif table.time is not None:
        clock = next(column for column in table.columns if column.name == table.time)
        unit = _unit_in_file("time", clock) or "s"
    else:
        raise DataError(f"{path}: {table.name} has no clock; name columns that have one")
    stamps = clock.values
    if not np.any(np.isfinite(stamps)):
        raise DataError(f"{path}: column {clock.name} holds no time stamp")
    if unit == "hhmmss":
        stamps = _seconds_of_day(stamps, str(path))
    # Subtracting before scaling keeps the digits of stamps counted from 1970.
    first = float(stamps[np.isfinite(stamps)][0])
    factor = UNITS["time"][unit]
    read = {name: _values(name, column, selection) for name, (_, column) in found.items() if name != "time"}
    return RawLog(
        (stamps - first) * factor,
        {name: values for name, (values, _) in read.items()},
        np.arange(1, len(stamps) + 1),
        unit,
        first * factor,
        table.name if clocks > 1 else "",
        {name: missing for name, (_, missing) in read.items() if missing is not None},
    )


def _values(signal: str, column: Column, selection: Proposal) -> tuple[Floats, tuple[float, int, int] | None]:
    """A signal in SI units, and the number that stood for no value, with its first row and count."""
    values = column.values
    number = _no_value(values)
    missing = None
    if number is not None:
        empty = values == number
        missing = (number, int(np.argmax(empty)) + 1, int(empty.sum()))
        values = np.where(empty, np.nan, values)
    negative = values < 0.0
    if signal == "speed" and np.all(values[negative] == _NO_SPEED):
        values = np.where(negative, np.nan, values)
    factor = _factor(signal, selection.units.get(signal) or _unit_in_file(signal, column))
    return values * (-factor if selection.columns[signal].startswith("-") else factor), missing


def _no_value(values: Floats) -> float | None:
    """A number far from all others that loggers write for an empty cell, such as -9999 or 1e30."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    for number in (float(known.min()), float(known.max())):
        others = np.abs(known[known != number])
        usual = abs(number) in _NO_VALUES or abs(number) >= _HUGE
        if usual and len(others) and abs(number) > _FAR * float(np.percentile(others, 99.0)):
            return number
    return None


def _unit_in_file(signal: str, column: Column) -> str | None:
    return unit_of(signal, column.unit)


def _factor(signal: str, unit: str | None) -> float:
    known = UNITS[signal]
    return next(iter(known.values())) if unit is None else known[unit]


def _checked_unit(signal: str, unit: str) -> str:
    found = unit_of(signal, unit)
    if found is None:
        raise ConfigurationError(f"unit {unit!r} of {signal} is unknown; use {' or '.join(UNITS[signal])}")
    return found


def _seconds_of_day(stamps: Floats, path: str) -> Floats:
    """Seconds since midnight of clock times such as 95850.04, 9:58:50.04."""
    hours, minutes, seconds = stamps // 1e4, stamps // 100.0 % 100.0, stamps % 100.0
    wrong = np.flatnonzero((hours >= 24.0) | (minutes >= 60.0) | (seconds >= 60.0) | (stamps < 0.0))
    if len(wrong):
        raise DataError(
            f"{path}: the time {stamps[wrong[0]]:.10g} at data row {wrong[0] + 1} is no HHMMSS; declare "
            "another unit, time=COLUMN:s"
        )
    return np.asarray(hours * 3600.0 + minutes * 60.0 + seconds)


def _bare(column: str) -> str:
    return column.removeprefix("-")


def _constant(column: str) -> float | None:
    try:
        value = float(column)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
