"""Clock of a log: order is checked before anything is cut, and a wrap is named or unwrapped."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..cues import Floats
from ..errors import DataError
from .signals import Change, ImportOptions, RawLog

WRAPS: Final = {
    "a day": 86400.0,
    "a week": 604800.0,
    "an hour": 3600.0,
    "a minute": 60.0,
    "32 bits of us": 2.0**32 * 1e-6,
    "31 bits of us": 2.0**31 * 1e-6,
    "32 bits of ms": 2.0**32 * 1e-3,
    "31 bits of ms": 2.0**31 * 1e-3,
    "16 bits of ms": 2.0**16 * 1e-3,
    "32 bits of ns": 2.0**32 * 1e-9,
}
"""Periods after which clocks begin again, s."""

_BURST_STEP: Final = 0.3
_BURST_SHARE: Final = 0.3
"""Stamps come in bursts if this share of the steps is shorter than that share of the mean step."""

_SEAM_STEPS: Final = 5.0
"""A step across a seam of at most so many median steps goes on where the clock ended."""


def in_order(log: RawLog, options: ImportOptions) -> tuple[RawLog, list[Change]]:
    """The log with a clock that never runs backwards, and what was changed.

    Raises:
        DataError: time runs backwards, and the clock does not wrap or may not be unwrapped.
    """
    known = np.flatnonzero(np.isfinite(log.time))
    stamps = log.time[known]
    back = np.flatnonzero(np.diff(stamps) < 0.0) + 1
    if not len(back):
        log, jumps = _set_forward(log, known, options)
        log, changes = _even(log, known, options)
        return log, [*jumps, *changes]
    row = log.rows[known[back[0]]]
    fault = f"time runs backwards at data row {row}, by {stamps[back[0] - 1] - stamps[back[0]]:.6g} s"
    forward = np.diff(stamps)[np.diff(stamps) > 0.0]
    seam = max(_SEAM_STEPS * float(np.median(forward)), options.longest_step_s) if len(forward) else 0.0
    if len(back) == 1 and 0.0 <= stamps[0] - stamps[-1] <= seam:
        raise DataError(f"{fault}: two segments are joined in the wrong order; put the later rows last")
    found = _wrap(stamps, back, log.first_stamp_s, seam) or _set_back(stamps, back, seam)
    if found is None:
        raise DataError(f"{fault}; sort or split the log")
    name, period = found
    if options.clock == "refuse":
        why = f"wraps after {name} ({period:.10g} s)" if name in WRAPS else f"was {name}"
        raise DataError(f"{fault}: its clock {why}; set clock='mend'")
    time = log.time.copy()
    time[known] = stamps + period * _turns(len(stamps), back)
    rows = ", ".join(str(log.rows[known[place]]) for place in back[:5])
    what = f"it began again after {name}" if name in WRAPS else f"it was {name}"
    text = f"clock unwrapped: {what} at data row {rows} ({len(back)} in all)"
    change = Change(text, tuple(time[known[back]].tolist()))
    log, changes = _even(replace(log, time=time), known, options)
    return log, [change, *changes]


_HOUR = 3600.0
_SET_BACK: Final = "set back by an hour, as at the end of daylight saving time"
_SET_FORWARD: Final = "set forward by an hour, as at the beginning of daylight saving time"


def _set_back(stamps: Floats, back: NDArray[np.intp], seam: float) -> tuple[str, float] | None:
    """Name and length of one step back by an hour."""
    steps = stamps[back] - stamps[back - 1] + _HOUR
    return (_SET_BACK, _HOUR) if len(back) == 1 and 0.0 <= steps[0] <= seam else None


def _set_forward(log: RawLog, known: NDArray[np.intp], options: ImportOptions) -> tuple[RawLog, list[Change]]:
    """The log without one step forward by an hour, and what was changed."""
    steps = np.diff(log.time[known])
    seam = max(_SEAM_STEPS * float(np.median(steps)), options.longest_step_s) if len(steps) else 0.0
    hours = np.flatnonzero((steps >= _HOUR) & (steps <= _HOUR + seam))
    if len(hours) != 1:
        return log, []
    row = log.rows[known[hours[0] + 1]]
    if options.clock == "refuse":
        raise DataError(
            f"time jumps by {steps[hours[0]]:.6g} s at data row {row}: its clock was {_SET_FORWARD}, or "
            "the log has a gap; set clock='mend', or leave it out with start_s or end_s"
        )
    time = log.time.copy()
    time[known[hours[0] + 1 :]] -= _HOUR
    change = Change(
        f"clock mended: it was {_SET_FORWARD}, at data row {row}", (float(time[known[hours[0]]]),)
    )
    return replace(log, time=time), [change]


_LEAST_REPEAT: Final = 10
"""Fewer rows that come again are chance."""


def without_repeats(log: RawLog, options: ImportOptions) -> tuple[RawLog, list[Change]]:
    """The log without blocks of rows that come again, and what was changed.

    Raises:
        DataError: there are such blocks, and the options refuse damage.
    """
    table = np.column_stack([np.zeros(len(log.time)), *log.signals.values()])
    last: dict[bytes, int] = {}
    before = np.full(len(table), -1)
    for row, values in enumerate(table):
        key = values.tobytes()
        before[row] = last.get(key, -1)
        last[key] = row
    rows = np.arange(len(table))
    lag = np.where(before >= 0, rows - before, 0)
    # A car that stands, or a sensor that froze, repeats its last row: that is another fault.
    ends = np.flatnonzero(np.diff(np.r_[0, lag, 0]) != 0)
    found = [
        (first, end)
        for first, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
        if lag[first] > 1 and end - first >= _LEAST_REPEAT and np.ptp(table[first:end], axis=0).max() > 0.0
    ]
    if not found:
        return log, []
    first, end = found[0]
    fault = (
        f"data rows {log.rows[first]} to {log.rows[end - 1]} repeat rows {log.rows[before[first]]} to "
        f"{log.rows[before[end - 1]]}" + (f" ({len(found)} such blocks)" if len(found) > 1 else "")
    )
    if options.damage == "refuse":
        raise DataError(f"{fault}; set damage='mend' to leave them out")
    keep = np.ones(len(table), dtype=np.bool_)
    for start, stop in found:
        keep[start:stop] = False
    signals = {name: values[keep] for name, values in log.signals.items()}
    places = tuple(float(log.time[start]) for start, _ in found)
    mended = replace(log, time=log.time[keep], signals=signals, rows=log.rows[keep])
    return mended, [Change(f"{fault}: left out", places)]


def _even(log: RawLog, known: NDArray[np.intp], options: ImportOptions) -> tuple[RawLog, list[Change]]:
    """The log with rows evenly spaced, if they were handed over in bursts, and what was changed."""
    stamps = log.time[known]
    steps = np.diff(stamps)
    usual = steps[(steps > 0.0) & (steps <= options.longest_step_s)]
    if not len(usual) or np.mean(usual < _BURST_STEP * usual.mean()) < _BURST_SHARE:
        return log, []
    fault = (
        f"the time stamps come in bursts: their steps are {np.median(usual):.3g} s at the median, "
        f"{usual.mean():.3g} s in the mean"
    )
    if options.clock == "refuse":
        raise DataError(
            f"{fault}; set clock='mend' to space the rows evenly, or write the sensor's own stamps"
        )
    parts = np.split(np.arange(len(stamps)), np.flatnonzero(steps > options.longest_step_s) + 1)
    time = log.time.copy()
    for part in (part for part in parts if len(part) > 1):
        time[known[part]] = np.polyval(np.polyfit(part, stamps[part], 1), part)
    if np.any(np.diff(time[known]) <= 0.0):
        raise DataError(f"{fault}, and rows are missing between them; write the sensor's own stamps")
    time += stamps[0] - time[known[0]]
    return replace(log, time=time), [Change("rows evenly spaced: the time stamps came in bursts")]


def _turns(samples: int, back: NDArray[np.intp]) -> Floats:
    turns = np.zeros(samples)
    turns[back] = 1.0
    return np.cumsum(turns)


def _wrap(stamps: Floats, back: NDArray[np.intp], first: float, seam: float) -> tuple[str, float] | None:
    """Name and length of the period with which the time goes on at each seam.

    A clock that wraps stands near its period before a seam, and near zero after it.
    """
    before, after = stamps[back - 1] + first, stamps[back] + first
    for name, period in WRAPS.items():
        steps = after + period - before
        near_the_ends = np.all(before <= period * (1.0 + 1e-9)) and np.all(after >= 0.0)
        # A clock of signed integers begins again below zero.
        signed = np.all(before <= period / 2.0 * (1.0 + 1e-9)) and np.all(
            after >= -period / 2.0 * (1.0 + 1e-9)
        )
        if (near_the_ends or signed) and np.all(steps >= 0.0) and np.all(steps <= seam):
            return name, period
    return None
