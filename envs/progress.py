"""Progress of long work on the error stream, so that results can be piped, and Ctrl-C between its steps."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Final

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from typing_extensions import Self

COMPILING: Final = "compiling kernels, once, about 40 s"
_LOOK: Final = 0.3
"""Time between two looks into Warp's cache, s."""


class Bar:
    """One piece of work, with its number ``task``, among :class:`Bars`."""

    def __init__(self, bars: Progress, task: TaskID) -> None:
        self._bars, self._task = bars, task

    def move(
        self,
        done: float | None = None,
        text: str | None = None,
        *,
        advance: float | None = None,
        note: str = "",
    ) -> None:
        """Show where the work is.

        Args:
            done: Work done so far.
            text: What is at hand.
            advance: Work done since the last call, instead of ``done``.
            note: Stands beside the count.
        """
        self._bars.update(self._task, completed=done, advance=advance, description=text, note=note)

    @property
    def speed(self) -> float | None:
        """Work a second; None while it is unknown."""
        return next((task.speed for task in self._bars.tasks if task.id == self._task), None)

    def remove(self) -> None:
        """Show it no longer."""
        self._bars.remove_task(self._task)


class Bars:
    """Bars on a terminal (the error stream), none elsewhere; lines are written above them in either case."""

    def __init__(self, console: Console | None = None) -> None:
        self.console = console or Console(stderr=True)
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:,.0f}/{task.total:,.0f} {task.fields[unit]} {task.fields[note]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self.console,
            disable=not self.console.is_terminal,
            transient=True,
        )

    def __enter__(self) -> Self:
        """Show the bars."""
        self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bars."""
        self._bars.stop()

    def add(self, text: str, total: float, unit: str = "") -> Bar:
        """Another bar, with what is at hand, and the work in all in its unit."""
        return Bar(self._bars, self._bars.add_task(text, total=total, unit=unit, note=""))

    def line(self, text: str) -> None:
        """Write a line that stays."""
        self.console.print(text, highlight=False, markup=False, soft_wrap=True)


@contextmanager
def progress(total: float, unit: str = "", text: str = "starting") -> Iterator[Bar]:
    """A bar for one piece of work: the work in all in its unit, and what is at hand at first."""
    with Bars() as bars:
        yield bars.add(text, total, unit)


@contextmanager
def drives_progress(total: int) -> Iterator[Callable[[str, str], None]]:
    """A bar for drives; yields what to call before each with two words, such as maneuver and policy."""
    with progress(total, "drives") as bar:
        begun = 0

        def begin(what: str, who: str) -> None:
            nonlocal begun
            bar.move(begun, f"{what}: {who}")
            begun += 1

        yield begin


@contextmanager
def compilation_announced() -> Iterator[None]:
    """Say so when Warp compiles kernels within the block: the first run is silent for long otherwise.

    Warp compiles into a folder of its cache whose name has the number of the process; a thread looks for it.
    """
    over = threading.Event()
    watch = threading.Thread(target=watch_cache, args=(over,), name="kernels", daemon=True)
    watch.start()
    try:
        yield
    finally:
        over.set()
        watch.join()


def watch_cache(over: threading.Event) -> None:
    """Look into Warp's cache until this process compiles there, and say so; ``over`` ends it."""
    mark = f"_p{os.getpid()}_"
    while not over.wait(_LOOK):
        warp = sys.modules.get("warp")
        folder = getattr(getattr(warp, "config", None), "kernel_cache_dir", None)
        if folder and os.path.isdir(folder) and any(mark in name for name in os.listdir(folder)):
            print(COMPILING, file=sys.stderr, flush=True)
            return


class Interrupt:
    """Whether Ctrl-C was pressed; the second time it interrupts at once."""

    def __init__(self) -> None:
        self.asked = False

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Hold SIGINT back within the block; only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        earlier = signal.signal(signal.SIGINT, self._ask)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, earlier)

    def _ask(self, number: int, frame: Any) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True


def begin_worker() -> None:
    """Begin a worker process: Ctrl-C is for the first process alone, and nothing outlives it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
