"""Resampling of telemetry: from frames at a game's own rate and clock to cues at any time, without a beat.

Frames at 60 Hz that are held until the next one arrives give steps at 60 Hz. A policy that looks 100 times a
second sees them as a pattern that comes back 20 times a second. Here the value at a time is a local linear
regression over the frames around it, weighted by a B-spline that is as wide as the frames are apart. Its
spectrum is zero at the rate of the frames and at all its multiples, so that no image of the drive is left
there. A constant and a straight line come out exactly, also where frames are missing or unevenly spaced.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from ..envs.simulator.simulator import TIME_STEP

Floats = NDArray[np.float64]

_KEPT: Final = 128
"""Frames that are kept: more than the widest spline covers at 1 kHz."""
_MEMORY: Final = 60
"""Frames by which a line is fitted to the stamps."""
_EVEN: Final = 1.5
"""Stamps of even frames are at most so many ticks from where they are due."""
_TREND: Final = 3
"""Frames whose trend leads on."""
_FADES: Final = 0.02
"""Share by which the usual step follows the median of the last ones: the delay must not jump."""
_STEPS: Final = 31
"""Steps of that median."""


class SteadyClock:
    """Stamps without the steps of a coarse clock: a line through those of even frames.

    Stamps in whole milliseconds of frames at 60 Hz are 16 and 17 ms apart. An alpha-beta filter, whose gains
    are those of a growing least-squares line, finds the frames' own times. A stamp that is further than one
    and a half ticks from where it was due is believed as it is.

    Args:
        tick: Resolution of the clock, or jitter of arrivals, s; 0 leaves stamps as they are.
    """

    def __init__(self, tick: float) -> None:
        self._tick = tick
        self._last: tuple[float, float] | None = None
        self._step, self._even = 0.0, 0

    def reset(self) -> None:
        """The next stamp is the first."""
        self._last, self._step, self._even = None, 0.0, 0

    def __call__(self, stamp: float) -> float:
        """The time of a frame, s, always later than that of the one before."""
        if self._last is None or self._tick == 0.0:
            self._last = stamp, stamp
            return stamp
        last, before = self._last
        due = last + self._step
        error = stamp - due
        if self._step == 0.0 or abs(error) > _EVEN * self._tick:
            # Not even, or not known to be.
            time = max(stamp, math.nextafter(last, math.inf))
            self._step, self._even = stamp - before, 1
        else:
            self._even = k = min(self._even + 1, _MEMORY)
            time = max(
                due + error * 2.0 * (2.0 * k + 1.0) / ((k + 1.0) * (k + 2.0)), math.nextafter(last, math.inf)
            )
            self._step += error * 6.0 / ((k + 1.0) * (k + 2.0))
        self._last = time, stamp
        return time


class Resampler:
    """Frames of cues, and the cues at any time among them.

    Args:
        smoothing: Half of the spline's width in frames: 1 interpolates linearly, 2 and 3 are smoother and
            later.
        shortest: Least width of a frame, s; frames that come faster are averaged.

    Attributes:
        step: Usual time between frames, s; 0 before two came.
    """

    def __init__(self, smoothing: int, shortest: float = TIME_STEP) -> None:
        self._smoothing, self._shortest = smoothing, shortest
        self._spline = BSpline.basis_element(np.arange(-smoothing, smoothing + 1.0), extrapolate=False)
        self._reach = max(smoothing - 0.6, 0.99)
        self.step = 0.0
        self._steps: deque[float] = deque(maxlen=_STEPS)
        self._frames: deque[tuple[float, Floats]] = deque(maxlen=_KEPT)

    def reset(self) -> None:
        """Forget all frames."""
        self._frames.clear()

    @property
    def width(self) -> float:
        """Width of the spline's pieces, s."""
        return max(self.step, self._shortest)

    @property
    def delay(self) -> float:
        """Age of the newest time for which all frames are there, s."""
        return self._smoothing * self.width

    @property
    def newest(self) -> float:
        """Time of the newest frame, s; minus infinity before any."""
        return self._frames[-1][0] if self._frames else -math.inf

    def add(self, time: float, cues: Floats) -> None:
        """Take a frame that is later than the one before."""
        if self._frames:
            step = time - self._frames[-1][0]
            self._steps.append(step)
            # The median knows nothing of frames that are missing.
            self.step += (_FADES if self.step else 1.0) * (float(np.median(self._steps)) - self.step)
        self._frames.append((time, cues))

    def at(self, time: float) -> Floats:
        """(n,) cues at a time, s; for ``delay`` after the newest frame led on by their trend, then held."""
        time = min(max(time, self._frames[0][0]), self.newest + self.delay)
        times = np.array([frame[0] for frame in self._frames])
        values = np.array([frame[1] for frame in self._frames])
        apart = times - time
        # Where frames are missing, the spline is wide enough for one before and one after.
        after = max(int(np.searchsorted(apart, 0.0)), 1)
        ends = apart[after - 1 : after + 1] if after < len(apart) else apart[-_TREND:]
        width = max(self.width, float(np.abs(ends).max()) / self._reach)
        weights = np.nan_to_num(self._spline(apart / width))
        total, first, second = (float(weights @ apart**power) for power in range(3))
        spread = total * second - first * first
        if spread > 1e-6 * (total * width) ** 2:
            return np.asarray((weights * (second - first * apart)) @ values / spread)
        return np.asarray(values[int(np.argmin(np.abs(apart)))])
