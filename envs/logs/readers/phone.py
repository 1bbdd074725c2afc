"""Phone loggers: a folder or a zip file with one CSV a sensor (Sensor Logger, Phyphox)."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Final

import numpy as np

from ...errors import DataError, reason
from ...limits import LARGEST_TABLE, MIB, read_bytes
from ..signals import Change, ImportOptions
from .delimited import parse
from .recording import Column, Reader, Recording, Table

_SENSORS: Final = {
    "accelerometer", "totalacceleration", "gravity", "gyroscope", "location", "acceleration", "gps",
    "gyroscopeuncalibrated", "accelerometeruncalibrated", "linearaccelerometer", "linearacceleration",
}  # fmt: skip
"""Names of a sensor's file, without spaces; one of them makes a phone's log."""

_FORCES: Final = ("Accelerometer", "TotalAcceleration", "Gravity")
_SENSOR_LOGGER: Final = {
    **{
        f"{sensor}/{axis}": "m/s2"
        for sensor in ("Accelerometer", "TotalAcceleration", "Gravity")
        for axis in "xyz"
    },
    **{f"Gyroscope/{axis}": "rad/s" for axis in "xyz"},
    "Location/speed": "m/s",
    "Location/bearing": "deg",
}
"""Units that the documentation of Sensor Logger gives; its files have none."""


def read_phone(path: Path, options: ImportOptions) -> Recording:
    """The recording of a phone: a table for each sensor.

    Raises:
        DataError: the file cannot be read, or has no sensor.
    """
    changes: list[Change] = []
    tables = []
    for name, read in _members(path):
        stem = PurePosixPath(name).stem
        try:
            found = parse(read(), f"{path}/{name}", options)
        except DataError:
            # Notes and settings of the app, and sensors without a sample, are no tables.
            if stem.replace(" ", "").lower() in _SENSORS and len(read().splitlines()) > 1:
                raise
            continue
        changes += found.changes
        tables.append(replace(found.tables[0], name=stem))
    if any(column.name == "seconds_elapsed" for table in tables for column in table.columns):
        return Recording(
            "Sensor Logger", _with_gravity([_of_sensor_logger(one) for one in tables]), tuple(changes)
        )
    timed = [replace(table, time=_time(table)) for table in tables]
    kept = tuple(table for table in timed if table.time is not None)
    if not kept:
        raise DataError(f"{path}: no sensor with a column of time")
    return Recording("phone (Phyphox)", kept, tuple(changes))


def _time(table: Table) -> str | None:
    return next((one.name for one in table.columns if one.name.lower().startswith("time")), None)


def _of_sensor_logger(table: Table) -> Table:
    """Named, timed and with units, as the app's documentation has it."""
    columns = []
    for column in table.columns:
        if column.name == "time":
            # ns since 1970, the same clock for all sensors; its last digits are lost in a double.
            column = Column("time", column.values, "ns")
        columns.append(replace(column, unit=_SENSOR_LOGGER.get(f"{table.name}/{column.name}", column.unit)))
    return Table(table.name, tuple(columns), "time")


def _with_gravity(tables: list[Table]) -> tuple[Table, ...]:
    """Tables with a total acceleration, made of acceleration and gravity where the app wrote only these."""
    named = {table.name: table for table in tables}
    if "TotalAcceleration" in named or not {"Accelerometer", "Gravity"} <= set(named):
        kept = [
            table for table in tables if table.name != "Accelerometer" or "TotalAcceleration" not in named
        ]
        return tuple(kept)
    own, gravity = ({one.name: one for one in named[name].columns} for name in ("Accelerometer", "Gravity"))
    columns = []
    for name, column in own.items():
        if name in "xyz":
            rest = np.interp(own["time"].values, gravity["time"].values, gravity[name].values)
            column = replace(column, values=column.values + rest)
        columns.append(column)
    total = Table("TotalAcceleration", tuple(columns), "time")
    return (total, *(table for table in tables if table.name not in ("Accelerometer", "Gravity")))


def _members(path: Path) -> Iterable[tuple[str, Callable[[], bytes]]]:
    """Name and reader of each CSV file at the top of a folder or a zip file."""
    try:
        if path.is_dir():
            return [
                (file.name, partial(read_bytes, file, LARGEST_TABLE)) for file in sorted(path.glob("*.csv"))
            ]
        with zipfile.ZipFile(path) as archive:
            members = [member for member in archive.infolist() if _is_sensor(member.filename)]
            if sum(member.file_size for member in members) > LARGEST_TABLE:
                raise DataError(f"{path}: larger than {LARGEST_TABLE / MIB:g} MiB unpacked")
            files = {member.filename: archive.read(member) for member in members}
        return [(name, lambda name=name: files[name]) for name in files]  # type: ignore[misc]
    except (OSError, zipfile.BadZipFile) as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None


def _is_sensor(name: str) -> bool:
    parts = PurePosixPath(name).parts
    return name.lower().endswith(".csv") and len(parts) <= 2 and parts[0] not in ("meta", "__MACOSX")


def _recognizes(path: Path, head: bytes) -> bool:
    if path.is_dir():
        return any(file.stem.replace(" ", "").lower() in _SENSORS for file in path.glob("*.csv"))
    return head.startswith(b"PK\x03\x04")


PHONE: Final = Reader("phone logger", _recognizes, read_phone)
