"""Engines run jobs: one after the other in this process, in processes of this machine, or on Ray.

A job is work that can be pickled and begun again: it goes on from its files. So a job whose process died is
taken up again, and comes to the same bits in every engine. While it runs, it reports its status and learns
whether to stop. This module imports no learning library: the process that passes reports on needs none.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import secrets
import shutil
import socket
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from importlib.util import find_spec
from multiprocessing.managers import BaseManager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Protocol

from typing_extensions import Self

from ...envs.errors import ConfigurationError, DataError, UnknownNameError
from ...envs.progress import Interrupt, begin_worker

if TYPE_CHECKING:
    from ..config import TrainingConfig
    from ..training import Status

RETRIES: Final = 3
"""How often a job is taken up again after its process died; chosen: one that always dies must end."""
_PATIENCE: Final = 0.2
"""Time between looks at reports and Ctrl-C, s."""
_QUIET: Final = 0.5
"""Least time between reports of a job without news, s."""

Report = Callable[["Status"], bool]
"""Given the status at every boundary; returns whether to stop there, with a checkpoint."""


class Job(Protocol):
    """Work that can be pickled, and run again after a process that died."""

    @property
    def name(self) -> str:
        """For people; unique among the jobs of an engine."""
        ...

    @property
    def config(self) -> TrainingConfig:
        """The training; its ``threads`` and ``device`` are what the job needs."""
        ...

    def run(self, report: Report) -> Any:
        """Do the work, or the rest of it."""
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
    """Follows jobs, in the process that runs the engine."""

    def update(self, job: Job, status: Status) -> bool | None:
        """Where a job is; True stops it at its next boundary."""
        ...

    def ended(self, job: Job, ending: Ending) -> None:
        """How a job ended; the engine takes the next job after it."""
        ...


def ending_of(job: Job, report: Report) -> Ending:
    """Run a job in this process."""
    try:
        return Ending(job.run(report))
    except Exception as error:
        # One that diverges must not end the others.
        return Ending(error=" ".join(str(error).split()) or type(error).__name__)


class Engine:
    """Runs jobs in this process, one after the other; also the interface of other engines."""

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave no process behind."""

    def run(self, source: Source, listener: Listener) -> bool:
        """Run jobs until there are none; returns whether Ctrl-C stopped them, each at a checkpoint."""
        interrupt = Interrupt()
        with interrupt.caught():
            while not interrupt.asked and (job := source()) is not None:

                def report(status: Status, job: Job = job) -> bool:
                    return bool(listener.update(job, status)) or interrupt.asked

                listener.ended(job, ending_of(job, report))
        return interrupt.asked


def run_jobs(engine: Engine, jobs: Sequence[Job], listener: Listener) -> tuple[dict[str, Ending], bool]:
    """Run jobs that are known beforehand.

    Returns:
        How each ended, by name, and whether Ctrl-C stopped them.
    """
    left, endings = list(jobs), _Endings(listener)
    interrupted = engine.run(lambda: left.pop(0) if left else None, endings)
    return endings.by_name, interrupted


class _Endings:
    """Keeps how jobs ended, and passes everything on."""

    def __init__(self, listener: Listener) -> None:
        self.update, self._listener = listener.update, listener
        self.by_name: dict[str, Ending] = {}

    def ended(self, job: Job, ending: Ending) -> None:
        self.by_name[job.name] = ending
        self._listener.ended(job, ending)


class Mailbox:
    """Reports on their way from workers, and on the way back which jobs shall stop; a process of its own."""

    def __init__(self) -> None:
        self._reports: list[tuple[str, bytes]] = []
        self._stopped: frozenset[str] = frozenset()

    def tell(self, name: str, report: bytes) -> bool:
        """Leave a report of a job; returns whether it shall stop."""
        self._reports.append((name, report))
        return name in self._stopped

    def collect(self, stopped: Collection[str]) -> list[tuple[str, bytes]]:
        """Take the reports, each with its job's name, and set the jobs that shall stop."""
        reports, self._reports, self._stopped = self._reports, [], frozenset(stopped)
        return reports


def _perform(job: Job, tell: Callable[[str, bytes], bool]) -> Ending:
    """A job in a worker."""
    last = -_QUIET

    def report(status: Status) -> bool:
        nonlocal last
        now = time.monotonic()
        if now - last < _QUIET and not status.news and status.steps < status.total:
            return False
        last = now
        return tell(job.name, pickle.dumps(status))

    return ending_of(job, report)


class _Workers(Engine, ABC):
    """What engines with workers have in common."""

    @property
    @abstractmethod
    def slots(self) -> int:
        """Jobs at a time."""

    @abstractmethod
    def _submit(self, job: Job) -> Future[Ending]:
        """Begin a job in a worker."""

    @abstractmethod
    def _collect(self, stopped: Collection[str]) -> list[tuple[str, bytes]]:
        """See :meth:`Mailbox.collect`."""

    @abstractmethod
    def _death(self, error: BaseException) -> str | None:
        """How a worker died; None for another error."""

    def run(self, source: Source, listener: Listener) -> bool:
        """Run jobs until there are none; returns whether Ctrl-C stopped them, each at a checkpoint."""
        interrupt, running = Interrupt(), dict[Future[Ending], Job]()
        deaths, stopped = dict[str, int](), set[str]()
        self._collect(())
        with interrupt.caught():
            while True:
                while not interrupt.asked and len(running) < self.slots and (job := source()) is not None:
                    running[self._submit(job)] = job
                if not running:
                    return interrupt.asked
                done, _ = wait(running, _PATIENCE, FIRST_COMPLETED)
                jobs = {job.name: job for job in running.values()}
                for name, report in self._collect(jobs.keys() if interrupt.asked else stopped):
                    if name in jobs and listener.update(jobs[name], pickle.loads(report)):
                        stopped.add(name)
                for future in done:
                    job = running.pop(future)
                    error = future.exception()
                    death = None if error is None else self._death(error)
                    if death is not None and deaths.get(job.name, 0) < RETRIES:
                        deaths[job.name] = deaths.get(job.name, 0) + 1
                        running[self._submit(job)] = job
                        continue
                    if death is not None:
                        ending = Ending(error=f"its process died {RETRIES + 1} times ({death})")
                    else:
                        ending = Ending(error=" ".join(str(error).split())) if error else future.result()
                    listener.ended(job, ending)


class _Manager(BaseManager):
    """The process of a mailbox."""


_Manager.register("Mailbox", Mailbox)


class ProcessEngine(_Workers):
    """Jobs in processes of this machine."""

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._context = multiprocessing.get_context("spawn")
        # One process each, so that one that dies breaks no other.
        self._pools: dict[ProcessPoolExecutor, Future[Ending]] = {}

    def __enter__(self) -> Self:
        """Begin; workers start when there is work for them."""
        self._manager = _Manager(ctx=self._context)
        self._manager.start(begin_worker)
        self._mailbox: Any = self._manager.Mailbox()  # type: ignore[attr-defined]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the processes; at once after an error, as a second Ctrl-C."""
        if error is not None:
            for process in multiprocessing.active_children():
                process.kill()
        for pool in self._pools:
            pool.shutdown()
        self._manager.shutdown()

    @property
    def slots(self) -> int:
        """Jobs at a time."""
        return self._jobs

    def _submit(self, job: Job) -> Future[Ending]:
        idle = (pool for pool, last in self._pools.items() if last.done() and last.exception() is None)
        pool = next(idle, None) or ProcessPoolExecutor(1, self._context, begin_worker)
        try:
            self._pools[pool] = pool.submit(_perform, job, self._mailbox.tell)
        except BrokenExecutor as error:
            # Its process died meanwhile.
            self._pools[pool] = Future()
            self._pools[pool].set_exception(error)
        return self._pools[pool]

    def _collect(self, stopped: Collection[str]) -> list[tuple[str, bytes]]:
        reports: list[tuple[str, bytes]] = self._mailbox.collect(list(stopped))
        return reports

    def _death(self, error: BaseException) -> str | None:
        return "killed, or out of memory" if isinstance(error, BrokenExecutor) else None


_STARTS: Final = 3
"""How often it is tried to start Ray, which gives up after 30 s: on a busy machine that is short."""
_KNOCK: Final = 10.0
"""How long an address may take to answer, s; Ray would try for minutes."""
_STORE: Final = 128 * 2**20
"""Memory for objects, bytes: only configurations and numbers travel. Ray would take a third of all."""
_ENVIRONMENT: Final = {
    "RAY_USAGE_STATS_ENABLED": "0",
    # Ray would send the working folder of `uv run` to the workers.
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",
    # Workers without a GPU are left alone.
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
}
_ALONE: Final = {
    # Ray listens on 127.0.0.1 alone, as it does on Windows and macOS by default.
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    # Other users of the machine have no access, and no token stays in the home folder.
    "RAY_AUTH_MODE": "token",
    "RAY_AUTH_TOKEN": secrets.token_hex(32),
}
"""Of a Ray that is this process's own."""


class RayEngine(_Workers):
    """Jobs on Ray: on this machine, or on machines of a cluster that share a disk.

    Args:
        jobs: At a time, of one thread each; one of more threads takes the place of as many. Default: one a
            core.
        address: HOST:PORT of a cluster, of which this machine is a node; default: this machine alone.
    """

    def __init__(self, jobs: int | None = None, address: str | None = None) -> None:
        if find_spec("ray") is None:
            raise ConfigurationError("--engine ray needs ray: pip install 'motion-cueing-gym[ray]'")
        self._jobs, self._address = jobs, address
        self._folder: str | None = None

    def __enter__(self) -> Self:
        """Start Ray, or join the cluster.

        Raises:
            ConfigurationError: the address is no HOST:PORT.
            DataError: Ray does not start, or there is no cluster at the address.
        """
        os.environ.update(_ENVIRONMENT if self._address else {**_ENVIRONMENT, **_ALONE})
        import ray

        self._ray = ray
        if self._address:
            _knock(self._address)
        for left in reversed(range(1 if self._address else _STARTS)):
            try:
                ray.init(log_to_driver=False, logging_level="CRITICAL", **self._place())
                self._begin()
                break
            # Ctrl-C, too: it takes seconds, and a folder must not stay.
            except BaseException as error:
                self.__exit__(type(error), error, error.__traceback__)
                if not isinstance(error, Exception):
                    raise
                if not left:
                    raise DataError(f"Ray does not start ({' '.join(str(error).split())})") from None
        return self

    def _place(self) -> dict[str, Any]:
        """Arguments of ``ray.init`` that say where."""
        if self._address:
            return {"address": self._address}
        # Sockets lie in it, whose paths must be short; session logs, too, which nobody reads afterwards.
        self._folder = tempfile.mkdtemp(prefix="ray-")
        return {
            "num_cpus": self._jobs,
            "include_dashboard": False,
            "object_store_memory": _STORE,
            "_temp_dir": self._folder,
        }

    def _begin(self) -> None:
        ray = self._ray
        here = ray.get_runtime_context().get_node_id()
        nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
        self._largest = max(float(node.get("CPU", 0.0)) for node in nodes)
        near = ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(here, soft=False)
        actor = ray.remote(num_cpus=0, max_restarts=-1, scheduling_strategy=near)(Mailbox)
        self._mailbox = actor.remote()
        self._perform = ray.remote(_perform_on_ray)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop Ray, or leave the cluster; jobs that still run end at once."""
        self._ray.shutdown()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def slots(self) -> int:
        """Jobs at a time; a cluster may grow."""
        return self._jobs or max(1, int(self._ray.cluster_resources().get("CPU", 1)))

    def _submit(self, job: Job) -> Future[Ending]:
        needs = {
            # More cores than any machine has would wait for ever.
            "num_cpus": min(float(job.config.threads), self._largest),
            "num_gpus": int(job.config.device != "cpu"),
        }
        task = self._perform.options(name=job.name, max_retries=0, **needs)
        future: Future[Ending] = task.remote(job, self._mailbox, sys.argv, os.getcwd()).future()
        return future

    def _collect(self, stopped: Collection[str]) -> list[tuple[str, bytes]]:
        try:
            reports: list[tuple[str, bytes]] = self._ray.get(self._mailbox.collect.remote(list(stopped)))
        except self._ray.exceptions.RayActorError:
            # The mailbox's process died; Ray begins another.
            return []
        return reports

    def _death(self, error: BaseException) -> str | None:
        died = isinstance(error, self._ray.exceptions.RayError)
        of_task = isinstance(error, self._ray.exceptions.RayTaskError)
        return " ".join(str(error).split()) if died and not of_task else None


def _perform_on_ray(job: Job, mailbox: Any, arguments: list[str], folder: str) -> Ending:
    """A job in a worker, which stands in for the process that sent it."""
    import ray

    def tell(name: str, report: bytes) -> bool:
        try:
            return bool(ray.get(mailbox.tell.remote(name, report)))
        except ray.exceptions.RayActorError:
            # No mailbox for a moment; the training goes on.
            return False

    sys.argv = arguments
    if Path(folder).is_dir():
        os.chdir(folder)
    return _perform(job, tell)


def _knock(address: str) -> None:
    """Refuse an address where nobody listens."""
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit():
        raise ConfigurationError(f"--address {address}: expected HOST:PORT, as 10.0.0.5:6379")
    try:
        socket.create_connection((host, int(port)), timeout=_KNOCK).close()
    except (OSError, OverflowError, ValueError) as error:
        raise DataError(f"--address {address}: no Ray cluster answers ({error})") from None


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
        return RayEngine(jobs, address)
    return Engine() if jobs in (None, 1) else ProcessEngine(jobs or 1)
