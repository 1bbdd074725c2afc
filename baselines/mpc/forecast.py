"""The car's cues over the horizon: known, or guessed."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import lfilter

from ...envs.cues import GRAVITY, CueTrace
from ...envs.simulator import TIME_STEP
from .grid import Grid
from .linearisation import Floats
from .parameters import Forecast

REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Specific force and angular velocity at rest on level ground."""


class Forecaster:
    """Gives the cues at the nodes of a grid.

    What is not known goes on from the last that is, in two parts: what lasts, the low-pass m of the cues
    u so far, and what is new,

        u(t) = rest + (m_0 - rest) exp(-t / lasting) + (u_0 - m_0) exp(-t / decay).

    Args:
        grid: The nodes.
        forecast: What is known.
        cues: The drive, where some of it is known.
    """

    def __init__(self, grid: Grid, forecast: Forecast, cues: CueTrace | None = None) -> None:
        averages = grid.averages(TIME_STEP)
        count = averages.shape[1]
        known = min(round(forecast.preview / TIME_STEP), count) if cues is not None else 0
        self._gain = 1.0 - np.exp(-TIME_STEP / forecast.memory)
        self._known, self._guessed = averages[:, :known], averages[:, known:]
        after = TIME_STEP * np.arange(1, count - known + 1)[:, None]
        constants = np.array([*forecast.force_decay, *[forecast.rate_decay] * 3])
        self._new = self._guessed @ np.exp(-after / constants)  # (n, 6)
        self._lasting = self._guessed @ np.exp(-after / forecast.lasting_decay)  # (n, 1)
        self._level = self._guessed.sum(axis=1, keepdims=True)
        if cues is not None:
            self._drive = _padded(cues, known)
            self._lasts = lfilter(
                [self._gain],
                [1.0, self._gain - 1.0],
                self._drive,
                axis=0,
                zi=(1.0 - self._gain) * self._drive[:1],
            )[0]

    def remember(self, lasts: Floats | None, now: Floats) -> Floats:
        """(6,) what lasts, from what lasted a time step ago (None at the start) and the cues now."""
        return now if lasts is None else lasts + self._gain * (now - lasts)

    def __call__(self, now: Floats, lasts: Floats, sample: int) -> Floats:
        """(n, 6) cues at the nodes, SI.

        Args:
            now: (6,) cues at this sample.
            lasts: (6,) what of them lasts.
            sample: Its number in the drive.
        """
        count = self._known.shape[1]
        if count == 0:
            return self._guess(now, lasts)
        last = min(sample, len(self._drive) - count - 1) + count
        ahead = self._drive[last + 1 - count : last + 1]
        return np.asarray(self._known @ ahead + self._guess(ahead[-1], self._lasts[last]))

    def _guess(self, now: Floats, lasts: Floats) -> Floats:
        return np.asarray(self._level * REST + self._lasting * (lasts - REST) + self._new * (now - lasts))


def _padded(cues: CueTrace, count: int) -> Floats:
    """The cues of a drive (samples + count, 6), its last held after its end."""
    drive = np.hstack([cues.specific_force, cues.angular_velocity])
    return np.concatenate([drive, np.repeat(drive[-1:], count, axis=0)])
