"""The car's cues over the horizon: known, or guessed."""

from __future__ import annotations

from typing import Final

import numpy as np

from ...envs.cues import GRAVITY, CueTrace
from ...envs.simulator import TIME_STEP
from .grid import Grid
from .linearisation import Floats
from .parameters import Forecast

REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Specific force and angular velocity at rest on level ground."""


class Forecaster:
    """Gives the cues at the nodes of a grid.

    What is not known decays from the last that is: u(t) = rest + (u(t_0) - rest) exp(-(t - t_0) / tau).

    Args:
        grid: The nodes.
        forecast: What is known.
        cues: The drive, where some of it is known.
    """

    def __init__(self, grid: Grid, forecast: Forecast, cues: CueTrace | None = None) -> None:
        self._averages = grid.averages(TIME_STEP)
        count = self._averages.shape[1]
        self._known = min(round(forecast.preview / TIME_STEP), count) if cues is not None else 0
        self._drive = None if cues is None else _padded(cues, count)
        after = TIME_STEP * np.arange(1, count - self._known + 1)
        constants = np.repeat([forecast.force_decay, forecast.rate_decay], 3)
        decay = np.exp(-after[:, None] / constants)  # (count - known, 6)
        self._decay = self._averages[:, self._known :] @ decay
        self._level = self._averages[:, self._known :].sum(axis=1, keepdims=True)

    def __call__(self, now: Floats, sample: int) -> Floats:
        """(n, 6) cues at the nodes, SI.

        Args:
            now: (6,) cues at this sample.
            sample: Its number in the drive.
        """
        if self._drive is None or self._known == 0:
            return np.asarray(self._level * REST + self._decay * (now - REST))
        sample = min(sample, len(self._drive) - self._averages.shape[1] - 1)
        ahead = self._drive[sample + 1 : sample + 1 + self._known]
        known = self._averages[:, : self._known] @ ahead
        return np.asarray(known + self._level * REST + self._decay * (ahead[-1] - REST))


def _padded(cues: CueTrace, count: int) -> Floats:
    """The cues of a drive (samples + count, 6), its last held after its end."""
    drive = np.hstack([cues.specific_force, cues.angular_velocity])
    return np.concatenate([drive, np.repeat(drive[-1:], count, axis=0)])
