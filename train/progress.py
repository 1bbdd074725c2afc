"""Progress of trainings: a bar for each on a terminal, and a line for each validation anywhere."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from typing_extensions import Self

from .experiments.engine import Ending, Job
from .training import Status


class TrainingProgress:
    """Shows one training (:meth:`tell`), or the jobs of an engine (as its listener).

    Args:
        total: Actions of one training, to show its bar before its first status.
        console: Where to write; default: the error stream.
    """

    def __init__(self, total: int | None = None, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
            disable=not self._console.is_terminal,
            transient=True,
        )
        self._tasks: dict[str, TaskID] = {}
        if total is not None:
            self._add("training", total)

    def __enter__(self) -> Self:
        """Show bars."""
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove them."""
        self._bars.stop()

    def _add(self, name: str, total: int) -> None:
        self._tasks[name] = self._bars.add_task(name, total=total, rate="")

    def tell(self, status: Status) -> None:
        """Where the one training is."""
        self._show("training", status, "")

    def update(self, job: Job, status: Status) -> None:
        """Where a job is."""
        self._show(job.name, status, f"{job.name}: ")

    def ended(self, job: Job, ending: Ending) -> None:
        """Remove a job's bar."""
        task = self._tasks.pop(job.name, None)
        if task is not None:
            self._bars.remove_task(task)

    def _show(self, name: str, status: Status, before: str) -> None:
        """Move a bar, and write a line if there was a validation."""
        if name not in self._tasks:
            self._add(name, status.total)
        task = self._tasks[name]
        speed = next((bar.speed for bar in self._bars.tasks if bar.id == task), None)
        self._bars.update(task, completed=status.steps, rate=f"{speed:,.0f} a second" if speed else "")
        if status.news:
            self._console.print(f"{before}{line_of(status)}", highlight=False, soft_wrap=True)


def line_of(status: Status) -> str:
    """One line about the last validation."""
    score = status.score
    assert score is not None
    washout = f" (classical washout {status.reference:.2f})" if status.reference is not None else ""
    return (
        f"{status.steps:>12,} steps  J {score.cue_error:.2f}{washout}, "
        f"perceived {score.perceived_error:.2f}, reward {score.reward:.2f}, "
        f"limited {100.0 * score.limited:.2f} %"
    )
