"""Jobs without a learning library: they count in a file, and go on from it."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any


@dataclass(frozen=True)
class Where:
    """As much of a training's status as an engine looks at."""

    steps: int
    total: int
    news: bool = True


@dataclass(frozen=True)
class Counting:
    """Counts to ``total``.

    Args:
        path: File of the count.
        killed_at: Count at which its process is killed, the first time it gets there.
        mortal: Whether it is killed there every time.
        waits_at: Count at which it waits to be stopped.
        wrong: Whether it fails.
    """

    path: Path
    total: int = 4
    killed_at: int | None = None
    mortal: bool = False
    waits_at: int | None = None
    wrong: bool = False

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def config(self) -> Any:
        return SimpleNamespace(threads=1, device="cpu")

    def run(self, report: Any) -> Any:
        """Returns the counts of this process, and whether it was stopped."""
        if self.wrong:
            raise ZeroDivisionError("one by\nnothing")
        begun = len(self.path.read_text()) if self.path.exists() else 0
        for count in range(begun + 1, self.total + 1):
            self.path.write_text("x" * count)
            stop = report(Where(count, self.total))
            if count == self.killed_at or self.mortal:
                os.kill(os.getpid(), signal.SIGKILL)
            while count == self.waits_at and not stop:
                time.sleep(0.05)
                stop = report(Where(count, self.total))
            if stop:
                return begun + 1, count, True
        return begun + 1, self.total, False
