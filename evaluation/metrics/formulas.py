"""Formulas of fidelity: pure functions of the signals of car and simulator."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Floats

Mask = NDArray[np.bool_]


FLAT: Final = 1e-6
"""A standard deviation below this (m/s^2, rad/s) is rounding: the signal counts as constant."""


def rms(values: Floats) -> float:
    """Root mean square of (n,) values."""
    return float(np.sqrt(np.mean(np.square(values))))


def normalized_rmse(reference: Floats, simulated: Floats, floor: float) -> float:
    """RMSE over the larger of ``floor`` and the RMS of the reference; both signals are zero at rest.

    The value of no motion is 1 where the car moves. The floor keeps an axis finite on which it does not.
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
    """(2 reach + 1,) Pearson correlations of ``reference[k]`` and ``simulated[k + lag]`` over their overlap.

    Lags run from -reach to reach. The correlation is NaN where a signal is constant on the overlap.
    """
    from scipy.signal import correlate

    def moments(values: Floats, start: NDArray[np.int_]) -> tuple[Floats, Floats]:
        """Mean and mean square of ``values[start : start + count]`` for each lag."""
        sums = np.concatenate([[0.0], np.cumsum(values)])
        squares = np.concatenate([[0.0], np.cumsum(values**2)])
        end = start + count
        return (sums[end] - sums[start]) / count, (squares[end] - squares[start]) / count

    n = len(reference)
    a, b = reference - reference.mean(), simulated - simulated.mean()
    lags = np.arange(-reach, reach + 1)
    products = correlate(b, a, mode="full", method="fft")[n - 1 + lags]
    # The overlap is [start, start + count) in the reference, shifted by the lag in the simulator's signal.
    start, count = np.maximum(0, -lags), n - np.abs(lags)
    mean_a, square_a = moments(a, start)
    mean_b, square_b = moments(b, start + lags)
    spread = np.sqrt(np.maximum(square_a - mean_a**2, 0.0) * np.maximum(square_b - mean_b**2, 0.0))
    flat = spread < FLAT**2
    return np.asarray(
        np.where(flat, np.nan, (products / count - mean_a * mean_b) / np.where(flat, 1.0, spread))
    )


def delay(reference: Floats, simulated: Floats, dt: float, reach: float, least: float) -> float | None:
    """Delay of the simulator behind the car, s; negative where it leads.

    It is the lag of the highest correlation, refined by a parabola through the peak and its neighbors.

    Args:
        reference: (n,) signal of the car.
        simulated: (n,) signal of the simulator.
        dt: Time step, s.
        reach: Largest lag searched either way, s.
        least: Correlation that the peak must have.

    Returns:
        None where no peak lies inside the search, or where it is lower than ``least``.
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
    """The part of the simulator's signal outside the interval between zero and the car's."""
    return np.asarray(simulated - np.clip(simulated, np.minimum(reference, 0.0), np.maximum(reference, 0.0)))


def vibration(reference: Floats, simulated: Floats, dt: float, above: float, window: float) -> float | None:
    """RMS vibration of the simulator beyond the car's own, in its worst window.

    It is the root of the largest difference of their mean squares over a window, after a high-pass
    (Butterworth of order 4, run both ways). The car's own vibration does not count, in whatever phase the
    simulator follows it.

    Args:
        reference: (n, k) signals of the car.
        simulated: (n, k) signals of the simulator.
        dt: Time step, s.
        above: Corner frequency, Hz.
        window: Length of the window, s.

    Returns:
        None where the signals are shorter than a window, or sampled too seldom to hold the frequency.
    """
    from scipy.signal import butter, sosfiltfilt

    count = round(window / dt)
    if not 1 < count < len(reference) or above * dt >= 0.5:
        return None
    filters = butter(4, above, "highpass", fs=1.0 / dt, output="sos")
    of_car, of_cab = (
        np.sum(sosfiltfilt(filters, x, axis=0, padlen=count) ** 2, axis=1) for x in (reference, simulated)
    )
    sums = np.concatenate([[0.0], np.cumsum(of_cab - of_car)])
    return float(np.sqrt(max(0.0, np.max(sums[count:] - sums[:-count]) / count)))
