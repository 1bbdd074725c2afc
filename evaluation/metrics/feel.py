"""Formulas of what people feel: incongruence, the worst moment, and jerk."""

from __future__ import annotations

import numpy as np

from ..trajectory import Floats


def incongruence(error: Floats, weights: tuple[float, float], dt: float, time_constant: float) -> Floats:
    """(n,) predicted continuous rating of incongruence, in m/s^2: it begins at 0.

    It is the first-order low-pass of the weighted mismatch of longitudinal and lateral specific force.

    Args:
        error: (n, 2) error of specific force x and y, m/s^2.
        weights: Of x and y.
        dt: Time step, s.
        time_constant: Of the low-pass, s.
    """
    from scipy.signal import lfilter

    pole = np.exp(-dt / time_constant)
    return np.asarray(lfilter([1.0 - pole], [1.0, -pole], np.abs(error) @ np.array(weights)))


def worst_window(values: Floats, dt: float, window: float) -> tuple[float, float]:
    """The largest mean of (n,) values over a window, and the time at which that window begins, s.

    A drive that is shorter than the window is one window.
    """
    count = min(max(round(window / dt), 1), len(values))
    sums = np.concatenate([[0.0], np.cumsum(values)])
    means = (sums[count:] - sums[:-count]) / count
    worst = int(np.argmax(means))
    return float(means[worst]), worst * dt


def jerk(force: Floats, dt: float, below: float) -> Floats | None:
    """(n,) magnitude of the derivative of specific force, m/s^3.

    The force passes a low-pass first (Butterworth of order 2, run both ways), then central differences.

    Args:
        force: (n, 3) m/s^2.
        dt: Time step, s.
        below: Corner frequency of the low-pass, Hz.

    Returns:
        None where the signal is shorter than 20 samples, or sampled too seldom for the filter.
    """
    from scipy.signal import butter, sosfiltfilt

    if len(force) < 20 or below * dt >= 0.5:
        return None
    smooth = sosfiltfilt(butter(2, below, fs=1.0 / dt, output="sos"), force, axis=0)
    return np.asarray(np.linalg.norm(np.gradient(smooth, dt, axis=0), axis=1))


def ratio(simulated: float | None, car: float | None, least: float) -> float | None:
    """Simulator over car; None where one is unknown, or where the car's is below a least value."""
    return None if simulated is None or car is None or car < least else simulated / car
