"""Proposal: which columns of a recording hold the signals of an import, and in which units.

Names give the signal, the axis and sometimes the unit; a row of units or the format gives the rest. Where
neither does, the numbers show it: gravity has one size in m/s^2 and another in g.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from ..cues import GRAVITY, Floats
from .readers.recording import Column, Recording, Table, bracketed_unit, without_unit
from .signals import USUAL_STEP_S, looks_like_clock_time
from .units import FORCES, RATES, UNITS, known_unit, unit_of

_AXES: Final = {
    **dict.fromkeys(("x", "forward", "longitudinal", "long", "lon", "along", "front", "fwd", "surge"), 0),
    **dict.fromkeys(("y", "right", "left", "lateral", "lat", "side", "sideways", "transversal", "sway"), 1),
    **dict.fromkeys(("z", "down", "up", "vertical", "vert", "normal", "heave"), 2),
}
_TURNS: Final = {"roll": 0, "pitch": 1, "nick": 1, "yaw": 2, "gier": 2}


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_FORCE_WORDS: Final = _words(
    "a acc accel accl acceleration accelerometer accelerations beschleunigung force gforce totalacceleration"
)
_RATE_WORDS: Final = _words(
    "w gyro gyr gyroscope rate rates omega angular rotation rotationrate turnrate angvel gyration"
)
_SPEED_WORDS: Final = _words("speed velocity v vel groundspeed sog vehiclespeed geschwindigkeit vcar")
_COURSE_WORDS: Final = _words("course heading bearing track cog hdg direction kurs")
_TIME_WORDS: Final = _words(
    "time t timestamp stamp timestamps millis micros nanos seconds sec utc clock zeit elapsed epoch tow"
)
_FOREIGN: Final = _words(
    "accuracy error std stddev variance covariance linear user uncalibrated magnetometer magnetic mag wheel "
    "engine steering quality raw offset bias limit target setpoint filtered absolute abs magnitude norm "
    "total throttle brake altitude height orientation quaternion attitude dilution radius slip"
)
"""Words that make a column something else than it seems."""

_FASTEST_RATE: Final = 3.0
"""No car turns faster, rad/s."""

_LEAST_FILLED: Final = 0.01


@dataclass(frozen=True)
class Proposal:
    """Columns and units that an import would take, with the reason of each unit.

    Attributes:
        columns: Column of each signal, or a constant.
        units: Unit of each signal that is no constant.
        reasons: Where each unit is from.
    """

    columns: Mapping[str, str]
    units: Mapping[str, str]
    reasons: Mapping[str, str]

    def words(self) -> list[str]:
        """As ``--columns`` takes them."""
        return [
            f"{signal}={column}" + (f":{self.units[signal]}" if signal in self.units else "")
            for signal, column in self.columns.items()
        ]

    def lines(self) -> list[str]:
        """For people: each signal with its column, unit and the reason of the unit."""
        quoted = dict(zip(self.columns, self.words(), strict=True))
        width = max((len(word) for word in quoted.values()), default=0)
        return [f"{quoted[one]:<{width}}  {self.reasons.get(one, '')}".rstrip() for one in self.columns]


def propose(recording: Recording) -> Proposal:
    """The columns of the recording that hold signals, as far as their names and numbers show."""
    columns: dict[str, str] = {}
    found: dict[str, tuple[Table, Column]] = {}
    clock = _time_column(recording)
    if clock is not None:
        found["time"] = clock
    found |= _triple(recording, FORCES, _FORCE_WORDS)
    found |= _triple(recording, RATES, _RATE_WORDS, _TURNS)
    for signal, words in (("speed", _SPEED_WORDS), ("course", _COURSE_WORDS)):
        one = _single(recording, words)
        if one is not None:
            found[signal] = one
    columns = {signal: table.path_of(column) for signal, (table, column) in found.items()}
    units, reasons = {}, {}
    for signal, (_, column) in found.items():
        units[signal], reasons[signal] = _unit(signal, column, found)
    for signals, rest in ((FORCES, {"force_z": -GRAVITY}), (RATES, {"rate_x": 0.0, "rate_y": 0.0})):
        # A log of a car often has f_x, f_y and the yaw rate alone.
        present = [name for name in signals if name in columns]
        if present and set(signals) - set(present) <= set(rest):
            for name in (name for name in signals if name not in columns):
                unit = 9.80665 if units.get(present[0]) == "g" and signals == FORCES else 1.0
                columns[name] = f"{rest[name]:g}"
                reasons[name] = "not in the log: a constant, for a level device"
                if unit != 1.0:
                    units[name] = "m/s2"
    ordered = [name for name in UNITS if name in columns]
    return Proposal({name: columns[name] for name in ordered}, units, reasons)


def _tokens(text: str) -> list[str]:
    """Words of a name in lower case, without the unit at its end."""
    bare = without_unit(text)
    bare = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", bare).lower()
    return [word for word in re.split(r"[^a-z0-9°²]+", bare) if word]


_SUFFIXES: Final = {
    ("m", "s", "2"): "m/s2", ("m", "s2"): "m/s2", ("ms2",): "m/s2", ("mps2",): "m/s2",
    ("g",): "g", ("mg",): "mg",
    ("rad", "s"): "rad/s", ("rads",): "rad/s", ("rps",): "rad/s",
    ("deg", "s"): "deg/s", ("degs",): "deg/s", ("dps",): "deg/s",
    ("m", "s"): "m/s", ("mps",): "m/s", ("km", "h"): "km/h", ("kmh",): "km/h", ("kph",): "km/h",
    ("mph",): "mph", ("kn",): "kn", ("kt",): "kn", ("knots",): "kn", ("kts",): "kn",
    ("deg",): "deg", ("rad",): "rad",
    ("s",): "s", ("sec",): "s", ("ms",): "ms", ("us",): "us", ("ns",): "ns", ("millis",): "ms",
    ("micros",): "us", ("nanos",): "ns", ("seconds",): "s",
}  # fmt: skip
"""Units at the end of a name, such as ``speed_m_s``."""


def _split(text: str) -> tuple[list[str], str]:
    """Words of a name, and the unit at its end; empty if there is none."""
    words = _tokens(text)
    for length in (3, 2, 1):
        unit = _SUFFIXES.get(tuple(words[-length:]))
        if unit and len(words) > length:
            return words[:-length], unit
    return words, ""


def _usable(column: Column) -> bool:
    known = np.isfinite(column.values)
    return not column.fault and bool(known.mean() > _LEAST_FILLED if len(known) else False)


def _time_column(recording: Recording) -> tuple[Table, Column] | None:
    """The column whose stamps are the finest, among those that are called a time."""
    if any(table.time for table in recording.tables):
        return None
    found = []
    for table in recording.tables:
        for place, column in enumerate(table.columns):
            words, _ = _split(column.name)
            whole = known_unit(column.unit)
            named = bool(_TIME_WORDS & set(words)) or "".join(words) in _TIME_WORDS
            if not _usable(column) or not (named or (whole in UNITS["time"] and place == 0)):
                continue
            steps = np.diff(column.values[np.isfinite(column.values)])
            if len(steps) and np.mean(steps > 0.0) > 0.01:
                # Stamps that repeat belong to a slower clock; a wrap is one step of many.
                found.append((round(float(np.mean(steps > 0.0)), 1), -place, table, column))
    if not found:
        return None
    _, _, table, column = max(found, key=lambda one: one[:2])
    return table, column


def _triple(
    recording: Recording,
    signals: tuple[str, ...],
    words: frozenset[str],
    turns: Mapping[str, int] | None = None,
) -> dict[str, tuple[Table, Column]]:
    """The columns of one sensor that names most of the three axes."""
    groups: dict[tuple[str, str], dict[int, tuple[Table, Column]]] = {}
    for table in recording.tables:
        for column in table.columns:
            place = _axis(table, column, words, turns)
            if place is not None and _usable(column) and _fits(signals[0], column):
                stem, axis = place
                groups.setdefault((table.name, stem), {}).setdefault(axis, (table, column))
    if not groups:
        return {}
    best = max(groups.values(), key=len)
    return {signals[axis]: found for axis, found in sorted(best.items())}


def _fits(signal: str, column: Column) -> bool:
    """Whether the unit that the file gives is one of the signal's, or the file gives none."""
    return not known_unit(column.unit) or unit_of(signal, column.unit) is not None


def _axis(
    table: Table, column: Column, words: frozenset[str], turns: Mapping[str, int] | None
) -> tuple[str, int] | None:
    """What a column's name has beside its axis, and the axis; None if it is no such channel."""
    own, _ = _split(column.name)
    around = _tokens(table.name)
    if (_FOREIGN - {"total"}) & {*own, *around} - ({"linear"} if "acceleration" in own else set()):
        return None
    short = "".join(own)
    letter = "w" if turns else "a"
    match = re.fullmatch(rf"(?:{letter}|{'g|gyr|gyro' if turns else 'acc|accel'})([xyz])(?:\d*)", short)
    if match:
        return letter, "xyz".index(match[1])
    if turns and short in ("p", "q", "r"):
        return "pqr", "pqr".index(short)
    if turns:
        match = re.fullmatch(r"(roll|pitch|yaw)(rate|vel|velocity|speed|angularvelocity|gyro)", short)
        if match:
            return "turns", _TURNS[match[1]]
        if known_unit(column.unit) in UNITS["rate_z"] and set(own) & set(turns):
            return "turns", next(turns[word] for word in own if word in turns)
    named = [word for word in own if word in _AXES]
    rest = [word for word in own if word not in _AXES]
    if len(named) == 1 and words & {*rest, *around}:
        other = (_FORCE_WORDS if turns else _RATE_WORDS) - {"angular"}
        if other & set(rest) and not words & set(rest):
            return None
        if turns and "acceleration" in rest:
            return None
        return " ".join(rest), _AXES[named[0]]
    return None


def _single(recording: Recording, words: frozenset[str]) -> tuple[Table, Column] | None:
    """The first column that is called so, the most filled one of them."""
    signal = "speed" if words is _SPEED_WORDS else "course"
    found = []
    for table in recording.tables:
        for place, column in enumerate(table.columns):
            own, _ = _split(column.name)
            named = bool(words & set(own)) or "".join(own) in words
            foreign = (_FOREIGN | set(_AXES) | set(_TURNS) | _RATE_WORDS | _FORCE_WORDS | {"angle"}) & set(
                own
            )
            if named and not foreign and _usable(column) and _fits(signal, column):
                found.append((-len(own), -place, table, column))
    if not found:
        return None
    _, _, table, column = max(found, key=lambda one: one[:2])
    return table, column


def _unit(signal: str, column: Column, found: Mapping[str, tuple[Table, Column]]) -> tuple[str, str]:
    """Unit of a signal, and where it is from: the file, the name, the numbers, or nowhere."""
    written = unit_of(signal, column.unit) or unit_of(signal, bracketed_unit(column.name))
    clock_time = signal == "time" and looks_like_clock_time(column.values)
    if written and not (clock_time and written == "s"):
        return written, "unit from the file"
    suffix = _split(column.name)[1]
    if suffix in UNITS[signal] and not clock_time:
        return suffix, "unit from the name"
    if signal == "time":
        return _time_unit(column, clock_time)
    if signal in FORCES:
        size = _size([column.values for name, (_, column) in found.items() if name in FORCES])
        for unit, factor in UNITS[signal].items():
            if abs(size * factor / GRAVITY - 1.0) < 0.2:
                return unit, f"unit from gravity: the force has a size of {size:.3g}"
        return "m/s2", "unit not in the log: taken as m/s2"
    if signal == "course":
        largest = float(np.nanmax(np.abs(column.values)))
        return ("deg" if largest > 6.4 else "rad"), f"unit from its largest value, {largest:.3g}"
    if signal in RATES:
        fastest = max(
            float(np.nanpercentile(np.abs(column.values), 99.0))
            for name, (_, column) in found.items()
            if name in RATES
        )
        if fastest > _FASTEST_RATE:
            return "deg/s", f"unit from their size: no car turns at {fastest:.3g} rad/s"
    unit = next(iter(UNITS[signal]))
    return unit, f"unit not in the log: taken as {unit}"


def _size(force: list[Floats]) -> float:
    """Median length of a force of three axes, in the unit it has."""
    if len(force) < 3:
        return 0.0
    return float(np.nanmedian(np.sqrt(np.sum(np.square(force), axis=0))))


def _time_unit(column: Column, clock_time: bool) -> tuple[str, str]:
    if clock_time:
        return "hhmmss", "unit from its jumps at each minute"
    steps = np.diff(column.values[np.isfinite(column.values)])
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    for unit in ("s", "ms", "us", "ns"):
        if USUAL_STEP_S[0] <= step * UNITS["time"][unit] <= USUAL_STEP_S[1]:
            return unit, f"unit from its steps of {step:.3g}"
    return "s", "unit not in the log: taken as s"
