"""Text of reports: numbers, tables on a terminal and in Markdown, command lines, and names of files."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields
from itertools import chain, count
from pathlib import Path
from typing import Any, Final

from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ...envs.storage import write_text

NOTHING: Final = "–"
"""Shown where a metric is undefined."""

_LONGEST_NAME: Final = 40
"""Characters of a name that is shown whole, whatever the width."""
_SHORTEST_NAME: Final = 8
"""Characters a column of names keeps on the narrowest terminal."""
_FRAME: Final = 3
"""Characters a column takes beside its cells: two spaces and a line."""
_PIPED: Final = 100_000
"""Columns where the output is no terminal: every table and line fits."""


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


def is_missing(value: float | None) -> bool:
    """Whether a value is undefined: None, or NaN as pandas has it."""
    return value is None or math.isnan(value)


def number(value: float | None, digits: int = 3) -> str:
    """A number with significant digits."""
    if value is None or math.isnan(value):
        return NOTHING
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        decimals = digits - 1 - (math.floor(math.log10(abs(value))) if value else 0)
        return f"{value:.{max(0, min(decimals, digits))}f}"
    return f"{value:.{digits - 1}e}"


def percent(share: float | None) -> str:
    """A share in percent."""
    return NOTHING if share is None or math.isnan(share) else f"{100.0 * share:.1f}"


def degrees(value: float | None) -> str:
    """An angle or rate in degrees."""
    return NOTHING if value is None or math.isnan(value) else f"{math.degrees(value):.2f}"


def fraction(share: float | None) -> str:
    """A normalized score, or another number near 1."""
    return NOTHING if share is None or math.isnan(share) else f"{share:.2f}"


def seconds(value: float | None) -> str:
    """A time in seconds, with its sign."""
    return NOTHING if value is None or math.isnan(value) else f"{value:+.3f}"


def microseconds(value: float | None) -> str:
    """A time in microseconds."""
    return NOTHING if value is None or math.isnan(value) else f"{1e6 * value:.0f}"


def table_console() -> Console:
    """Where tables are shown: as wide as the terminal; as wide as they need where there is none."""
    return Console(width=None if sys.stdout.isatty() else _PIPED)


def print_table(console: Console, table: TextTable) -> None:
    """Show a table on a terminal; no number is ever cut.

    Headers are broken where the terminal is narrow. Columns that still find no room follow in a table of
    their own below, with the names again.
    """
    widths = _column_widths(table, console.width)
    for i, columns in enumerate(_blocks(widths, console.width)):
        title = table.title if i == 0 else f"{table.title} (continued)"
        shown = Table(title=escape(title), title_justify="left", title_style="bold", header_style="dim")
        for k in columns:
            shown.add_column(
                escape(table.header[k]),
                justify="left" if k == 0 else "right",
                width=widths[k],
                overflow="fold",
            )
        for j, row in enumerate(table.rows):
            cells = [escape(row[k]) for k in columns]
            shown.add_row(*cells, style="bold" if j in table.best else "")
        console.print(shown)


def _column_widths(table: TextTable, width: int) -> list[int]:
    """Of each column: whole headers if the table has room then, else as narrow as cells and words allow."""
    cells = [max((cell_len(row[k]) for row in table.rows), default=0) for k in range(len(table.header))]
    whole = [max(cell, cell_len(name)) for cell, name in zip(cells, table.header, strict=True)]
    if sum(whole) + _FRAME * len(whole) + 1 <= width:
        return whole
    words = [max(cell_len(word) for word in [*name.split(), ""]) for name in table.header]
    least = [max(cell, word) for cell, word in zip(cells, words, strict=True)]
    # Beside the names the widest of the numbers must find room; names are folded before numbers are.
    room = width - 1 - 2 * _FRAME - max(least[1:], default=0)
    least[0] = min(least[0], max(_SHORTEST_NAME, min(room, _LONGEST_NAME)))
    return least


def _blocks(widths: Sequence[int], width: int) -> Iterator[list[int]]:
    """Indices of the columns that find room side by side, the first in each; at least one beside it."""
    block, used = [0], 1 + _FRAME + widths[0]
    for k in range(1, len(widths)):
        needed = _FRAME + widths[k]
        if used + needed > width and len(block) > 1:
            yield block
            block, used = [0], 1 + _FRAME + widths[0]
        block.append(k)
        used += needed
    yield block


def print_note(console: Console, kind: str, text: str) -> None:
    """A line about a policy or a drive: "counted", "skipped", or "failed", which is red."""
    style = "bold red" if kind == "failed" else "bold"
    console.print(f"[{style}]{kind}[/{style}] {escape(text)}", highlight=False)


def markdown(table: TextTable) -> str:
    """A table as Markdown; the rows to stress are bold."""
    lines = ["| " + " | ".join(table.header) + " |", "|" + "---|" * len(table.header)]
    for i, row in enumerate(table.rows):
        cells = [f"**{cell}**" if i in table.best else cell for cell in row]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines)


def save_markdown(path: str | Path, *parts: TextTable | str) -> None:
    """Write tables and lines as Markdown, one below the other; several tables each below their title."""
    titled = sum(isinstance(part, TextTable) for part in parts) > 1
    texts: list[str] = []
    for part in parts:
        if isinstance(part, TextTable):
            texts += [f"**{part.title}**"] if titled else []
            texts.append(markdown(part))
        else:
            texts.append(part)
    write_text(path, "\n\n".join(texts) + "\n")


def words_of(name: str, command: Any) -> list[str]:
    """The command line that makes a result again: the options that differ from their default."""
    words = ["motion-cueing", name]
    for option in fields(command):
        value = getattr(command, option.name)
        if option.default is not MISSING and value == option.default:
            continue
        words.append("--" + option.name.replace("_", "-"))
        if not isinstance(value, bool):
            words += [str(item) for item in value] if isinstance(value, tuple) else [str(value)]
    return words


def how_many(count: int, noun: str) -> str:
    """A number and its noun: 1 drive, 2 drives."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def plain_name(label: str) -> str:
    """A label with nothing but letters, digits and ``_ . + -``."""
    # A pair of names is joined by `--`: within a name it would make two pairs alike.
    return re.sub(r"--+", "-", re.sub(r"[^\w.+-]+", "_", label)).strip("-") or "_"


def file_names(labels: Iterable[str]) -> dict[str, str]:
    """Each label as part of a file name, no two alike, even where case does not count."""
    names: dict[str, str] = {}
    taken: set[str] = set()
    for label in labels:
        plain = plain_name(label)
        numbered = (f"{plain}_{number}" for number in count(2))
        names[label] = next(name for name in chain([plain], numbered) if name.casefold() not in taken)
        taken.add(names[label].casefold())
    return names
