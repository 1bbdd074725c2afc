"""What a person sees of a search: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

from types import TracebackType
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ..baselines.tuning.search import Status

_LINES: Final = 20
"""Lines in all where the output is no terminal."""


class TuningProgress:
    """A bar with hours simulated, the best so far and the time left.

    Args:
        budget: Hours to simulate.
        console: Where to write; default: the error stream.
    """

    def __init__(self, budget: float, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._budget, self._told = budget, -1
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f} h"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
            transient=True,
        )
        self._task = self._bar.add_task("tuning", total=budget)

    def __enter__(self) -> TuningProgress:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove it."""
        self._bar.stop()

    def tell(self, status: Status) -> None:
        """Move the bar; without a terminal, write a line when another part of the budget is spent."""
        best = "tuning" if status.best is None else f"best {status.best:.4f}"
        self._bar.update(self._task, completed=min(status.hours, self._budget), description=best)
        part = int(_LINES * status.hours / self._budget)
        if not self._console.is_terminal and status.best is not None and part > self._told:
            self._told = part
            line = f"{status.hours:8.0f} h  {best}  ({status.steps} steps)"
            self._console.print(line, highlight=False, soft_wrap=True)
