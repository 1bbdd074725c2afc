"""Signals of a log: import options, columns and units, gaps, an even grid, and a low-pass without delay."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, field_validator
from scipy.signal import butter, sosfiltfilt

from ..cues import Floats
from ..errors import ConfigurationError, DataError, suggest
from ..settings import NonNegative, Positive, Vector3, configuration
from .units import FORCES, RATES, UNITS

Sign = Literal["estimate", "keep", "flip"]


@configuration
class ImportOptions:
    """How a log becomes cues. Angles are in degrees because a person types them."""

    rate_hz: Annotated[float, Field(ge=2.0, le=1000.0)] = 100.0
    """Sample rate of the result, 2 to 1000 Hz: the estimates need signals up to 0.5 Hz, and no device in
    a car gives more than a thousand samples a second."""

    cutoff_hz: Positive = 5.0
    """Cut-off of the zero-phase low-pass on force and rates, Hz. Driving itself ends near 3 Hz;
    what is above is road, engine and the holder of the device. Below half the rate."""

    start_s: NonNegative = 0.0
    """What comes earlier in the log is left out, s from its first stamp."""

    end_s: Positive | None = None
    """What comes later in the log is left out, s from its first stamp."""

    gaps: Literal["refuse", "bridge"] = "refuse"
    """Refuse missing data (long steps, repeated stamps, empty cells, frozen sensors), or bridge it by
    interpolation."""

    clock: Literal["refuse", "mend"] = "refuse"
    """Refuse a clock that wraps (a day, 32 bits of us), or mend it: unwrap its stamps."""

    damage: Literal["refuse", "mend"] = "refuse"
    """Refuse a damaged file (cut off, lines of another length, a header in the middle, rows that repeat),
    or take what is whole."""

    spikes: Literal["refuse", "median"] = "refuse"
    """Refuse outliers of up to three samples, or replace them by the median of their neighbors."""

    saturation: Literal["refuse", "accept"] = "refuse"
    """Refuse a sensor that is cut off at its range, or accept what is left of its peaks."""

    holds: Literal["keep", "thin"] = "keep"
    """Keep values that are written again in each row until the sensor gives the next, or thin them out to the
    rows with news, which removes their steps and half a period of delay."""

    longest_step_s: Positive = 0.2
    """A longer step between samples is a gap, s."""

    longest_gap_s: Positive = 2.0
    """A longer gap is refused even when bridging, s."""

    standstill_m_s: NonNegative = 0.3
    """The car counts as standing below this speed, m/s."""

    roll_deg: float | None = None
    """Roll of the device in the car, right side down positive; estimated from gravity if not given."""

    pitch_deg: float | None = None
    """Pitch of the device in the car, nose up positive; estimated from gravity if not given."""

    yaw_deg: float | None = None
    """Yaw of the device in the car, to the right positive; estimated from dv/dt and v r if not given."""

    lateral_sign: Sign = "estimate"
    """Whether the lateral axis is mirrored (left-handed force axes); estimated from v r."""

    rate_sign: Sign = "estimate"
    """Whether the angular rates are reversed; estimated from the course, if there is one."""

    slopes: Literal["refuse", "accept"] = "refuse"
    """Refuse a log whose slopes (f_x on dv/dt, f_y on v r, heading on course) are far from 1, or accept."""

    force: Literal["measured", "from-speed"] = "measured"
    """Whether the log has a force. From speed, it is dv/dt + omega x v with gravity, for rates about
    the car's own axes on a level road."""

    rates: Literal["measured", "from-course", "from-force"] = "measured"
    """Whether the log has angular rates. From course, the yaw rate is the rate of the course; from force, it
    is f_y / v of a device whose axes are those of the car. Roll and pitch rates are then zero."""

    gravity: Literal["measured", "add"] = "measured"
    """Whether the force contains gravity. If it is to be added, roll and pitch are those given, or zero."""

    gravity_m_s2: Positive | None = None
    """Gravity as the device measures it; estimated if not given. The difference to 9.81 is taken as a
    bias of the vertical axis."""

    rate_bias_deg_s: Vector3 | None = None
    """Bias of the rates about the car's axes; estimated if not given."""

    speed_delay_s: float | None = None
    """How long the speed lags behind the force; estimated if not given, s."""

    @field_validator("cutoff_hz")
    @classmethod
    def _below_half_the_rate(cls, cutoff_hz: float, info: ValidationInfo) -> float:
        # A rate that is itself wrong is missing here, and is reported on its own.
        rate_hz = info.data.get("rate_hz")
        if rate_hz is not None and cutoff_hz >= 0.5 * rate_hz:
            raise ValueError(f"must be below half of rate_hz, {0.5 * rate_hz:g} Hz")
        return cutoff_hz


RECEIVED: Final = ("speed", "course")
"""Signals of a receiver, which may have a lower rate than the rows of the log."""

_SPARSE: Final = 0.6
"""A signal with a smaller share of filled cells has a rate of its own."""

_THINNED: Final = 0.4
"""So has another signal whose values were thinned out."""

_SPARSE_STEPS: Final = 2.5
"""Such a signal has a gap where a step exceeds so many of its median steps."""

REQUIRED: Final = ("time", *FORCES, *RATES)
"""Signals an import cannot do without."""


@dataclass(frozen=True)
class RawLog:
    """Signals of a log in SI units, as recorded.

    Attributes:
        time: (n,) s, starting at 0; may be broken in every way a log can be.
        signals: Each (n,), SI units, device axes; NaN where a cell was empty.
        rows: (n,) number of each data row in the file, from 1, for messages.
        time_unit: Of the time column, for messages.
        first_stamp_s: First stamp as the log counts it, s.
        clock: Name of the topic, group or file whose stamps these are, where a recording has several.
        no_values: By signal, the number that stands for an empty cell, its first row and its count.
    """

    time: Floats
    signals: Mapping[str, Floats]
    rows: NDArray[np.intp]
    time_unit: str = "s"
    first_stamp_s: float = 0.0
    clock: str = ""
    no_values: Mapping[str, tuple[float, int, int]] = field(default_factory=dict)


@dataclass(frozen=True)
class Change:
    """What was mended in a log, by choice.

    Attributes:
        text: For people, with rows and times of the log.
        places: Times at which values were changed, s; empty where all were.
    """

    text: str
    places: tuple[float, ...] = ()

    def later(self, start: float) -> Change:
        """The change in a time that begins at ``start`` of this one."""
        return replace(self, places=tuple(place - start for place in self.places))


def parse_columns(texts: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Read ``signal=column`` and ``signal=column:unit`` into columns and units by signal.

    Raises:
        ConfigurationError: a text has no ``=``, or a signal is unknown or given twice.
    """
    columns: dict[str, str] = {}
    units: dict[str, str] = {}
    for text in texts:
        signal, equals, column = text.partition("=")
        if not equals or not column:
            raise ConfigurationError(f"column {text!r}: expected signal=column or signal=column:unit")
        check_signal(signal)
        if signal in columns:
            raise ConfigurationError(f"column {signal!r} is given twice; name it once")
        name, colon, unit = column.rpartition(":")
        columns[signal] = name if colon else column
        if colon:
            units[signal] = unit
    return columns, units


def check_signal(signal: str) -> None:
    """Refuse a signal that no import knows."""
    if signal not in UNITS:
        raise ConfigurationError(f"unknown signal {signal!r}. {suggest(signal, UNITS)}")


_FILTER_ORDER: Final = 2
"""Butterworth order of one pass; forwards and backwards doubles it."""

USUAL_STEP_S: Final = (5e-4, 0.5)
"""Steps of the logs that devices in cars write; others have probably another unit."""

_SHORTEST_S: Final = 1.0
"""A shorter record has nothing to estimate from, and is all edge for the filter."""

Series = tuple[Floats, Floats]
"""Time stamps and values of one signal, without gaps in the values."""


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


def close_gaps(log: RawLog, options: ImportOptions) -> tuple[dict[str, Series], Timing]:
    """Refuse or bridge the gaps of every signal of a log.

    Raises:
        DataError: time runs backwards, or there is a gap that the options refuse.
    """
    keep = _kept_rows(log, options)
    rows, time = log.rows[keep], log.time[keep]
    for name, (number, row, count) in log.no_values.items():
        if options.gaps == "refuse":
            raise DataError(
                f"{name} is {number:.6g} at data row {row} ({count} in all), which stands for no value; set "
                "gaps='bridge', or mend the log"
            )
    series = {
        name: _without_holes(name, (time, values[keep]), rows, options)
        for name, values in log.signals.items()
    }
    likely = _likely_unit(time, log.time_unit, log.first_stamp_s)
    # A receiver with a clock of its own has a rate of its own, too.
    received = bool(log.clock) and all(name in RECEIVED for name in log.signals)
    sparse = [
        name for name, values in log.signals.items() if received or _sparse(name, np.isfinite(values[keep]))
    ]
    bridged = sum(
        _bridge(name, stamps, options, likely, name in sparse) for name, (stamps, _) in series.items()
    )
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


def _kept_rows(log: RawLog, options: ImportOptions) -> NDArray[np.intp]:
    """Indices of the rows with a time stamp of their own."""
    time = log.time
    known = np.flatnonzero(np.isfinite(time))
    _refuse(options, log.rows[~np.isfinite(time)], "time is empty")
    steps = np.diff(time[known])
    if np.any(steps < 0.0):
        row = log.rows[known[int(np.argmax(steps < 0.0)) + 1]]
        raise DataError(f"time runs backwards at data row {row}; sort or split the log")
    _refuse(options, log.rows[known[1:][steps == 0.0]], "time stamp repeats")
    kept = np.concatenate([known[:1], known[1:][steps > 0.0]])
    if len(kept) < 2 or time[kept[-1]] - time[kept[0]] < _SHORTEST_S:
        likely = _likely_unit(time[kept], log.time_unit, log.first_stamp_s) or "; name a longer one"
        raise DataError(f"the log is shorter than {_SHORTEST_S:g} s{likely}")
    return kept


def _without_holes(name: str, series: Series, rows: NDArray[np.intp], options: ImportOptions) -> Series:
    time, values = series
    if np.any(np.isinf(values)):
        raise DataError(f"{name} is infinite at data row {rows[np.isinf(values)][0]}; mend the log")
    known = np.isfinite(values)
    if not _sparse(name, known):
        _refuse(options, rows[~known], f"{name} has an empty or NaN cell")
    if known.sum() < 2:
        raise DataError(f"{name} has fewer than 2 values; name another column")
    return time[known], values[known]


def _sparse(name: str, known: NDArray[np.bool_]) -> bool:
    """Whether a signal comes at a rate of its own, as a receiver's does, and leaves other cells empty."""
    return bool(known.mean() < (_SPARSE if name in RECEIVED else _THINNED))


def _likely_unit(time: Floats, unit: str, first: float) -> str:
    """The unit that the time stamps probably have, as the end of a message; nothing if theirs will do."""
    if len(time) < 2:
        return ""
    step, known = float(np.median(np.diff(time))), UNITS["time"]
    if unit == "s" and looks_like_clock_time(time + first):
        return ": the time looks like HHMMSS, which jumps at each minute; declare time=COLUMN:hhmmss"
    least, most = USUAL_STEP_S
    if least <= step <= most:
        return ""
    likely = [one for one, factor in known.items() if least <= step / known[unit] * factor <= most]
    said = f"; the steps of the time are {step:.3g} s: is its unit {unit}?"
    return f"{said} It looks like {likely[0]} (time=COLUMN:{likely[0]})" if likely else said


def looks_like_clock_time(stamps: Floats) -> bool:
    """Whether stamps (n,) read as HHMMSS, and each minute and hour that ends makes the jump of that."""
    stamps = stamps[np.isfinite(stamps)]
    steps = np.diff(stamps)
    if not np.any(steps > 0.0):
        return False
    step = float(np.median(steps))
    jumps = np.abs((steps + 0.5) % 100.0 - 40.5) <= 2.0 * step + 0.5
    return bool(
        step < 10.0
        and np.all(stamps % 100.0 < 60.0)
        and np.all(stamps // 100.0 % 100.0 < 60.0)
        and np.all(jumps[steps > 10.0])
        and np.any(jumps & (steps > 10.0))
    )


def _bridge(name: str, time: Floats, options: ImportOptions, likely: str, sparse: bool) -> int:
    steps = np.diff(time)
    longest = max(options.longest_step_s, _SPARSE_STEPS * float(np.median(steps)) if sparse else 0.0)
    long = steps > longest
    if options.gaps == "refuse" and np.any(long):
        at = int(np.argmax(long))
        raise DataError(
            f"gap of {steps[at]:.3g} s in {name} at {time[at]:.3f} s "
            + (f"(its usual step is {np.median(steps):.3g} s)" if sparse else f"(longest_step_s={longest:g})")
            + (likely or "; set gaps='bridge', or leave it out with start_s or end_s")
        )
    if steps.max() > options.longest_gap_s:
        at = int(np.argmax(steps))
        raise DataError(
            f"gap of {steps[at]:.3g} s in {name} at {time[at]:.3f} s is too long to bridge "
            f"(longest_gap_s={options.longest_gap_s:g})" + (likely or "; leave it out with start_s or end_s")
        )
    return int(long.sum())


def _refuse(options: ImportOptions, rows: NDArray[np.intp], what: str) -> None:
    if options.gaps == "refuse" and len(rows):
        raise DataError(
            f"{what} at data row {rows[0]} ({len(rows)} in all); set gaps='bridge', or mend the log"
        )


@dataclass(frozen=True)
class Grid:
    """An even time grid that is fine enough for the log's own rate.

    Attributes:
        time: (m,) s from 0, at ``every`` times the given rate.
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
