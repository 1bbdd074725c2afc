"""What happens in a batch of drives: errors of the cues, use of limits, and limits exceeded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.platform import Platform
from ...envs.simulator import Simulator
from ..criteria import Criteria
from ..metrics import cue_error
from .batch_drivers import BatchDriver
from .limits import KINDS, TrueLimits
from .results import Endured

Floats = NDArray[np.float64]

_ROWS: Final = 8192
"""Time steps of drives that are looked at together: some ten megabytes."""

_CHANNELS: Final = (("wanted", "felt", "cue_error"), ("sensed_wanted", "sensed_felt", "perceived_cue_error"))


class Watch:
    """Looks at the states of a simulator, a block of time steps at a time.

    Args:
        simulator: With the drives.
        platform: The machine, whose limits count.
    """

    def __init__(self, simulator: Simulator, platform: Platform) -> None:
        self._simulator, n = simulator, simulator.n
        self._rows = np.zeros((max(1, _ROWS // n), n), dtype=simulator.state.dtype)
        self._filled, self._criteria = 0, Criteria()
        self.limits = TrueLimits(platform, n, simulator.dt)
        self.samples = 0
        self.at_limit = np.zeros(n, dtype=np.int64)
        self.beyond = np.zeros(n, dtype=np.int64)
        self.exceeded = {kind: np.zeros(n, dtype=np.int64) for kind in KINDS}
        self.errors = {name: np.zeros(n) for _, _, name in _CHANNELS}

    def note(self) -> bool:
        """Take the state now; returns whether a block is full and was looked at."""
        # As bytes, which NumPy copies at once; structures it copies field by field.
        self._rows[self._filled].view(np.uint8)[...] = self._simulator.state.view(np.uint8)
        self._filled += 1
        if self._filled < len(self._rows):
            return False
        self.look()
        return True

    def look(self) -> None:
        """Look at what was noted since the last time."""
        rows, self._filled = self._rows[: self._filled], 0
        if not len(rows):
            return
        self.samples += len(rows)
        self.at_limit += np.count_nonzero(rows["limits"], axis=0)
        found = self.limits.exceeded(rows["motion"])
        for kind, flags in found.items():
            self.exceeded[kind] += flags.sum(axis=0)
        self.beyond += np.any(list(found.values()), axis=0).sum(axis=0)
        for wanted, felt, name in _CHANNELS:
            self.errors[name] += self._errors(rows[wanted], rows[felt])

    def _errors(self, wanted: NDArray[Any], felt: NDArray[Any]) -> Floats:
        """(n,) sums over the block."""
        error = cue_error(_cues(wanted), _cues(felt), self._criteria)
        return np.asarray(error.reshape(wanted.shape).sum(axis=0))


def _cues(side: NDArray[Any]) -> Floats:
    """(rows, 6) specific force and angular velocity."""
    flat = side.reshape(-1)
    return np.hstack([flat["force"], flat["rate"]]).astype(np.float64)


def watched(
    driver: BatchDriver, platform: Platform, tell: Callable[[int], None] = lambda steps: None
) -> tuple[list[Endured], dict[str, float]]:
    """Drive drives of one length to their end.

    Args:
        driver: At rest at the first sample.
        platform: The machine as it should be.
        tell: Called now and then with the time steps done since; what it raises ends the drive.

    Returns:
        What came of each drive, and of all: the largest use of each limit and the least clearance of
        singular poses.
    """
    watch = Watch(driver.simulator, platform)
    steps, told = len(driver.simulator.drives[0]) - 1, 0
    watch.note()
    for k, _ in zip(range(1, steps + 1), driver.steps(), strict=False):
        if watch.note():
            tell(k - told)
            told = k
    watch.look()
    tell(steps - told)
    return _outcomes(watch, driver.not_finite), {**watch.limits.use, "clearance": watch.limits.clearance}


def _outcomes(watch: Watch, not_finite: NDArray[np.int64]) -> list[Endured]:
    return [
        Endured(
            samples=watch.samples,
            **{name: _mean(total[i], watch.samples) for name, total in watch.errors.items()},
            at_limit=float(watch.at_limit[i] / watch.samples),
            beyond=int(watch.beyond[i]),
            exceeded={kind: int(counts[i]) for kind, counts in watch.exceeded.items()},
            actions_not_finite=int(not_finite[i]),
        )
        for i in range(len(not_finite))
    ]


def _mean(total: float, samples: int) -> float | None:
    return float(total / samples) if np.isfinite(total) else None
