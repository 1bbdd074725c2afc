"""Tables as rows of text, how numbers are written in them, and how they are shown."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..envs.storage import write_text

NOTHING: Final = "–"
"""Shown where a metric is undefined."""

_LONGEST_NAME: Final = 40
"""Characters of a name that is shown whole, whatever the width."""


@dataclass(frozen=True)
class TextTable:
    """A table of text.

    Args:
        title: Above it.
        header: Names of the columns; the first holds names, the others numbers.
        rows: Cells.
        best: Indices of the rows to stress.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    best: tuple[int, ...] = ()


def number(value: float | None, digits: int = 3) -> str:
    """A number with significant digits."""
    if value is None:
        return NOTHING
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        decimals = digits - 1 - (math.floor(math.log10(abs(value))) if value else 0)
        return f"{value:.{max(0, min(decimals, digits))}f}"
    return f"{value:.{digits - 1}e}"


def percent(share: float | None) -> str:
    """A share in percent."""
    return NOTHING if share is None else f"{100.0 * share:.1f}"


def degrees(value: float | None) -> str:
    """An angle or rate in degrees."""
    return NOTHING if value is None else f"{math.degrees(value):.2f}"


def fraction(share: float | None) -> str:
    """A share of the gap."""
    return NOTHING if share is None else f"{share:.2f}"


def microseconds(value: float | None) -> str:
    """A time in microseconds."""
    return NOTHING if value is None else f"{1e6 * value:.0f}"


def print_table(console: Console, table: TextTable) -> None:
    """Show a table on a terminal."""
    shown = Table(title=escape(table.title), title_justify="left", title_style="bold", header_style="dim")
    # Names are what a reader looks for: they are never cut, as long as they are names.
    names = min(max((len(row[0]) for row in table.rows), default=0), _LONGEST_NAME)
    for i, name in enumerate(table.header):
        left = {"justify": "left", "min_width": names} if i == 0 else {"justify": "right"}
        shown.add_column(escape(name), **left)
    for i, row in enumerate(table.rows):
        shown.add_row(*(escape(cell) for cell in row), style="bold" if i in table.best else "")
    console.print(shown)


def save_markdown(table: TextTable, path: str | Path) -> None:
    """Write a table as Markdown; the rows to stress are bold."""
    lines = ["| " + " | ".join(table.header) + " |", "|" + "---|" * len(table.header)]
    for i, row in enumerate(table.rows):
        cells = [f"**{cell}**" if i in table.best else cell for cell in row]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    write_text(path, "\n".join(lines) + "\n")
