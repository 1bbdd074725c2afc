"""Jobs in processes of this machine. One that dies is replaced, and its job taken up again."""

from __future__ import annotations

import multiprocessing
import signal
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

from ..interrupt import Interrupt
from .job import RETRIES, Ending, Job, Listener, Source, ending_of

if TYPE_CHECKING:
    from ..training import Status

_PATIENCE: Final = 0.2
"""Time between looks at Ctrl-C, s."""


@dataclass
class _Worker:
    """A process, what leads to it, and what it works on."""

    process: Any
    connection: Any
    job: Job | None = None
    deaths: int = 0


class ProcessEngine:
    """See :class:`~.job.Engine`.

    Args:
        jobs: Processes.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._context = multiprocessing.get_context("spawn")
        # No lock belongs to it, which a process that is killed could hold for ever.
        self._stop: Any = self._context.RawValue("b", 0)
        self._workers: list[_Worker] = []

    def __enter__(self) -> ProcessEngine:
        """Processes begin when there is work for them."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the processes; at once where one still works, as after a second Ctrl-C."""
        for worker in self._workers:
            if worker.job is not None or error is not None:
                worker.process.kill()
            worker.connection.close()
        for worker in self._workers:
            worker.process.join()
        self._workers.clear()

    def run(self, source: Source, listener: Listener) -> bool:
        """Run jobs until there are none; returns whether Ctrl-C stopped them."""
        interrupt = Interrupt()
        self._stop.value = 0
        with interrupt.caught():
            self._fill(source)
            while busy := {worker.connection: worker for worker in self._workers if worker.job is not None}:
                for connection in wait(list(busy), _PATIENCE):
                    self._hear(busy[connection], listener)
                if interrupt.asked:
                    self._stop.value = 1
                else:
                    self._fill(source)
        return interrupt.asked

    def _fill(self, source: Source) -> None:
        """Give every process work that has none."""
        for worker in self._workers:
            if worker.job is None and not self._begin(worker, source()):
                return
        while len(self._workers) < self._jobs and (job := source()) is not None:
            worker = _Worker(*self._process())
            self._workers.append(worker)
            self._begin(worker, job)

    def _begin(self, worker: _Worker, job: Job | None) -> bool:
        """Give a process a job, if there is one."""
        if job is not None:
            worker.job, worker.deaths = job, 0
            self._send(worker, job)
        return job is not None

    def _send(self, worker: _Worker, job: Job) -> None:
        # A process that is dead already will be found so when it is heard.
        with suppress(ConnectionError):
            worker.connection.send(job)

    def _process(self) -> tuple[Any, Any]:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(theirs, self._stop), daemon=True)
        process.start()
        theirs.close()
        return process, ours

    def _hear(self, worker: _Worker, listener: Listener) -> None:
        job = worker.job
        assert job is not None
        try:
            message = worker.connection.recv()
        except (EOFError, OSError):
            self._replace(worker, job, listener)
            return
        if isinstance(message, Ending):
            worker.job = None
            listener.ended(job, message)
        else:
            listener.told(job, message)

    def _replace(self, worker: _Worker, job: Job, listener: Listener) -> None:
        """Another process for one that died, with the same job."""
        worker.process.join()
        worker.connection.close()
        worker.deaths += 1
        if worker.deaths <= RETRIES:
            worker.process, worker.connection = self._process()
            self._send(worker, job)
            return
        self._workers.remove(worker)
        code = worker.process.exitcode
        listener.ended(job, Ending(error=f"its process died {worker.deaths} times, with code {code}"))


def _serve(connection: Connection, stop: Any) -> None:
    """Do jobs until nobody is there any more. Ctrl-C reaches this process, too, but is for the first one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def report(status: Status) -> bool:
        connection.send(status)
        return bool(stop.value)

    while True:
        try:
            job: Job = connection.recv()
            connection.send(ending_of(job, report))
        except (EOFError, ConnectionError):
            return
