r"""Cues of the car as a late machine needs them: earlier where they are known ahead, else predicted.

The prediction is a linear filter: the change of each cue over the next k steps, from all six cues now and up
to 0.64 s before, within limits. Its coefficients for each k were fitted by least squares to random drives
with noise of sensors (``python -m benchmarks.cue_predictor``). What it knows of cars is how their six cues
hang together: a car yaws before it is pushed sideways.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import load_file

from ...envs.cues import GRAVITY, CueTrace
from ...envs.simulator.simulator import TIME_STEP
from .options import CompensationOptions

Floats = NDArray[np.float64]

PAST: Final = (0, 1, 2, 4, 8, 16, 32, 64)
"""Time steps before now of the cues that a prediction knows."""

FURTHEST: Final = 30
"""Time steps ahead of the furthest prediction."""

COEFFICIENTS: Final = Path(__file__).with_name("predictor.safetensors")
"""``coefficients`` (FURTHEST, 6 len(PAST), 6): changes of the cues by their past."""

_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])


@cache
def _coefficients() -> Floats:
    return load_file(COEFFICIENTS)["coefficients"].astype(np.float64)


def steps_of(lateness: float) -> int:
    """A lateness, s, in whole time steps."""
    return round(lateness / TIME_STEP)


def earlier(cues: CueTrace, steps: int, hold: bool = False) -> CueTrace:
    """The cues of a drive, a number of time steps earlier.

    Args:
        cues: Of the drive.
        steps: Time steps.
        hold: Whether the last cues are held, so that the drive is as long as it was; else it is shorter.
    """
    if steps == 0:
        return cues
    n = len(cues)
    length = n if hold else max(2, n - steps)
    rows = np.minimum(np.arange(length) + steps, n - 1)
    return replace(
        cues,
        time=cues.time[:length],
        specific_force=cues.specific_force[rows],
        angular_velocity=cues.angular_velocity[rows],
        angular_acceleration=cues.angular_acceleration[rows],
        channels={name: values[rows] for name, values in cues.channels.items()},
        road=None if cues.road is None else cues.road.resampled(cues.time, cues.time[rows]),
    )


class CuePredictor:
    """Predicts the cues of one car, time step by time step.

    Args:
        steps: Time steps ahead; beyond :data:`FURTHEST` the prediction is that far.
        options: With its limits.
    """

    def __init__(self, steps: int, options: CompensationOptions) -> None:
        self._steps = min(steps, FURTHEST)
        self._limits = np.repeat([options.force_change, options.rate_change], 3)
        self._weights = _coefficients()[self._steps - 1] if self._steps else np.zeros((6 * len(PAST), 6))
        self._past = np.zeros((PAST[-1] + 1, 6))

    def begin(self, cues: Floats) -> None:
        """Cues (6,) were as now for ever."""
        self._past[...] = cues - _REST

    def put(self, cues: Floats) -> Floats:
        """The cues (6,) predicted, from those now."""
        if self._steps == 0:
            return cues
        self._past[1:] = self._past[:-1]
        self._past[0] = cues - _REST
        change = self._past[list(PAST)].ravel() @ self._weights
        return np.asarray(cues + np.clip(change, -self._limits, self._limits))

    def whole(self, cues: CueTrace) -> CueTrace:
        """What :meth:`put` gives for each sample of a drive, whose car moved before as at the first."""
        if self._steps == 0:
            return cues
        now = np.hstack([cues.specific_force, cues.angular_velocity])
        samples = np.arange(len(now))
        known = np.concatenate([(now - _REST)[np.maximum(samples - k, 0)] for k in PAST], axis=1)
        seen = now + np.clip(known @ self._weights, -self._limits, self._limits)
        change = np.diff(seen[:, 3:], axis=0, prepend=seen[:1, 3:]) / cues.dt
        return replace(
            cues,
            specific_force=seen[:, :3],
            angular_velocity=seen[:, 3:],
            angular_acceleration=change,
        )
