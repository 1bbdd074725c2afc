"""Jobs on Ray: on this machine, or on the machines of a cluster that share a disk.

Jobs travel to the workers, their results back. What a training keeps (checkpoints, logs, agents) lies in
files on a disk that all machines see. A job whose worker or machine died is begun again elsewhere by Ray, and
goes on from its last checkpoint.
"""

from __future__ import annotations

import os
import pickle
import secrets
import shutil
import socket
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

from ...envs.errors import ConfigurationError, DataError
from ..training import Interrupt
from .engines import RETRIES, Desk, Ending, Job, Listener, Source, ending_of

if TYPE_CHECKING:
    from ..training import Status

_PATIENCE: Final = 0.2
"""Time between looks at news and Ctrl-C, s."""
_QUIET: Final = 0.5
"""Least time between reports of a worker without news, s."""
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
    # Other users of the machine are kept out, and no token is left in the home folder.
    "RAY_AUTH_MODE": "token",
    "RAY_AUTH_TOKEN": secrets.token_hex(32),
}
"""Of a Ray that is this process's own."""


class RayEngine:
    """See :class:`~.job.Engine`.

    Args:
        jobs: At a time, of one thread each; one of more threads takes the place of as many. Default: one a
            core.
        address: HOST:PORT of a cluster, of which this machine is a node; default: this machine alone.

    Raises:
        ConfigurationError: Ray is not installed.
    """

    def __init__(self, jobs: int | None = None, address: str | None = None) -> None:
        if find_spec("ray") is None:
            raise ConfigurationError("--engine ray needs ray: pip install 'motion-cueing-gym[ray]'")
        self._jobs, self._address = jobs, address
        self._folder: str | None = None

    def __enter__(self) -> RayEngine:
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
        desk = ray.remote(num_cpus=0, max_restarts=-1, scheduling_strategy=near)(Desk)
        self._desk = desk.remote()
        self._perform = ray.remote(_perform)

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

    def run(self, source: Source, listener: Listener) -> bool:
        """Run jobs until there are none; returns whether Ctrl-C stopped them."""
        interrupt = Interrupt()
        running: dict[Any, Job] = {}
        # What was asked in an earlier run must not stop this one.
        self._pass_on({}, listener, stop=False)
        with interrupt.caught():
            while True:
                while not interrupt.asked and len(running) < self.slots and (job := source()) is not None:
                    running[self._start(job)] = job
                if not running:
                    return interrupt.asked
                done, _ = self._ray.wait(list(running), timeout=_PATIENCE)
                self._pass_on({job.name: job for job in running.values()}, listener, interrupt.asked)
                for place in done:
                    listener.ended(running.pop(place), self._ending(place))

    def _start(self, job: Job) -> Any:
        cores = min(float(job.config.threads), self._largest)
        needs = {"num_cpus": cores, "num_gpus": int(job.config.device != "cpu")}
        task = self._perform.options(name=job.name, max_retries=RETRIES, **needs)
        return task.remote(job, self._desk, sys.argv, os.getcwd())

    def _pass_on(self, jobs: dict[str, Job], listener: Listener, stop: bool) -> None:
        """News from the desk to the listener, and back whether to stop."""
        try:
            news = self._ray.get(self._desk.hear.remote(stop))
        except self._ray.exceptions.RayActorError:
            # Its process died; Ray begins another.
            return
        for name, packed in news:
            if name in jobs:
                listener.told(jobs[name], pickle.loads(packed))

    def _ending(self, place: Any) -> Ending:
        try:
            ending: Ending = self._ray.get(place)
        except self._ray.exceptions.WorkerCrashedError:
            return Ending(error=f"its process died {RETRIES + 1} times")
        except self._ray.exceptions.RayError as error:
            return Ending(error=" ".join(str(error).split()))
        return ending


def _knock(address: str) -> None:
    """Refuse an address where nobody listens.

    Raises:
        ConfigurationError: it is no HOST:PORT.
        DataError: nobody does.
    """
    host, _, port = address.rpartition(":")
    if not host or not port.isdigit():
        raise ConfigurationError(f"--address {address}: expected HOST:PORT, as 10.0.0.5:6379")
    try:
        socket.create_connection((host, int(port)), timeout=_KNOCK).close()
    except (OSError, OverflowError, ValueError) as error:
        raise DataError(f"--address {address}: no Ray cluster answers ({error})") from None


def _perform(job: Job, desk: Any, arguments: list[str], folder: str) -> Ending:
    """A job in a worker, which stands in for the process that sent it."""
    sys.argv = arguments
    if Path(folder).is_dir():
        os.chdir(folder)
    return ending_of(job, _Report(job.name, desk))


class _Report:
    """See :data:`~.job.Report`."""

    def __init__(self, name: str, desk: Any) -> None:
        self._name, self._desk = name, desk
        self._last = -_QUIET

    def __call__(self, status: Status) -> bool:
        import ray

        now = time.monotonic()
        if now - self._last < _QUIET and not status.news:
            return False
        self._last = now
        try:
            return bool(ray.get(self._desk.tell.remote(self._name, pickle.dumps(status))))
        except ray.exceptions.RayActorError:
            # Nobody at the desk for a moment; the training goes on.
            return False
