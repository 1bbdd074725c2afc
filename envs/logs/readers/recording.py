"""A recording as its file has it: tables of named columns with units, each table with a clock of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...cues import Floats
from ...errors import DataError
from ..signals import Change, ImportOptions


@dataclass(frozen=True)
class Column:
    """One channel of a table.

    Attributes:
        name: As in the file.
        values: (n,) numbers in ``unit``, NaN where the file has none.
        unit: As the file writes it; empty where it says nothing.
        fault: Why the column cannot be used, if so: a cell that is no number.
    """

    name: str
    values: Floats
    unit: str = ""
    fault: str = ""


@dataclass(frozen=True)
class Table:
    """Columns that share one clock.

    Attributes:
        name: Of a topic, a group or a file; empty where a recording has one table.
        columns: All of one length.
        time: Name of the column with the time stamps, if the format knows it.
    """

    name: str
    columns: tuple[Column, ...]
    time: str | None = None

    def path_of(self, column: Column) -> str:
        """Name of a column in the whole recording, ``table/column``."""
        return f"{self.name}/{column.name}" if self.name else column.name


@dataclass(frozen=True)
class Recording:
    """What a reader found in a file.

    Attributes:
        format: For people, with the dialect.
        tables: At least one.
        changes: What was mended in the file, by choice.
        car_axes: Whether force and rates are those of the car itself, with gravity, as telemetry has them.
    """

    format: str
    tables: tuple[Table, ...]
    changes: tuple[Change, ...] = field(default=())
    car_axes: bool = False

    def find(self, name: str, path: str | Path) -> tuple[Table, Column]:
        """The column of that name, ``table/column`` or, where it is the only one, ``column``.

        A name may leave out the unit in brackets.

        Raises:
            DataError: there is none, or more than one.
        """
        everything = [(table, column) for table in self.tables for column in table.columns]
        for wanted in (
            lambda table, column: table.path_of(column) == name,
            lambda _, column: column.name == name,
            lambda _, column: without_unit(column.name) == name,
        ):
            found = [(table, column) for table, column in everything if wanted(table, column)]
            if len(found) == 1:
                return found[0]
            if found:
                places = [table.path_of(column) for table, column in found]
                if len(set(places)) == 1:
                    raise DataError(f"{path}: column {name} occurs more than once")
                raise DataError(f"{path}: column {name} is one of {', '.join(places)}; name which")
        names = ", ".join(table.path_of(column) for table, column in everything)
        raise DataError(f"{path}: missing column {name}; found {names}")


@dataclass(frozen=True)
class Reader:
    """How files of one format are recognized and read.

    Attributes:
        name: Of the format.
        recognizes: Whether a file or folder is of that format, from its name and its first bytes.
        read: The recording in it.
        extra: The optional extra of this package that the format needs, if any.
    """

    name: str
    recognizes: Callable[[Path, bytes], bool]
    read: Callable[[Path, ImportOptions], Recording]
    extra: str | None = None


def without_unit(name: str) -> str:
    """The name of a column without a unit in brackets at its end."""
    bare = name.strip()
    for opening, closing in ("()", "[]", "{}"):
        if bare.endswith(closing) and opening in bare:
            return bare[: bare.rindex(opening)].strip()
    return bare


def bracketed_unit(name: str) -> str:
    """The unit in brackets at the end of a column's name; empty where there is none."""
    bare = name.strip()
    rest = bare[len(without_unit(bare)) :].strip()
    return rest[1:-1].strip()


def empty(n: int) -> Floats:
    """(n,) cells without a number."""
    return np.full(n, np.nan)
