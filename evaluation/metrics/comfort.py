"""Ride comfort and motion sickness dose by the frequency weightings of ISO 2631-1."""

from __future__ import annotations

import dataclasses
from math import inf, pi, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from ..trajectory import Floats

_DECAY: Final = 60.0
"""Time in which the response of every weighting has decayed to below 1e-8, s."""


@dataclasses.dataclass(frozen=True)
class Weighting:
    """A frequency weighting of ISO 2631-1: band limits, then a transition from acceleration to velocity.

    With w_i = 2 pi f_i::

        H(s) = s^2/(s^2 + sqrt2 w1 s + w1^2) * w2^2/(s^2 + sqrt2 w2 s + w2^2)
               * (1 + s/w3)/(1 + s/(Q4 w4) + s^2/w4^2)
               * (1 + s/(Q5 w5) + s^2/w5^2)/(1 + s/(Q6 w6) + s^2/w6^2) * (w5/w6)^2

    Args:
        low: f1, high-pass, Hz.
        high: f2, low-pass, Hz.
        transition: f3, f4 (Hz) and Q4; f3 may be infinite.
        step: f5 (Hz), Q5, f6 (Hz) and Q6 of the upward step, where there is one.
    """

    low: float
    high: float
    transition: tuple[float, float, float]
    step: tuple[float, float, float, float] | None = None

    def response(self, frequency: Floats) -> NDArray[np.complex128]:
        """H at frequencies in Hz."""
        s = 2j * pi * np.asarray(frequency, dtype=np.float64)
        w1, w2 = 2.0 * pi * self.low, 2.0 * pi * self.high
        f3, f4, q4 = self.transition
        w3, w4 = 2.0 * pi * f3, 2.0 * pi * f4
        h = s**2 / (s**2 + sqrt(2.0) * w1 * s + w1**2) * w2**2 / (s**2 + sqrt(2.0) * w2 * s + w2**2)
        h *= (1.0 + s / w3) / (1.0 + s / (q4 * w4) + s**2 / w4**2)
        if self.step is not None:
            f5, q5, f6, q6 = self.step
            w5, w6 = 2.0 * pi * f5, 2.0 * pi * f6
            h *= (1.0 + s / (q5 * w5) + s**2 / w5**2) / (1.0 + s / (q6 * w6) + s**2 / w6**2) * (w5 / w6) ** 2
        return np.asarray(h)

    def apply(self, values: Floats, dt: float) -> Floats:
        """(n, k) weighted signals. Before its first sample each signal was constant.

        The response is applied in the frequency domain. It is therefore that of the standard up to half the
        sampling rate, where a bilinear filter at 100 Hz is 7 % off in Wk at 16 Hz.
        """
        count = next_fast_len(len(values) + round(_DECAY / dt), real=True)
        spectrum = rfft(values - values[0], count, axis=0)
        response = self.response(rfftfreq(count, dt))[:, None]
        return np.asarray(irfft(spectrum * response, count, axis=0)[: len(values)])


WK: Final = Weighting(0.4, 100.0, (12.5, 12.5, 0.63), (2.37, 0.91, 3.35, 0.91))
"""Wk: vertical, comfort."""
WD: Final = Weighting(0.4, 100.0, (2.0, 2.0, 0.63))
"""Wd: horizontal, comfort."""
WF: Final = Weighting(0.08, 0.63, (inf, 0.25, 0.86), (0.0625, 0.80, 0.1, 0.80))
"""Wf: motion sickness."""


def vibration_total(force: Floats, dt: float) -> float:
    """a_v: the rms of seated ride comfort, m/s^2.

    It is the root of the sum over axes of the mean squares of the weighted signal, with k = 1 for each axis.

    Args:
        force: (n, 3) specific force x, y, z at the seat, m/s^2.
        dt: Time step, s.
    """
    horizontal, vertical = WD.apply(force[:, :2], dt), WK.apply(force[:, 2:], dt)
    return float(np.sqrt(np.sum(np.mean(horizontal**2, axis=0)) + np.mean(vertical**2)))


def motion_sickness_dose(force: Floats, dt: float) -> float:
    """MSDV: the root of the integral of the squared weighted signal over time, m/s^1.5.

    The standard defines it for the vertical. All three axes are summed here, as is custom for cars.

    Args:
        force: (n, 3) specific force, m/s^2.
        dt: Time step, s.
    """
    return float(np.sqrt(np.sum(WF.apply(force, dt) ** 2) * dt))
