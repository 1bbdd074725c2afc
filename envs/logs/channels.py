"""Faults of single channels: outliers, sensors that froze, and a speed that died."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, median_filter

from ..cues import Floats
from ..errors import DataError
from .mounting import Evidence
from .signals import RECEIVED, Change, ImportOptions, RawLog
from .units import FORCES, RATES, UNITS

_LEAST_SPIKE: Final = {**dict.fromkeys(FORCES, 8.0), **dict.fromkeys(RATES, 1.0), "speed": 5.0}
"""A smaller deviation from the running median is no outlier, m/s^2, rad/s, m/s."""

_SPIKE_SCALES: Final = ((99.0, 10.0), (95.0, 25.0))
"""An outlier exceeds the lesser of these percentiles of all deviations times these factors."""

_WINDOWS: Final = ((0.05, 7), (0.1, 5), (np.inf, 3))
"""Samples of the running median, for steps up to so many seconds; three in seven may be outliers."""

_LEAST_HOLD: Final = (0.3, 5)
"""A sensor that holds one value for less time, s, or fewer samples is not frozen."""

_USUAL_HOLDS: Final = 5.0
"""A sensor is frozen beyond so many times the 90th percentile of its usual holds."""

_QUIET: Final = (0.5, 0.05)
"""Deviations of force, m/s^2, and rates, rad/s, below 0.5 Hz that a standing car does not exceed for long."""

_LEAST_STANDSTILL_S: Final = 5.0
"""A shorter standstill may be a car that creeps, s."""

_LARGEST_SPEED_STEP: Final = 10.0
"""A speed that changes by more between two samples, to or from zero, is a channel that died or woke, m/s."""


def mend_spikes(log: RawLog, options: ImportOptions) -> tuple[RawLog, list[Change]]:
    """The log without outliers of up to three samples, and what was changed.

    An outlier is far from the running median, in comparison with the deviations of its whole channel.

    Raises:
        DataError: there is an outlier, and the options refuse it.
    """
    signals, changes = dict(log.signals), list[Change]()
    for name, least in _LEAST_SPIKE.items():
        if name not in signals:
            continue
        known = np.flatnonzero(np.isfinite(signals[name]))
        values = signals[name][known]
        if len(values) < max(size for _, size in _WINDOWS):
            continue
        median = _running_median(values, log.time[known])
        deviation = np.abs(values - median)
        # At an end, the mirrored samples pull the median away from a steep, but straight course of values.
        for end in (np.arange(3), -1 - np.arange(3)):
            base, slope = median[end[2]], (median[3 * end[2] - 2 * end[1]] - median[end[2]]) / 2.0
            straight = base + slope * (np.abs(end - end[0]) - 2.0)
            deviation[end] = np.minimum(deviation[end], np.abs(values[end] - straight))
        scales = [factor * float(np.percentile(deviation, share)) for share, factor in _SPIKE_SCALES]
        outliers = np.flatnonzero(deviation > max(least, min(scales)))
        if not len(outliers):
            continue
        at = known[outliers[0]]
        fault = (
            f"{name} is {values[outliers[0]]:.4g} {next(iter(UNITS[name]))} at data row {log.rows[at]} "
            f"({log.time[at]:.3f} s), among values near {median[outliers[0]]:.4g}"
        )
        if options.spikes == "refuse":
            raise DataError(
                f"{fault}: an outlier ({len(outliers)} in all); set spikes='median', or mend the log"
            )
        signals[name] = signals[name].copy()
        signals[name][known[outliers]] = median[outliers]
        text = f"{fault}: replaced by the median of its neighbors ({len(outliers)} in all)"
        changes.append(Change(text, tuple(log.time[known[outliers]].tolist())))
    return replace(log, signals=signals), changes


def _running_median(values: Floats, time: Floats) -> Floats:
    steps = np.diff(time)
    step = float(np.median(steps[np.isfinite(steps)])) if np.any(np.isfinite(steps)) else 0.0
    size = next(size for longest, size in _WINDOWS if step <= longest)
    # Mirrored without the edge itself, so that the first and the last sample have no say about themselves.
    return np.asarray(median_filter(values, size=size, mode="mirror"))


_COURSE_IS_KNOWN: Final = 2.0
"""Speed below which receivers hold their last course, m/s."""


def drop_frozen(
    log: RawLog, options: ImportOptions, receiver: RawLog | None = None
) -> tuple[RawLog, list[Change]]:
    """The log with empty cells where a sensor held one value, and what was changed.

    Args:
        log: Signals of one clock.
        options: Whether gaps are refused.
        receiver: Log with the speed, if it has another clock.

    Raises:
        DataError: a sensor froze, and the options refuse gaps.
    """
    frozen: dict[tuple[int, int], list[str]] = {}
    for name in (name for name in (*FORCES, *RATES, *RECEIVED) if name in log.signals):
        for hold in _frozen(log.time, log.signals[name]):
            value = log.signals[name][hold[0]]
            extreme = value in (np.nanmin(log.signals[name]), np.nanmax(log.signals[name]))
            if options.saturation == "accept" and extreme:
                continue
            slow = (
                max(options.standstill_m_s, _COURSE_IS_KNOWN) if name == "course" else options.standstill_m_s
            )
            if _slower(log, receiver or log, hold, slow):
                continue
            frozen.setdefault(hold, []).append(name)
    signals, changes = dict(log.signals), list[Change]()
    for (first, last), names in sorted(frozen.items()):
        fault = (
            f"{', '.join(names)} held one value from {log.time[first]:.3f} to {log.time[last]:.3f} s "
            f"(data rows {log.rows[first]} to {log.rows[last]})"
        )
        if options.gaps == "refuse":
            raise DataError(
                f"{fault}: the sensor froze; set gaps='bridge', or leave it out with start_s or end_s"
            )
        for name in names:
            signals[name] = signals[name].copy()
            signals[name][first + 1 : last + 1] = np.nan
        changes.append(Change(f"{fault}: taken as a gap", (float(log.time[first]), float(log.time[last]))))
    return replace(log, signals=signals), changes


def _slower(log: RawLog, receiver: RawLog, hold: tuple[int, int], speed: float) -> bool:
    """Whether the car is slower than ``speed`` for most of a hold: then what hardly changes may hold."""
    if "speed" not in receiver.signals:
        return False
    first, last = log.time[hold[0]], log.time[hold[1]]
    found = receiver.signals["speed"][(receiver.time >= first) & (receiver.time <= last)]
    return bool(np.any(np.isfinite(found)) and np.nanmedian(found) < speed)


def _frozen(time: Floats, values: Floats) -> list[tuple[int, int]]:
    """First and last sample of each hold that begins or ends with a jump.

    A car that goes straight holds its cues, too, but it comes to that and leaves it gradually.
    """
    n = len(values)
    steps = np.abs(np.diff(values))
    changes = steps[steps > 0.0]
    if len(changes) < _LEAST_HOLD[1]:
        return []
    starts = np.flatnonzero(np.r_[True, steps != 0.0])
    ends = np.r_[starts[1:] - 1, n - 1]
    usual = _USUAL_HOLDS * float(np.percentile(ends - starts + 1, 90.0))
    typical, large = float(np.median(changes)), 3.0 * float(np.percentile(changes, 95.0))
    # A coarse quantity changes by the same few steps all the time: such a step says nothing.
    fine = len(np.unique(np.round(changes / typical, 6))) > 0.3 * len(changes)

    # The changes of noise change as much themselves, those of a smooth motion little.
    rough = float(np.median(np.abs(np.diff(values, 2)))) >= typical

    def jumps(sample: int, scale: float) -> bool:
        return bool(steps[sample] >= scale)

    found = []
    for first, last in zip(starts.tolist(), ends.tolist(), strict=True):
        long = last - first + 1 >= max(_LEAST_HOLD[1], usual) and time[last] - time[first] >= _LEAST_HOLD[0]
        edges = [edge for edge in (first - 1, last) if 0 <= edge < n - 1]
        if not long or not edges:
            continue
        if rough:
            abrupt = any(jumps(edge, 0.1 * typical) for edge in edges)
        else:
            abrupt = first > 0 and all(jumps(edge, 0.5 * typical) for edge in edges)
        if (fine and abrupt) or jumps(edges[-1], large):
            found.append((first, last))
    return found


_LEAST_CUT: Final = (3, 2)
"""A sensor is cut off if it holds its largest value for so many samples, so many times."""

_CUT_STEPS: Final = 3.0
"""It comes to that value and leaves it in steps of at least so many median steps."""


def check_range(log: RawLog, options: ImportOptions) -> list[Change]:
    """What was accepted of sensors that are cut off at the ends of their range.

    Raises:
        DataError: a sensor is cut off, and the options refuse that.
    """
    changes = []
    for name in (name for name in (*FORCES, *RATES) if name in log.signals):
        known = np.flatnonzero(np.isfinite(log.signals[name]))
        values = log.signals[name][known]
        runs = [] if len(values) < 3 else _cut_off(values)
        if not runs:
            continue
        first = known[runs[0][0]]
        unit = next(iter(UNITS[name]))
        fault = (
            f"{name} is cut off at {values[runs[0][0]]:.4g} {unit} at data row {log.rows[first]} "
            f"({log.time[first]:.3f} s, {len(runs)} times in all)"
        )
        if options.saturation == "refuse":
            raise DataError(
                f"{fault}: the sensor is at the end of its range; set saturation='accept', or leave that "
                "part out with start_s or end_s"
            )
        places = tuple(float(log.time[known[start]]) for start, _ in runs)
        changes.append(Change(f"{fault}: accepted as it is", places))
    return changes


def _cut_off(values: Floats) -> list[tuple[int, int]]:
    """First and last sample of each steep plateau at the largest or smallest value."""
    steps = np.abs(np.diff(values))
    moving = steps[steps > 0.0]
    if not len(moving):
        return []
    least, found = _CUT_STEPS * float(np.median(moving)), []
    for end in (values.max(), values.min()):
        starts = np.flatnonzero(np.diff(np.r_[False, values == end, False].astype(np.int8)))
        runs = list(zip(starts[::2].tolist(), (starts[1::2] - 1).tolist(), strict=True))
        inner = [(a, b) for a, b in runs if a > 0 and b < len(values) - 1]
        steep = [
            (a, b) for a, b in inner if b - a + 1 >= _LEAST_CUT[0] and min(steps[a - 1], steps[b]) >= least
        ]
        if len(steep) >= _LEAST_CUT[1]:
            found += steep
    return sorted(found)


_LEAST_HELD: Final = (3, 0.8)
"""Values are held if they change after so many rows or more, and this share after as many as the median."""


def thin_holds(log: RawLog, options: ImportOptions) -> tuple[RawLog, list[Change]]:
    """The log with values only where they are new, if they are held over a fixed number of rows."""
    if options.holds == "keep":
        return log, []
    signals, found = dict(log.signals), dict[int, list[str]]()
    for name, values in log.signals.items():
        new = np.flatnonzero(np.r_[True, (values[1:] != values[:-1]) & np.isfinite(values[1:])])
        lengths = np.diff(new)
        if len(lengths) < 10:
            continue
        rows = int(np.median(lengths))
        if rows >= _LEAST_HELD[0] and np.mean(np.abs(lengths - rows) <= 1) >= _LEAST_HELD[1]:
            signals[name] = np.full(len(values), np.nan)
            signals[name][new] = values[new]
            found.setdefault(rows, []).append(name)
    changes = [
        Change(f"{', '.join(names)} held each value for {rows} rows: thinned out to the rows with news")
        for rows, names in found.items()
    ]
    return replace(log, signals=signals), changes


def check_speed(log: RawLog) -> None:
    """Refuse a speed that dies or wakes between two samples.

    Raises:
        DataError: with row and time.
    """
    if "speed" not in log.signals:
        return
    known = np.flatnonzero(np.isfinite(log.signals["speed"]) & np.isfinite(log.time))
    speed = log.signals["speed"][known]
    steps, apart = np.abs(np.diff(speed)), np.diff(log.time[known])
    if not len(steps):
        return
    # Across a gap of the log, a speed may change.
    _check_unit_of_speed(log, known, speed, steps)
    dead = (
        (apart <= 2.5 * np.median(apart))
        & (steps > _LARGEST_SPEED_STEP)
        & (np.minimum(np.abs(speed[1:]), np.abs(speed[:-1])) < 0.3)
    )
    if np.any(dead):
        at = int(np.argmax(dead)) + 1
        row = log.rows[known[at]]
        raise DataError(
            f"speed jumps from {speed[at - 1]:.3g} to {speed[at]:.3g} m/s at data row {row} "
            f"({log.time[known[at]]:.3f} s): the channel died or woke; leave that part out with start_s or "
            "end_s, or name no column for speed"
        )


def _check_unit_of_speed(log: RawLog, known: NDArray[np.intp], speed: Floats, steps: Floats) -> None:
    """Refuse a speed that jumps by the factor of two units."""
    for factor, units in ((3.6, "m/s and km/h"), (2.23694, "m/s and mph"), (1.609344, "mph and km/h")):
        for before, after in ((speed[:-1], speed[1:]), (speed[1:], speed[:-1])):
            jumps = (steps > 4.0) & (np.abs(after - factor * before) < 0.03 * np.abs(after))
            if np.sum(jumps) == 1 and steps.max() == steps[jumps][0]:
                at = int(np.argmax(jumps)) + 1
                raise DataError(
                    f"speed jumps from {speed[at - 1]:.3g} to {speed[at]:.3g} m/s at data row "
                    f"{log.rows[known[at]]} ({log.time[known[at]]:.3f} s), by {factor:.3g}, the factor of "
                    f"{units}: its unit changes; leave one part out with start_s or end_s"
                )


def check_standstill(evidence: Evidence) -> None:
    """Refuse a standstill of the speed alone: force and rates have to be quiet, too.

    Raises:
        DataError: with the time from the beginning of what is imported.
    """
    runs, count = label(evidence.still)
    for number in range(1, count + 1):
        inside = np.flatnonzero(runs == number)
        if len(inside) * evidence.dt < _LEAST_STANDSTILL_S:
            continue
        if _moving(evidence.force[inside], _QUIET[0]) or _moving(evidence.rate[inside], _QUIET[1]):
            first, last = inside[[0, -1]] * evidence.dt
            raise DataError(
                f"speed says standstill from {first:.1f} to {last:.1f} s of the import, but the device "
                "accelerates or turns: the speed is no value; leave that part out with start_s or end_s, "
                "or name no column for speed"
            )


def _moving(values: Floats, quiet: float) -> bool:
    """Whether a fifth of the samples (n, 3) is further than ``quiet`` from their median."""
    far: NDArray[np.bool_] = np.any(np.abs(values - np.median(values, axis=0)) > quiet, axis=1)
    return bool(far.mean() > 0.2)
