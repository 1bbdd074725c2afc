"""What a person sees while several agents are trained: bars, and a line for each validation."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import TaskID

from .engine.job import Ending, Job
from .progress import line_of, make_bars, move
from .training import Status


class FleetProgress:
    """See :class:`~.engine.job.Listener`.

    Args:
        console: Where to write; default: the error stream.
    """

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._bars = make_bars(self._console)
        self._tasks: dict[str, TaskID] = {}

    def __enter__(self) -> FleetProgress:
        """Show bars."""
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove them."""
        self._bars.stop()

    def told(self, job: Job, status: Status) -> None:
        """Move a training's bar, and write a line if there is news."""
        if job.name not in self._tasks:
            self._tasks[job.name] = self._bars.add_task(job.name, total=status.total, rate="")
        move(self._bars, self._tasks[job.name], status)
        if status.news:
            self._console.print(f"{job.name}: {line_of(status)}", highlight=False, soft_wrap=True)

    def ended(self, job: Job, ending: Ending) -> None:
        """Remove a training's bar."""
        task = self._tasks.pop(job.name, None)
        if task is not None:
            self._bars.remove_task(task)
