"""Messages of robots' middleware (ROS): numbers by field, timed by the header's stamp."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from .recording import Column, Table

_UNITS: Final = {
    "linear_acceleration": "m/s2",
    "angular_velocity": "rad/s",
    "twist.linear": "m/s",
    "twist.angular": "rad/s",
}
"""Units of the fields of standard messages (REP 103: SI units)."""


@dataclass
class Topic:
    """Messages of one topic as they come: a stamp in ns and the numbers of each.

    Attributes:
        name: Of the topic.
        kind: Name of the message type.
    """

    name: str
    kind: str
    stamps: list[int] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)

    def add(self, received: int, message: object) -> None:
        """Append a message, received at so many ns."""
        row = dict(numbers(message))
        stamp = _stamp(message)
        self.stamps.append(received if stamp is None else stamp)
        self.rows.append(row)

    def table(self) -> Table | None:
        """Rows in the order of their stamps; None where there are fewer than two with numbers."""
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        if len(self.rows) < 2 or not names:
            return None
        order = np.argsort(np.asarray(self.stamps), kind="stable")
        # Nanoseconds since 1970 have more digits than a double.
        seconds = np.array(
            [self.stamps[place] // 10**9 + self.stamps[place] % 10**9 * 1e-9 for place in order]
        )
        columns = [Column("time", seconds, "s")]
        for name in names:
            values = np.array([self.rows[place].get(name, math.nan) for place in order])
            unit = next((unit for part, unit in _UNITS.items() if f".{part}." in f".{name}"), "")
            columns.append(Column(name, values, unit))
        if "twist.linear.x" in names and "Odometry" not in self.kind:
            columns += _over_ground({column.name: column for column in columns})
        return Table(self.name, tuple(columns), "time")


def _over_ground(columns: Mapping[str, Column]) -> list[Column]:
    """Speed and course of a receiver's velocity, x to the east and y to the north (REP 103)."""
    east, north = columns["twist.linear.x"].values, columns["twist.linear.y"].values
    return [
        Column("speed over ground", np.hypot(east, north), "m/s"),
        Column("course over ground", np.arctan2(east, north), "rad"),
    ]


def numbers(message: object, prefix: str = "") -> Iterable[tuple[str, float]]:
    """Names and values of the numbers in a message, ``linear_acceleration.x``; lists are left out."""
    if isinstance(message, Mapping):
        fields: Mapping[str, Any] = message
    elif hasattr(message, "__dict__"):
        fields = vars(message)
    else:
        return
    for name, value in fields.items():
        if name in ("header", "stamp") or name.startswith("__"):
            continue
        if isinstance(value, bool | int | float | np.number):
            yield prefix + name, float(value)
        elif not isinstance(value, str | bytes | list | tuple | np.ndarray):
            yield from numbers(value, f"{prefix}{name}.")


def _stamp(message: object) -> int | None:
    """The stamp in a message's header, ns."""
    header = message.get("header") if isinstance(message, Mapping) else getattr(message, "header", None)
    stamp = header.get("stamp") if isinstance(header, Mapping) else getattr(header, "stamp", None)
    if stamp is None:
        return None
    parts = stamp if isinstance(stamp, Mapping) else vars(stamp)
    seconds = parts.get("sec", parts.get("secs"))
    rest = parts.get("nanosec", parts.get("nsec", parts.get("nsecs", 0)))
    # A header that nobody filled is zero.
    return None if seconds is None or (seconds == 0 and rest == 0) else int(seconds) * 10**9 + int(rest)
