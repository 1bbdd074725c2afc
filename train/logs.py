"""The log of a training: rows of a CSV file, and the same for TensorBoard."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from torch.utils.tensorboard import SummaryWriter

from ..envs.errors import DataError
from ..envs.storage import write_text

STEPS: Final = "steps"
"""Column of the actions so far."""

LOG: Final = "log.csv"
"""Its name in the folder of a training."""

_EVENTS: Final = "tensorboard"


class TrainingLog:
    """Scalars by name over steps.

    A scalar that appears later adds a column. Rows are kept in memory, a few hundred a training.

    Args:
        folder: Of the training.
        steps: Actions so far; later rows, of a training that was broken off, are dropped.

    Raises:
        DataError: the file of an earlier session is broken.
    """

    def __init__(self, folder: Path, steps: int = 0) -> None:
        self._path = folder / LOG
        self.rows = [row for row in read_log(folder) if row[STEPS] <= steps]
        self._events: Any = SummaryWriter(str(folder / _EVENTS), purge_step=steps + 1)

    def write(self, steps: int, scalars: Mapping[str, float]) -> None:
        """Add a row; scalars of the same steps join the row there is."""
        if not scalars:
            return
        if not self.rows or self.rows[-1][STEPS] != steps:
            self.rows.append({STEPS: float(steps)})
        self.rows[-1].update(scalars)
        for name, value in scalars.items():
            self._events.add_scalar(name, value, steps)
        self._events.flush()
        self._save()

    def _save(self) -> None:
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        text = io.StringIO()
        table = csv.DictWriter(text, names, lineterminator="\n")
        table.writeheader()
        for row in self.rows:
            table.writerow({name: f"{value:.9g}" for name, value in row.items()})
        write_text(self._path, text.getvalue())

    def close(self) -> None:
        """Close TensorBoard's file."""
        self._events.close()


def read_log(folder: Path) -> list[dict[str, float]]:
    """The rows of a training's log; scalars that a row does not have are left out.

    Raises:
        DataError: the file is broken.
    """
    path = folder / LOG
    if not path.exists():
        return []
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
            found = [{name: float(text) for name, text in row.items() if text} for row in rows]
    except (OSError, ValueError, TypeError) as error:
        raise DataError(f"{path}: not the log of a training ({error})") from None
    if any(STEPS not in row for row in found):
        raise DataError(f"{path}: not the log of a training (column {STEPS} is missing)")
    return found
