"""Time of a log: gaps, an even grid, and a low-pass without delay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ..cues import Floats
from ..errors import DataError
from .columns import RawLog

_FILTER_ORDER: Final = 2
"""Butterworth order of one pass; forwards and backwards doubles it."""

_SHORTEST_S: Final = 1.0
"""A shorter record has nothing to estimate from, and is all edge for the filter."""

Series = tuple[Floats, Floats]
"""Time stamps and values of one signal, without gaps in the values."""


@dataclass(frozen=True)
class GapPolicy:
    """What to do about missing data.

    Args:
        gaps: ``refuse`` stops at a long step, a repeated stamp or an empty cell; ``bridge``
            drops repeated stamps and empty cells and interpolates over the hole.
        longest_step_s: A longer step between samples is a gap, s.
        longest_gap_s: A longer gap is refused even when bridging, s.
    """

    gaps: Literal["refuse", "bridge"]
    longest_step_s: float
    longest_gap_s: float


@dataclass(frozen=True)
class Timing:
    """What was found about the time of a log.

    Attributes:
        rows: Rows of the file.
        rate_hz: Median sample rate.
        longest_step_s: Longest step between rows, s.
        repeated: Rows dropped because their stamp repeats, or is empty.
        empty_cells: Cells without a number.
        bridged: Gaps interpolated over, all signals together.
    """

    rows: int
    rate_hz: float
    longest_step_s: float
    repeated: int
    empty_cells: int
    bridged: int


def close_gaps(log: RawLog, policy: GapPolicy) -> tuple[dict[str, Series], Timing]:
    """Apply the gap policy to every signal of a log.

    Raises:
        DataError: time runs backwards, or there is a gap that the policy refuses.
    """
    keep = _kept_rows(log, policy)
    rows, time = log.rows[keep], log.time[keep]
    series = {
        name: _without_holes(name, (time, values[keep]), rows, policy) for name, values in log.signals.items()
    }
    bridged = sum(_bridge(name, stamps, policy) for name, (stamps, _) in series.items())
    steps = np.diff(time)
    cells = sum(int(np.isnan(values[keep]).sum()) for values in log.signals.values())
    return series, Timing(
        rows=len(log.time),
        rate_hz=float(1.0 / np.median(steps)),
        longest_step_s=float(steps.max()),
        repeated=len(log.time) - len(time),
        empty_cells=cells,
        bridged=bridged,
    )


def _kept_rows(log: RawLog, policy: GapPolicy) -> NDArray[np.intp]:
    """Indices of the rows with a time stamp of their own."""
    time = log.time
    known = np.flatnonzero(np.isfinite(time))
    _refuse(policy, log.rows[~np.isfinite(time)], "time is empty")
    steps = np.diff(time[known])
    if np.any(steps < 0.0):
        row = log.rows[known[int(np.argmax(steps < 0.0)) + 1]]
        raise DataError(f"time runs backwards at data row {row}; sort or split the log")
    _refuse(policy, log.rows[known[1:][steps == 0.0]], "time stamp repeats")
    kept = np.concatenate([known[:1], known[1:][steps > 0.0]])
    if len(kept) < 2 or time[kept[-1]] - time[kept[0]] < _SHORTEST_S:
        raise DataError(f"the log is shorter than {_SHORTEST_S:g} s; check the unit of time")
    return kept


def _without_holes(name: str, series: Series, rows: NDArray[np.intp], policy: GapPolicy) -> Series:
    time, values = series
    if np.any(np.isinf(values)):
        raise DataError(f"{name} is infinite at data row {rows[np.isinf(values)][0]}; mend the log")
    known = np.isfinite(values)
    _refuse(policy, rows[~known], f"{name} has an empty or NaN cell")
    if known.sum() < 2:
        raise DataError(f"{name} has fewer than 2 values; name another column")
    return time[known], values[known]


def _bridge(name: str, time: Floats, policy: GapPolicy) -> int:
    steps = np.diff(time)
    long = steps > policy.longest_step_s
    if policy.gaps == "refuse" and np.any(long):
        at = int(np.argmax(long))
        raise DataError(
            f"gap of {steps[at]:.3g} s in {name} at {time[at]:.3f} s (longest_step_s "
            f"{policy.longest_step_s:g}); set gaps to bridge, or leave it out with start_s or end_s"
        )
    if steps.max() > policy.longest_gap_s:
        at = int(np.argmax(steps))
        raise DataError(
            f"gap of {steps[at]:.3g} s in {name} at {time[at]:.3f} s is too long to bridge "
            f"(longest_gap_s {policy.longest_gap_s:g}); leave it out with start_s or end_s"
        )
    return int(long.sum())


def _refuse(policy: GapPolicy, rows: NDArray[np.intp], what: str) -> None:
    if policy.gaps == "refuse" and len(rows):
        raise DataError(
            f"{what} at data row {rows[0]} ({len(rows)} in all); set gaps to bridge, or mend the log"
        )


@dataclass(frozen=True)
class Grid:
    """An even time grid that is fine enough for the log's own rate.

    Attributes:
        time: (m,) s from 0, at ``every`` times the rate asked for.
        start: Log time of the first point, s.
        every: One point in so many is a sample of the result.
    """

    time: Floats
    start: float
    every: int

    @property
    def rate_hz(self) -> float:
        """Points a second."""
        return float((len(self.time) - 1) / self.time[-1])


def make_grid(series: Mapping[str, Series], rate_hz: float, source_hz: float) -> Grid:
    """Cover the time that all signals share."""
    start = max(float(stamps[0]) for stamps, _ in series.values())
    end = min(float(stamps[-1]) for stamps, _ in series.values())
    if end - start < _SHORTEST_S:
        raise DataError(f"the signals have less than {_SHORTEST_S:g} s in common; name other columns")
    every = max(1, int(np.ceil(source_hz / rate_hz - 1e-6)))
    samples = int(np.floor((end - start) * rate_hz + 1e-6))
    return Grid(np.arange(samples * every + 1) / (rate_hz * every), start, every)


def on_grid(series: Series, grid: Grid) -> Floats:
    """Values on the grid, by linear interpolation."""
    stamps, values = series
    return np.interp(grid.time + grid.start, stamps, values)


def low_pass(values: Floats, rate_hz: float, cutoff_hz: float) -> Floats:
    """Butterworth low-pass forwards and backwards, so without delay, along axis 0.

    The two passes together are 6 dB down at ``cutoff_hz``.
    """
    if cutoff_hz >= 0.5 * rate_hz:
        raise DataError(f"cutoff {cutoff_hz:g} Hz is not below half the rate of {rate_hz:g} Hz; lower it")
    sections = butter(_FILTER_ORDER, cutoff_hz, fs=rate_hz, output="sos")
    # About one period of the cut-off, so that the reflected edge has settled.
    pad = min(len(values) - 1, int(np.ceil(rate_hz / cutoff_hz)))
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=pad))
