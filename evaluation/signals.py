"""How one signal resembles another: pure functions of arrays; docs/metrics.md has formulas and sources."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, correlate, sosfiltfilt

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

FLAT: Final = 1e-6
"""A standard deviation below this (m/s^2, rad/s) is rounding: the signal counts as constant."""


def rms(values: Floats) -> float:
    """Root mean square of (n,) values."""
    return float(np.sqrt(np.mean(np.square(values))))


def normalized_rmse(reference: Floats, simulated: Floats, floor: float) -> float:
    """RMSE over the larger of the RMS of ``wanted`` and ``floor``; both signals are zero at rest.

    No motion has 1 where the car moves; the floor keeps an axis finite in which it does not.
    """
    return rms(simulated - reference) / max(rms(reference), floor)


def pearson(reference: Floats, simulated: Floats) -> float | None:
    """Pearson's correlation of two (n,) signals; None where one of them is constant."""
    a, b = reference - reference.mean(), simulated - simulated.mean()
    spread = rms(a), rms(b)
    if min(spread) < FLAT:
        return None
    return float(np.clip(np.mean(a * b) / (spread[0] * spread[1]), -1.0, 1.0))


def correlation_by_lag(reference: Floats, simulated: Floats, reach: int) -> Floats:
    """(2 reach + 1,) Pearson correlations of ``wanted[k]`` and ``felt[k + lag]`` over their overlap.

    Lags run from -reach to reach; NaN where a signal is constant on the overlap.
    """
    n = len(reference)
    a, b = reference - reference.mean(), simulated - simulated.mean()
    lags = np.arange(-reach, reach + 1)
    products = correlate(b, a, mode="full", method="fft")[n - 1 + lags]
    # The overlap in `wanted` is [start, start + count), in `felt` [start + lag, start + lag + count).
    start, count = np.maximum(0, -lags), n - np.abs(lags)
    mean_a, square_a = _window(a, start, count)
    mean_b, square_b = _window(b, start + lags, count)
    spread = np.sqrt(np.maximum(square_a - mean_a**2, 0.0) * np.maximum(square_b - mean_b**2, 0.0))
    flat = spread < FLAT**2
    return np.asarray(
        np.where(flat, np.nan, (products / count - mean_a * mean_b) / np.where(flat, 1.0, spread))
    )


def _window(values: Floats, start: NDArray[np.int_], count: NDArray[np.int_]) -> tuple[Floats, Floats]:
    """Mean and mean square of ``values[start : start + count]`` for each pair."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    squares = np.concatenate([[0.0], np.cumsum(values**2)])
    return (sums[start + count] - sums[start]) / count, (squares[start + count] - squares[start]) / count


def delay(reference: Floats, simulated: Floats, dt: float, reach: float, least: float) -> float | None:
    """How much later ``felt`` does what ``wanted`` does, s; negative where it leads.

    The lag of the highest correlation, refined by a parabola through the peak and its two neighbors.

    Args:
        reference: (n,) signal of the car.
        simulated: (n,) signal of the simulator.
        dt: Time step, s.
        reach: Largest lag searched either way, s.
        least: Correlation that the peak must have.

    Returns:
        None where no peak lies inside the search or it is lower than ``least``: no delay to speak of.
    """
    # At least three quarters of the drive overlap at every lag.
    samples = min(round(reach / dt), len(reference) // 4)
    if samples < 1:
        return None
    values = correlation_by_lag(reference, simulated, samples)
    if np.isnan(values).any():
        return None
    peak = int(np.argmax(values))
    if peak in (0, len(values) - 1) or values[peak] < least:
        return None
    before, at, after = values[peak - 1 : peak + 2]
    bend = before - 2.0 * at + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float((peak - samples + shift) * dt)


def false_cues(reference: Floats, simulated: Floats, threshold: float) -> Mask:
    """(n,) where the simulator noticeably moves against the car, or while the car does not noticeably move.

    The difference itself must be noticeable: 0.18 for 0.16 at a threshold of 0.17 is no false cue.
    """
    against = (np.abs(reference) <= threshold) | (reference * simulated < 0.0)
    return np.asarray((np.abs(simulated) > threshold) & against & (np.abs(simulated - reference) > threshold))


def missing_cues(reference: Floats, simulated: Floats, threshold: float) -> Mask:
    """(n,) where the car noticeably moves, the simulator does not, and the difference is noticeable."""
    silent = np.abs(simulated) <= threshold
    return np.asarray((np.abs(reference) > threshold) & silent & (np.abs(simulated - reference) > threshold))


def beyond(reference: Floats, simulated: Floats) -> Floats:
    """The part of ``felt`` outside the interval between zero and ``wanted``: motion nobody asked for."""
    return np.asarray(simulated - np.clip(simulated, np.minimum(reference, 0.0), np.maximum(reference, 0.0)))


def vibration(reference: Floats, simulated: Floats, dt: float, above: float, window: float) -> float | None:
    """How much ``felt`` shakes more than ``wanted`` in its worst window.

    The root of the largest difference of their mean squares over a window, after a high-pass (Butterworth of
    order 4, run both ways). What the car itself does above the frequency does not count, in whatever phase
    the simulator follows it.

    Args:
        reference: (n, k) signals of the car.
        simulated: (n, k) signals of the simulator.
        dt: Time step, s.
        above: Corner frequency, Hz.
        window: Length of the window, s.

    Returns:
        None where the signals are shorter than a window, or sampled too seldom to hold the frequency.
    """
    count = round(window / dt)
    if not 1 < count < len(reference) or above * dt >= 0.5:
        return None
    filters = butter(4, above, "highpass", fs=1.0 / dt, output="sos")
    of_car, of_cab = (
        np.sum(sosfiltfilt(filters, x, axis=0, padlen=count) ** 2, axis=1) for x in (reference, simulated)
    )
    sums = np.concatenate([[0.0], np.cumsum(of_cab - of_car)])
    return float(np.sqrt(max(0.0, np.max(sums[count:] - sums[:-count]) / count)))
