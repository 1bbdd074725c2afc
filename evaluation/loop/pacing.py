"""Periods that begin at fixed times: deadlines are absolute, so that no delay adds up."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from ...envs.errors import ConfigurationError


class Pace:
    """The times at which periods begin.

    What is paced never hurries: a period that should have begun and ended meanwhile is left out, and what is
    paced goes on where it was, later.

    Args:
        rate: Periods a second.
        clock: Nanoseconds now.

    Attributes:
        overrun: Periods that were not over when the next should have begun.
        skipped: Periods left out.
    """

    def __init__(self, rate: int, clock: Callable[[], int] = time.perf_counter_ns) -> None:
        self._rate, self._clock = rate, clock
        self._begin, self._next = clock(), 0
        self.overrun = self.skipped = 0

    @property
    def deadline(self) -> int:
        """When the next period begins, ns; exact for ever, as no step is added up."""
        return self._begin + self._next * 1_000_000_000 // self._rate

    def done(self) -> None:
        """A period is over: go to the next that is not over."""
        self._next += 1
        now = self._clock()
        if now <= self.deadline:
            return
        self.overrun += 1
        begun = max((now - self._begin) * self._rate // 1_000_000_000, self._next)
        self.skipped += begun - self._next
        self._next = begun


@contextmanager
def undisturbed(cpu: int | None = None, priority: int | None = None) -> Iterator[None]:
    """Without the garbage collector; on one core and with real-time priority, where asked for.

    Args:
        cpu: Number of the core.
        priority: Of SCHED_FIFO, 1 to 99.

    Raises:
        ConfigurationError: the system refuses.
    """
    with ExitStack() as after:
        try:
            _prefer(cpu, priority, after)
        except (AttributeError, OSError, OverflowError) as error:
            raise ConfigurationError(
                f"the system refuses --cpu {cpu} or --priority {priority} ({error}); leave it out, or run as "
                "one who may"
            ) from None
        gc.collect()
        gc.freeze()
        after.callback(gc.unfreeze)
        gc.disable()
        after.callback(gc.enable)
        yield


def _prefer(cpu: int | None, priority: int | None, after: ExitStack) -> None:
    """Take core and priority; ``after`` gives them back: logs are written as any other program writes."""
    if cpu is not None:
        cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {cpu})
        after.callback(os.sched_setaffinity, 0, cores)
    if priority is not None:
        policy, level = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        after.callback(os.sched_setscheduler, 0, policy, level)
