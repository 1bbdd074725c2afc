"""Rows of numbers as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..envs.storage import write_text


def save_rows(
    rows: Sequence[Mapping[str, Any]], path: str | Path, header: Sequence[str] | None = None
) -> None:
    """Write rows under a header, whole or not at all; what is None becomes an empty cell.

    Args:
        rows: Cells by column.
        path: The file.
        header: Columns; those of the first row if not given.
    """
    columns = list(header or (rows[0] if rows else ()))
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, buffer.getvalue())
