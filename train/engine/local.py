"""Jobs one after the other, in this process."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING

from ..interrupt import Interrupt
from .job import Job, Listener, Source, ending_of

if TYPE_CHECKING:
    from ..training import Status


class LocalEngine:
    """See :class:`~.job.Engine`."""

    def __enter__(self) -> LocalEngine:
        """Nothing has to begin."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is left behind."""

    def run(self, source: Source, listener: Listener) -> bool:
        """Run jobs until there are none; returns whether Ctrl-C stopped them."""
        interrupt = Interrupt()
        with interrupt.caught():
            while not interrupt.asked and (job := source()) is not None:
                listener.ended(job, ending_of(job, _Report(job, listener, interrupt)))
        return interrupt.asked


class _Report:
    """See :data:`~.job.Report`."""

    def __init__(self, job: Job, listener: Listener, interrupt: Interrupt) -> None:
        self._job, self._listener, self._interrupt = job, listener, interrupt

    def __call__(self, status: Status) -> bool:
        self._listener.told(self._job, status)
        return self._interrupt.asked
