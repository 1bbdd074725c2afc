"""A training as a job of an engine, and its folder as part of an experiment."""

from __future__ import annotations

import csv
import io
import platform
import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ...envs.errors import DataError, MotionCueingError
from ...envs.progress import Interrupt
from ...envs.storage import copy_file, write_text
from ..config import TrainingConfig
from ..logs import LOG
from ..run import RunFolder, checkpoints_in
from ..training import Outcome, Status, Training
from .engine import Report

_TRACE: Final = "error.txt"


@dataclass(frozen=True)
class TrainingJob:
    """A training in its folder, or a piece of it.

    Args:
        name: For people.
        path: The folder, absolute; a training in it goes on. Its parent exists.
        config: The training.
        until: Actions after which it pauses with a checkpoint; None for its end.
        parent: Folder of the training whose last checkpoint it starts from; None to begin anew.
    """

    name: str
    path: Path
    config: TrainingConfig
    until: int | None = None
    parent: Path | None = None

    def run(self, report: Report) -> Outcome:
        """Train; an outcome is interrupted where it was stopped before ``until``."""
        if not self.path.parent.is_dir():
            raise DataError(
                f"{self.path.parent} is not there on {platform.node()}; "
                "with a cluster, --out must be on a disk that all machines share"
            )
        interrupt = Interrupt()

        def tell(status: Status) -> None:
            interrupt.asked = report(status) or interrupt.asked or self._paused(status)

        try:
            run = RunFolder.take_up(self.path, self.config)
            if self.parent is not None and not checkpoints_in(run.checkpoints):
                inherit(run, RunFolder(self.parent, self.config))
            outcome = Training(run, tell, interrupt).train()
        except MotionCueingError:
            raise
        except Exception:
            write_text(self.path / _TRACE, traceback.format_exc())
            raise
        return Outcome(outcome.status, outcome.interrupted and not self._paused(outcome.status))

    def _paused(self, status: Status) -> bool:
        return self.until is not None and status.steps >= self.until


def write_table(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write rows as CSV, whole or not at all."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_text(path, text.getvalue())


def inherit(run: RunFolder, parent: RunFolder) -> None:
    """Start a folder from another's log, best agent and, last of all, checkpoint."""
    (*_, last) = checkpoints_in(parent.checkpoints)
    for path in (parent.path / LOG, parent.best_agent, last):
        if path.exists():
            copy_file(path, run.path / path.relative_to(parent.path))
