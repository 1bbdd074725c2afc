"""What a person sees while an agent is trained: a bar on a terminal, lines elsewhere."""

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


class Bars:
    """Bars with speed and time left, none but on a terminal, and a line for each validation.

    Args:
        console: Where to write; default: the error stream.
    """

    def __init__(self, console: Console | None = None) -> None:
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

    def __enter__(self) -> Self:
        """Show bars."""
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove them."""
        self._bars.stop()

    def _add(self, name: str, total: int) -> TaskID:
        return self._bars.add_task(name, total=total, rate="")

    def _move(self, task: TaskID, status: Status, before: str = "") -> None:
        """Move a bar to where a training is, and write a line if there is news."""
        speed = next((bar.speed for bar in self._bars.tasks if bar.id == task), None)
        rate = f"{speed:,.0f} a second" if speed else ""
        self._bars.update(task, completed=status.steps, rate=rate)
        if status.news:
            self._console.print(f"{before}{line_of(status)}", highlight=False, soft_wrap=True)


class TrainingProgress(Bars):
    """What is seen of one training.

    Args:
        total: Actions in all.
        console: Where to write; default: the error stream.
    """

    def __init__(self, total: int, console: Console | None = None) -> None:
        super().__init__(console)
        self._task = self._add("training", total)

    def tell(self, status: Status) -> None:
        """Move the bar, and write a line if there is news."""
        self._move(self._task, status)


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


class FleetProgress(Bars):
    """See :class:`~.experiments.engine.Listener`.

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
