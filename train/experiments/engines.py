"""Between the workers of a cluster and the process that sent them: news one way, whether to stop the other.

It has a process of its own, so it imports no learning library, and news stay as they were packed.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Protocol

from ...envs.errors import UnknownNameError
from ..training import Interrupt

if TYPE_CHECKING:
    from ..config import TrainingConfig
    from ..training import Status


class Desk:
    """Keeps news until they are taken."""

    def __init__(self) -> None:
        self._news: list[tuple[str, bytes]] = []
        self._stop = False

    def tell(self, name: str, news: bytes) -> bool:
        """Leave news of a job; returns whether it shall stop."""
        self._news.append((name, news))
        return self._stop

    def hear(self, stop: bool) -> list[tuple[str, bytes]]:
        """Take the news, each with its job's name.

        Args:
            stop: Whether all jobs shall stop.
        """
        news, self._news, self._stop = self._news, [], stop
        return news


# What an engine is, and what it runs: jobs that can be begun again.


RETRIES: Final = 3
"""How often a job is taken up again after its process died; chosen: one that always dies must end."""

Report = Callable[["Status"], bool]
"""Shown the status at every boundary; answers whether to stop there, with a checkpoint."""


class Job(Protocol):
    """Work that can be pickled, and run again after a process that died: it goes on from its files."""

    @property
    def name(self) -> str:
        """What a person calls it; none twice in an engine at a time."""
        ...

    @property
    def config(self) -> TrainingConfig:
        """The training; its ``threads`` and ``device`` are what the job needs."""
        ...

    def run(self, report: Report) -> Any:
        """Do it, or what is left of it."""
        ...


@dataclass(frozen=True)
class Ending:
    """How a job ended.

    Args:
        result: What it returned.
        error: Why it failed, one sentence; None where it did not.
    """

    result: Any = None
    error: str | None = None


Source = Callable[[], Job | None]
"""The next job; None while there is none."""


class Listener(Protocol):
    """Is told what comes of the jobs, in the process that runs the engine."""

    def told(self, job: Job, status: Status) -> None:
        """Where a job is."""
        ...

    def ended(self, job: Job, ending: Ending) -> None:
        """How a job ended; the source is asked again after it."""
        ...


class Engine(Protocol):
    """Runs jobs, so many at a time; they come to the same bits in every engine."""

    def __enter__(self) -> Engine:
        """Begin."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave no process behind."""
        ...

    def run(self, source: Source, listener: Listener) -> bool:
        """Run jobs until there are none; returns whether Ctrl-C stopped them, each at a checkpoint."""
        ...


def ending_of(job: Job, report: Report) -> Ending:
    """Run a job where this is called."""
    try:
        return Ending(job.run(report))
    except Exception as error:
        # One that diverges must not end the others.
        return Ending(error=" ".join(str(error).split()) or type(error).__name__)


def run_jobs(engine: Engine, jobs: Sequence[Job], listener: Listener) -> tuple[dict[str, Ending], bool]:
    """Run jobs that are known beforehand.

    Returns:
        How each ended, by name, and whether Ctrl-C stopped them.
    """
    left, found = list(jobs), _Gathered(listener)
    interrupted = engine.run(lambda: left.pop(0) if left else None, found)
    return found.endings, interrupted


class _Gathered:
    """Keeps the endings, and passes everything on."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        self.endings: dict[str, Ending] = {}

    def told(self, job: Job, status: Status) -> None:
        self._listener.told(job, status)

    def ended(self, job: Job, ending: Ending) -> None:
        self.endings[job.name] = ending
        self._listener.ended(job, ending)


# Jobs one after the other, in this process.


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


# Jobs in processes of this machine. One that dies is replaced, and its job taken up again.


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


# An engine by name.


ENGINES: Final = ("local", "ray")
"""Names ``--engine`` takes."""


def make_engine(name: str, jobs: int | None = None, address: str | None = None) -> Engine:
    """An engine.

    Args:
        name: One of :data:`ENGINES`.
        jobs: Jobs at a time; by default 1 with "local", one a core of machine or cluster with "ray".
        address: Of a Ray cluster to join; None for one of its own, on this machine.

    Raises:
        UnknownNameError: no engine has this name.
        ConfigurationError: Ray is not installed.
    """
    if name not in ENGINES:
        raise UnknownNameError("engine", name, ENGINES)
    if name == "ray":
        from .ray_engine import RayEngine

        return RayEngine(jobs, address)
    return LocalEngine() if jobs in (None, 1) else ProcessEngine(jobs or 1)
