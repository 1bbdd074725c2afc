"""From samples to cues: gravity, and what a protocol leaves out; and whether the result follows the motion.

Specific force is f = a - g. Where a protocol has no angular velocity, it is the turn from one attitude to
the next. Where it lacks an acceleration, that is the change of the velocity. Both belong to the middle
between two samples, so they are late by half of a frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from ..cues import GRAVITY, Floats
from .sample import Sample

_DOWN: Final = np.array([0.0, 0.0, 1.0])
_LEVEL: Final = np.eye(3)


class CueEstimator:
    """Cues of samples in the order of their times."""

    def __init__(self) -> None:
        self._last: Sample | None = None

    def reset(self) -> None:
        """Forget the last sample: the next one is not its successor."""
        self._last = None

    def __call__(self, sample: Sample) -> Floats | None:
        """(6,) specific force and angular velocity, car axes; None while a part is not known yet.

        Args:
            sample: Later than the one before; with a time.
        """
        last, self._last = self._last, sample
        rate, force = sample.rate, sample.force
        if np.isnan(rate).any() and last is not None:
            rate = np.where(np.isnan(rate), _turned(last, sample), rate)
        if np.isnan(force).any():
            acceleration = sample.acceleration
            if np.isnan(acceleration).any() and last is not None:
                acceleration = np.where(np.isnan(acceleration), _sped_up(last, sample), acceleration)
            attitude = _LEVEL if sample.attitude is None else sample.attitude
            force = acceleration - GRAVITY * (attitude @ _DOWN)
        cues = np.concatenate([force, rate])
        return None if np.isnan(cues).any() else cues


def _turned(last: Sample, sample: Sample) -> Floats:
    """Angular velocity (3,) from one attitude to the next; NaN where there is none."""
    if last.attitude is None or sample.attitude is None:
        return np.full(3, np.nan)
    turn = Rotation.from_matrix(last.attitude @ sample.attitude.T).as_rotvec()
    return np.asarray(turn / (sample.time - last.time))


def _sped_up(last: Sample, sample: Sample) -> Floats:
    """Acceleration (3,) from one velocity to the next, car axes; NaN where there is none."""
    if last.attitude is None or sample.attitude is None:
        return np.full(3, np.nan)
    change = (sample.velocity - last.velocity) / (sample.time - last.time)
    return np.asarray(0.5 * (last.attitude + sample.attitude) @ change)


_LEAST: Final = {"f_x on dv/dt": 0.25, "f_y on v r": 0.25, "r on the rate of the course": 0.02}
"""Root mean square of what is followed, m/s^2 and rad/s, below which a slope says nothing."""
_LEAST_S: Final = 5.0
_LEAST_SPEED: Final = 3.0
"""Below this speed a course is noise, m/s."""
_SMOOTHED_S: Final = 0.3
"""Time constant of a low-pass on both sides of each comparison: bumps and wheelspin are not the drive, s."""


class MotionCheck:
    """Do force and yaw rate follow speed and course? Slopes far from 1 show a wrong unit, sign or axis.

    The same three slopes are what an import of a log shows.
    """

    def __init__(self) -> None:
        self._sums = {name: [0.0, 0.0, 0.0] for name in _LEAST}
        self._last: tuple[float, Floats] | None = None
        self._smooth = np.zeros((3, 2))

    def reset(self) -> None:
        """The next sample is not the successor of the last one."""
        self._last = None
        self._smooth = np.zeros((3, 2))

    def add(self, sample: Sample, cues: Floats) -> None:
        """Take a sample with its cues (6,) into account."""
        if np.isnan(sample.velocity).any():
            return
        last, self._last = self._last, (sample.time, sample.velocity)
        if last is None:
            return
        dt = sample.time - last[0]
        north, east = (last[1] + sample.velocity)[:2] / 2.0
        change = (sample.velocity - last[1])[:2] / dt
        speed = math.hypot(north, east)
        if not 0.0 < dt < 1.0 or speed < _LEAST_SPEED:
            return
        turning = float(north * change[1] - east * change[0]) / speed**2
        attitude = _LEVEL if sample.attitude is None else sample.attitude
        moving = cues[:3] + GRAVITY * (attitude @ _DOWN)
        along = float(north * change[0] + east * change[1]) / speed
        pairs = np.array([[moving[0], along], [moving[1], speed * turning], [cues[5], turning]])
        self._smooth += (pairs - self._smooth) * min(dt / _SMOOTHED_S, 1.0)
        for sums, (found, expected) in zip(self._sums.values(), self._smooth.tolist(), strict=True):
            sums[0] += dt
            sums[1] += dt * expected * expected
            sums[2] += dt * expected * found

    def slopes(self) -> dict[str, float]:
        """Slope of each comparison that the drive shows."""
        return {
            name: product / square
            for name, (seconds, square, product) in self._sums.items()
            if seconds >= _LEAST_S and square >= seconds * _LEAST[name] ** 2
        }

    def doubts(self) -> Iterator[str]:
        """Sentences about slopes that no car has."""
        for name, slope in self.slopes().items():
            if not 1.0 / 1.5 <= slope <= 1.5:
                what = name.split(" ")[0]
                kind = "it has the wrong sign" if slope < 0.0 else "its unit or its axis is wrong"
                yield f"{name}: the slope is {slope:.2f} instead of 1; {what} is not the car's: {kind}"
