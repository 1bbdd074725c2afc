"""How far a solve has come, on a terminal; nothing elsewhere, or where it is soon done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

_PATIENCE: Final = 2.0
"""Time after which something is shown, s."""

Tell = Callable[[float, int], None]


class SolveProgress:
    """A bar over the windows of a drive, with the iterations in the one at hand.

    Args:
        label: What is solved.
        wanted: Whether to show it at all: a command that has a bar of its own does without.
    """

    def __init__(self, label: str, wanted: bool = True) -> None:
        self._label, self._began = label, time.monotonic()
        self._wanted = wanted and sys.stderr.isatty()
        self._shown: Progress | None = None

    @property
    def tell(self) -> Tell | None:
        """Called with the share that is done and the iterations; None where nothing is shown."""
        return self._tell if self._wanted else None

    def __enter__(self) -> SolveProgress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._shown is not None:
            self._shown.stop()

    def _tell(self, share: float, iterations: int) -> None:
        if time.monotonic() - self._began < _PATIENCE:
            return
        if self._shown is None:
            self._shown = _bar()
            self._shown.start()
            self._shown.add_task(self._label, total=1.0, iterations=0)
        self._shown.update(self._shown.task_ids[0], completed=share, iterations=iterations)
        self._shown.refresh()


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("iteration {task.fields[iterations]}"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,
    )
