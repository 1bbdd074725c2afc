"""What a log shows about its own device: the smoothed signals an estimate looks at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from ..cues import Floats
from .log_timing import low_pass

SMOOTHING_HZ: Final = 0.5
"""Cut-off for everything that is estimated: below it, the car moves as a point with its speed and course."""

STILL_EDGE_S: Final = 1.0
"""Cut from both ends of a standstill, where the body still rocks, s."""

LONGEST_DELAY_S: Final = 2.0
"""Delay of a speed (satellite receivers average) searched for, s."""

_DELAY_STEP_S: Final = 0.02
_WEAK_FIT: Final = 0.1
"""Share of the variance of dv/dt that the force must explain before a delay is believed."""


@dataclass(frozen=True)
class Evidence:
    """Signals below :data:`SMOOTHING_HZ`, device axes, SI units.

    Attributes:
        dt: Time step, s.
        force: (n, 3) specific force.
        rate: (n, 3) angular velocity.
        speed: (n,) or None.
        course: (n,) unwrapped heading over ground, clockwise positive, or None.
        still: (n,) true where the car stands.
    """

    dt: float
    force: Floats
    rate: Floats
    speed: Floats | None
    course: Floats | None
    still: NDArray[np.bool_]

    @property
    def speed_rate(self) -> Floats:
        """dv/dt (n,), zero where there is no speed."""
        if self.speed is None:
            return np.zeros(len(self.force))
        return np.asarray(np.gradient(self.speed, self.dt))

    def delayed(self, delay: float) -> Evidence:
        """The evidence with speed and course moved ``delay`` seconds earlier."""
        still = shift(self.still.astype(np.float64), delay, self.dt) > 0.5
        speed = None if self.speed is None else shift(self.speed, delay, self.dt)
        course = None if self.course is None else shift(self.course, delay, self.dt)
        return replace(self, speed=speed, course=course, still=still)


def gather(
    rate_hz: float,
    force: Floats,
    rate: Floats,
    speed: Floats | None,
    course: Floats | None,
    standstill: float,
) -> Evidence:
    """Smooth the signals of a log and find where the car stands (slower than ``standstill``, m/s)."""

    def smooth(values: Floats) -> Floats:
        return low_pass(values, rate_hz, SMOOTHING_HZ)

    if speed is None:
        still = np.zeros(len(force), dtype=np.bool_)
    else:
        window = np.ones(2 * int(STILL_EDGE_S * rate_hz) + 1, dtype=np.bool_)
        still = binary_erosion(speed < standstill, window, border_value=1)
    return Evidence(
        dt=1.0 / rate_hz,
        force=smooth(force),
        rate=smooth(rate),
        speed=None if speed is None else smooth(speed),
        course=None if course is None else smooth(course),
        still=still,
    )


def shift(values: Floats, delay: float, dt: float) -> Floats:
    """Values (n,) ``delay`` seconds earlier, the last one held."""
    time = dt * np.arange(len(values))
    return np.asarray(np.interp(time + delay, time, values))


def speed_delay(evidence: Evidence) -> float:
    """How long the speed lags behind the force, s: where the force explains most of dv/dt.

    The forward axis is not known yet, so dv/dt is regressed on all three axes.
    """
    if evidence.speed is None:
        return 0.0
    regressors = np.column_stack([evidence.force, np.ones(len(evidence.force))])
    basis = np.linalg.qr(regressors)[0]
    delays = np.arange(0.0, LONGEST_DELAY_S + _DELAY_STEP_S / 2, _DELAY_STEP_S)
    fits = [_explained(basis, shift(evidence.speed_rate, delay, evidence.dt)) for delay in delays]
    best = int(np.argmax(fits))
    return float(delays[best]) if fits[best] > _WEAK_FIT else 0.0


def _explained(basis: Floats, target: Floats) -> float:
    centred = target - target.mean()
    total = float(centred @ centred)
    return float(np.sum((basis.T @ centred) ** 2)) / total if total > 0.0 else 0.0


def correlation(a: Floats, b: Floats) -> float:
    """Pearson's correlation, 0 where a signal does not vary."""
    a, b = a - a.mean(), b - b.mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale > 0.0 else 0.0
