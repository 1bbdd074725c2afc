"""A bar for many drives, one after another."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn


@contextmanager
def suite_progress(total: int) -> Iterator[Callable[[str, str], None]]:
    """A bar on the terminal's error stream, so that the tables can be piped.

    Args:
        total: Number of drives.

    Yields:
        To be called before each drive, with two words about it.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=total)
        started = 0

        def advance(what: str, who: str) -> None:
            nonlocal started
            bar.update(task, description=f"{what}: {who}", completed=started)
            started += 1

        yield advance
