"""Cues that come while the machine moves, where its kernels look for those of a drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import GRAVITY, CueTrace
from ...envs.mirror import Mirror
from ...envs.observation import SCALES
from ...envs.simulator import TIME_STEP, Simulator

Floats = NDArray[np.float64]

AT_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Cues of a car that stands: specific force and angular velocity; read-only."""
AT_REST.setflags(write=False)

_SCALE: Final = np.repeat([SCALES["wanted_force"], SCALES["wanted_rate"]], 3)

NOW: Final = 1
"""Row of the cues that are wanted now; the kernels step to it from the row before."""


def standing(ahead: int) -> CueTrace:
    """The drive whose rows :class:`LiveCues` fills: what was, what is, and ``ahead`` steps to come."""
    n = NOW + 1 + ahead
    time = np.asarray(TIME_STEP * np.arange(n), dtype=np.float64)
    return CueTrace("live", time, np.tile(AT_REST[:3], (n, 1)), np.zeros((n, 3)))


class LiveCues:
    """The rows of a simulator's only drive, moved on by one each time step, the newest cues at their end.

    A policy that looks ahead sees the newest cues that far ahead.

    Args:
        simulator: With one environment on the CPU and the drive of :func:`standing`.
        memory: Where an environment keeps low-passed cues of each row.
        time_constants: Of the low-passes, s.
    """

    def __init__(
        self, simulator: Simulator, memory: Mirror | None = None, time_constants: Sequence[float] = ()
    ) -> None:
        drives = simulator.constants[2]
        self._simulator = simulator
        self._rows = [drives.force.numpy(), drives.rate.numpy(), drives.rate_derivative.numpy()]
        # Views that are made once: each step of a millisecond counts.
        self._moves = [(rows[:-1], rows[1:], rows[-1]) for rows in self._rows]
        self._samples = [states.numpy()["sample"] for states, _ in simulator.copies]
        self._memory = memory.view if memory is not None and time_constants else None
        self._poles = np.exp(-TIME_STEP / np.array(time_constants, dtype=np.float64))[:, None]
        self._past: Floats = np.tile(self._scaled(), (len(time_constants), 1))

    @property
    def wanted(self) -> Floats:
        """(6,) cues wanted now."""
        return np.concatenate([self._rows[0][NOW], self._rows[1][NOW]])

    def put(self, cues: Floats) -> None:
        """Move on by a time step, with the newest cues (6,): force, m/s^2, angular velocity, rad/s."""
        change = (cues[3:] - self._moves[1][2]) / TIME_STEP
        for (earlier, later, last), newest in zip(self._moves, (cues[:3], cues[3:], change), strict=True):
            earlier[...] = later
            last[...] = newest
        # The kernels count samples; here the sample they step to is always the same row.
        self._samples[self._simulator.current][...] = NOW - 1
        if self._memory is not None:
            self._past = self._poles * self._past + (1.0 - self._poles) * self._scaled()
            self._remember()

    def begin(self) -> None:
        """Take the car to have moved for ever as it moves now, as at the beginning of any drive."""
        self._past[...] = self._scaled()
        self._remember()

    def _scaled(self) -> Floats:
        """(6,) cues wanted now, as an observation scales them."""
        return np.asarray((self.wanted - AT_REST) / _SCALE)

    def _remember(self) -> None:
        if self._memory is not None:
            self._memory[NOW] = self._past.ravel()
