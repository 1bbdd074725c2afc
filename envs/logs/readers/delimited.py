"""Text tables (CSV and its dialects): separator, decimal mark, encoding, header, units and clock times."""

from __future__ import annotations

import csv
import re
import zlib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from ...cues import Floats
from ...errors import DataError, reason
from ...limits import LARGEST_TABLE, MOST_COLUMNS, read_bytes
from ..signals import Change, ImportOptions
from ..units import known_unit
from .recording import Column, Reader, Recording, Table, bracketed_unit

_SEPARATORS: Final = (",", ";", "\t", "|", " ")
_SAMPLE: Final = 200
"""Lines from whose middle the separator and the decimal mark are found."""

_NOTHING: Final = {"", "nan", "na", "n/a", "null", "none", "-", "--", "---", "#n/a", "?", "*"}
"""Cells that hold no number."""

_POINT: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_COMMA: Final = re.compile(r"[+-]?(\d+,?\d*|,\d+)(e[+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_GROUPED_POINT: Final = re.compile(r"[+-]?\d{1,3}([,' \u00a0\u202f]\d{3})+(\.\d*)?")
_GROUPED_COMMA: Final = re.compile(r"[+-]?\d{1,3}([.' \u00a0\u202f]\d{3})+(,\d*)?")
_CLOCK: Final = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d*)?)")
_DATE: Final = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[T ]+\d{1,2}:\d{2}(:\d{2})?.*")


@dataclass(frozen=True)
class _Dialect:
    separator: str
    decimal: str
    cells: int
    score: float

    def split(self, line: str) -> list[str]:
        if self.separator == " ":
            return line.split()
        return next(csv.reader([line], delimiter=self.separator, skipinitialspace=True), [])

    def is_number(self, cell: str) -> bool:
        plain, grouped = (_POINT, _GROUPED_POINT) if self.decimal == "." else (_COMMA, _GROUPED_COMMA)
        return bool(plain.fullmatch(cell) or grouped.fullmatch(cell))

    def is_data(self, cell: str) -> bool:
        cell = cell.strip()
        return self.is_number(cell) or bool(_CLOCK.fullmatch(cell) or _DATE.fullmatch(cell))

    @property
    def words(self) -> str:
        separator = {"\t": "tab", " ": "spaces"}.get(self.separator, f"{self.separator!r}")
        return f"separator {separator}, decimal {'comma' if self.decimal == ',' else 'point'}"


def read_delimited(path: Path, options: ImportOptions) -> Recording:
    """The recording in a text table.

    Raises:
        DataError: the file cannot be read, holds no table, or is damaged and the options refuse that.
    """
    try:
        content = read_bytes(path, LARGEST_TABLE)
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    return parse(content, str(path), options)


def parse(content: bytes, path: str, options: ImportOptions) -> Recording:
    """The recording in the bytes of a text table, packed by gzip or not."""
    changes: list[Change] = []
    if content[:2] == b"\x1f\x8b":
        content, fault = _unpacked(content)
        _damage(fault, path, options, changes)
    elif path.endswith(".gz"):
        raise DataError(f"{path}: cannot be read (not packed by gzip)")
    text, encoding = _decoded(content)
    if "\0" in text:
        row = text[: text.index("\0")].count("\n") + 1
        _damage(
            f"line {row} holds zero bytes, as a recorder leaves that lost its power", path, options, changes
        )
        text = text.replace("\0", "")
    lines = text.splitlines()
    numbered = [(number, line) for number, line in enumerate(lines, start=1) if line.strip()]
    if len(numbered) < 2:
        raise DataError(f"{path}: empty; expected a header row and data rows")
    dialect = _dialect([line for _, line in numbered])
    rows = [(number, dialect.split(line)) for number, line in numbered]
    first = _first_data_row(rows, dialect)
    if first is None:
        raise DataError(f"{path}: no rows of numbers; expected a table of text, such as CSV")
    names, units, preamble = _header(rows, first, dialect)
    data = _whole_rows(rows[first:], len(names), dialect, names, path, options, changes)
    if len(names) > MOST_COLUMNS:
        raise DataError(f"{path}: {len(names)} columns; at most {MOST_COLUMNS} are read")
    columns = tuple(
        _column(name, unit, [(line, row[place].strip()) for line, row in data], dialect, path)
        for place, (name, unit) in enumerate(zip(names, units, strict=True))
    )
    said = [f"CSV: {dialect.words}, {encoding}"]
    said += [f"{preamble} lines before the header"] if preamble else []
    said += ["a row of units"] if any(units) and not any(map(bracketed_unit, names)) else []
    said += ["no header"] if names[0] == "#1" else []
    return Recording(", ".join(said), (Table("", columns),), tuple(changes))


def _damage(fault: str, path: str, options: ImportOptions, changes: list[Change]) -> None:
    """Refuse a damage of the file, or note that it was mended."""
    if not fault:
        return
    if options.damage == "refuse":
        raise DataError(f"{path}: {fault}; set damage='mend' to take what is whole")
    changes.append(Change(f"{fault}: left out"))


def _unpacked(content: bytes) -> tuple[bytes, str]:
    """What could be unpacked, and the fault at its end, if any."""
    parts, fault = [], ""
    while content[:2] == b"\x1f\x8b":
        machine = zlib.decompressobj(wbits=31)
        try:
            parts.append(machine.decompress(content, LARGEST_TABLE))
        except zlib.error as error:
            fault = f"cannot be read: the packed file is damaged ({error})"
            break
        if not machine.eof:
            fault = "cannot be read to its end: the packed file is cut off"
            break
        content = machine.unused_data
    whole = b"".join(parts)
    # The last line of a file that was cut off is a part of a line.
    return (whole[: whole.rfind(b"\n") + 1] if fault else whole), fault


def _decoded(content: bytes) -> tuple[str, str]:
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig")):
        if content.startswith(mark):
            return content.decode(encoding, errors="replace"), encoding
    try:
        return content.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        return content.decode("latin-1"), "latin-1"


def _dialect(lines: list[str]) -> _Dialect:
    """Separator and decimal mark that make most of the middle lines rows of as many numbers each."""
    middle = max(0, len(lines) // 2 - _SAMPLE // 2)
    sample = lines[middle : middle + _SAMPLE]
    found = []
    for separator in _SEPARATORS:
        for decimal in ".,":
            if decimal == separator:
                continue
            trial = _Dialect(separator, decimal, 0, 0.0)
            rows = [trial.split(line) for line in sample]
            cells, common = Counter(map(len, rows)).most_common(1)[0]
            if cells < 2:
                continue
            even = [row for row in rows if len(row) == cells]
            filled = [cell.strip() for row in even for cell in row if cell.strip().lower() not in _NOTHING]
            numbers = sum(trial.is_data(cell) for cell in filled) / max(1, len(filled))
            found.append(_Dialect(separator, decimal, cells, common / len(sample) * numbers))
    if not found:
        return _Dialect(",", ".", 1, 0.0)
    return max(found, key=lambda one: round(one.score, 6))


def _first_data_row(rows: list[tuple[int, list[str]]], dialect: _Dialect) -> int | None:
    """Index of the first row of numbers that is followed by more of them."""
    for index, (_, row) in enumerate(rows):
        filled = [cell.strip() for cell in row if cell.strip().lower() not in _NOTHING]
        numbers = sum(map(dialect.is_data, filled))
        if len(row) == dialect.cells and numbers and numbers >= 0.5 * len(filled):
            return index
    return None


def _header(
    rows: list[tuple[int, list[str]]], first: int, dialect: _Dialect
) -> tuple[list[str], list[str], int]:
    """Names and units of the columns, and the number of rows before the header."""
    width = len(rows[first][1])
    above = [[cell.strip().strip("\"'") for cell in row] for _, row in rows[max(0, first - 2) : first]]
    above = [row for row in above if len(row) == width]
    if not above:
        return [f"#{place}" for place in range(1, width + 1)], [""] * width, first
    if len(above) == 2 and all(not cell or known_unit(cell) for cell in map(_bare_unit, above[1])):
        names, units = above[0], [_bare_unit(cell) for cell in above[1]]
        return names, units, first - 2
    names = above[-1]
    return names, [bracketed_unit(name) for name in names], first - 1


def _bare_unit(cell: str) -> str:
    return cell.strip("()[]{} ")


def _whole_rows(
    rows: list[tuple[int, list[str]]],
    width: int,
    dialect: _Dialect,
    names: list[str],
    path: str,
    options: ImportOptions,
    changes: list[Change],
) -> list[tuple[int, list[str]]]:
    """Rows with as many cells as the header; others, and headers that come again, are damage."""
    whole = []
    strange: list[tuple[int, str]] = []
    for number, row in rows:
        if len(row) == width + 1 and not row[-1].strip():
            row = row[:-1]
        if len(row) != width:
            strange.append((number, f"has {len(row)} cells, the header has {width}"))
        elif [cell.strip() for cell in row] == names:
            strange.append((number, "is the header once more: two logs may be joined here"))
        else:
            whole.append((number, row))
    if strange:
        number, what = strange[0]
        many = f" ({len(strange)} such lines)" if len(strange) > 1 else ""
        _damage(f"line {number} {what}{many}", path, options, changes)
    return whole


def _column(name: str, unit: str, cells: list[tuple[int, str]], dialect: _Dialect, path: str) -> Column:
    try:
        if dialect.decimal == ".":
            return Column(name, np.array([float(cell or "nan") for _, cell in cells]), unit)
    except ValueError:
        pass
    texts = [cell for _, cell in cells]
    for reading, wanted in ((_dates, _DATE), (_clock_times, _CLOCK)):
        if texts and sum(bool(wanted.fullmatch(text)) for text in texts) > 0.5 * len(texts):
            values = reading(texts)
            return Column(name, values, "s", _fault(name, cells, values, path))
    values = np.array([_number(text, dialect) for text in texts])
    return Column(name, values, unit, _fault(name, cells, values, path))


def _fault(name: str, cells: list[tuple[int, str]], values: Floats, path: str) -> str:
    for (line, text), value in zip(cells, values, strict=True):
        if np.isnan(value) and text.lower() not in _NOTHING:
            return f"{path}: line {line}, column {name}: {text!r} is no number"
    return ""


def _number(text: str, dialect: _Dialect) -> float:
    if text.lower() in _NOTHING:
        return float("nan")
    plain, grouped = (_POINT, _GROUPED_POINT) if dialect.decimal == "." else (_COMMA, _GROUPED_COMMA)
    if grouped.fullmatch(text):
        text = re.sub(r"[' \u00a0\u202f]|" + (r"," if dialect.decimal == "." else r"\."), "", text)
    elif not plain.fullmatch(text):
        return float("nan")
    return float(text.replace(",", "."))


def _clock_times(texts: list[str]) -> Floats:
    """Seconds since midnight."""
    found = [_CLOCK.fullmatch(text) for text in texts]
    return np.array(
        [
            float("nan")
            if one is None
            else 3600.0 * int(one[1]) + 60.0 * int(one[2]) + float(one[3].replace(",", "."))
            for one in found
        ]
    )


def _dates(texts: list[str]) -> Floats:
    """Seconds since 1970."""
    plain = [text.replace(",", ".") for text in texts]
    if all(text[:4].isdigit() for text in plain if text):
        stamps = pd.to_datetime(pd.Series(plain), format="ISO8601", utc=True, errors="coerce")
    else:
        fields = [re.split(r"[-./]", text)[:2] for text in plain if text]
        month_first = any(len(pair) == 2 and pair[1].isdigit() and int(pair[1]) > 12 for pair in fields)
        stamps = pd.to_datetime(
            pd.Series(plain), format="mixed", dayfirst=not month_first, utc=True, errors="coerce"
        )
    seconds = (stamps - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)
    return np.asarray(seconds.to_numpy(dtype=np.float64, na_value=np.nan))


DELIMITED: Final = Reader("CSV", lambda path, head: True, read_delimited)
