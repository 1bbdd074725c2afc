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

from .training import Status


def make_bars(console: Console) -> Progress:
    """Bars with speed and time left; none but on a terminal."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    )


def move(bars: Progress, task: TaskID, status: Status) -> None:
    """Move a bar to where a training is."""
    speed = next((bar.speed for bar in bars.tasks if bar.id == task), None)
    rate = f"{speed:,.0f} a second" if speed else ""
    bars.update(task, completed=status.steps, rate=rate)


class TrainingProgress:
    """A bar with speed and time left, and a line for each validation.

    Args:
        total: Actions in all.
        console: Where to write; default: the error stream.
    """

    def __init__(self, total: int, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._bar = make_bars(self._console)
        self._task = self._bar.add_task("training", total=total, rate="")

    def __enter__(self) -> TrainingProgress:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove it."""
        self._bar.stop()

    def tell(self, status: Status) -> None:
        """Move the bar, and write a line if there is news."""
        move(self._bar, self._task, status)
        if status.news:
            self._console.print(line_of(status), highlight=False, soft_wrap=True)


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
