"""What a person sees while several agents are trained: bars, and a line for each validation."""

from __future__ import annotations

from rich.console import Console
from rich.progress import TaskID

from .engine.job import Ending, Job
from .progress import Bars
from .training import Status


class FleetProgress(Bars):
    """See :class:`~.engine.job.Listener`.

    Args:
        console: Where to write; default: the error stream.
    """

    def __init__(self, console: Console | None = None) -> None:
        super().__init__(console)
        self._tasks: dict[str, TaskID] = {}

    def told(self, job: Job, status: Status) -> None:
        """Move a training's bar, and write a line if there is news."""
        if job.name not in self._tasks:
            self._tasks[job.name] = self._add(job.name, status.total)
        self._move(self._tasks[job.name], status, f"{job.name}: ")

    def ended(self, job: Job, ending: Ending) -> None:
        """Remove a training's bar."""
        task = self._tasks.pop(job.name, None)
        if task is not None:
            self._bars.remove_task(task)
