"""RaceLogic VBO: text with [header], [column names] and [data]; time HHMMSS.SS, accelerations in g.

Layout: RaceLogic's public description of the VBO file format. Positions are in minutes, west positive.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from ...errors import DataError, reason
from ...limits import LARGEST_TABLE, read_bytes
from ..signals import Change, ImportOptions
from .recording import Column, Reader, Recording, Table

_UNITS: Final = {
    "time": "hhmmss", "velocity": "km/h", "heading": "deg", "height": "m", "lat": "min", "long": "min",
    "long-accel": "g", "lat-accel": "g", "longacc": "g", "latacc": "g", "vert-accel": "g", "vertacc": "g",
    "indicated-long-accel": "g", "indicated-lat-accel": "g",
    "yaw-rate": "deg/s", "yawrate": "deg/s", "roll-rate": "deg/s", "pitch-rate": "deg/s",
    "x-accel": "g", "y-accel": "g", "z-accel": "g", "x_accel": "g", "y_accel": "g", "z_accel": "g",
    "yaw_rate": "deg/s", "pitch_rate": "deg/s", "roll_rate": "deg/s",
}  # fmt: skip
"""Units of the standard channels and of RaceLogic's inertial units, by column name."""


def read_vbo(path: Path, options: ImportOptions) -> Recording:
    """The recording in a VBO file.

    Raises:
        DataError: a section is missing, or a line is damaged and the options refuse that.
    """
    try:
        text = read_bytes(path, LARGEST_TABLE).decode("utf-8", errors="replace")
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    sections: dict[str, list[tuple[int, str]]] = {}
    section = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip().startswith("["):
            section = line.strip().strip("[]").lower()
        elif line.strip():
            sections.setdefault(section, []).append((number, line))
    for wanted in ("column names", "data"):
        if not sections.get(wanted):
            raise DataError(f"{path}: the section [{wanted}] is missing; is it a VBO file?")
    names = sections["column names"][0][1].split()
    written = dict(zip(names, (line for _, line in sections.get("header", [])), strict=False))
    rows: list[list[float]] = []
    strange: list[int] = []
    for number, line in sections["data"]:
        cells = line.split()
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = []
        if len(row) == len(names):
            rows.append(row)
        else:
            strange.append(number)
    changes: tuple[Change, ...] = ()
    if strange:
        fault = f"line {strange[0]} is no row of {len(names)} numbers ({len(strange)} such lines)"
        if options.damage == "refuse":
            raise DataError(f"{path}: {fault}; set damage='mend' to take what is whole")
        changes = (Change(f"{fault}: left out"),)
    if len(rows) < 2:
        raise DataError(f"{path}: fewer than 2 rows of data")
    columns = []
    for name, values in zip(names, np.array(rows).T, strict=True):
        unit = _UNITS.get(name.lower(), "")
        if name.lower() == "velocity" and "mph" in written.get(name, ""):
            unit = "mph"
        elif name.lower() == "velocity" and "knots" in written.get(name, ""):
            unit = "kn"
        columns.append(Column(name, values, unit))
    return Recording("RaceLogic VBO", (Table("", tuple(columns)),), changes)


def _recognizes(path: Path, head: bytes) -> bool:
    return path.suffix.lower() == ".vbo" or (b"[header]" in head and b"[column names]" in head)


VBO: Final = Reader("RaceLogic VBO", _recognizes, read_vbo)
