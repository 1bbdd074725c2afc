"""What an engine is, and what it runs: jobs that can be begun again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from ..config import TrainingConfig
    from ..training import Status

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
