"""Import of a recorded drive: from a log of any device to cues in the car's frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..cues import GRAVITY, CueTrace, Floats
from ..errors import DataError
from .channels import (
    check_range,
    check_speed,
    check_standstill,
    drop_frozen,
    mend_spikes,
    thin_holds,
)
from .computed import with_rates
from .mounting import (
    CLEAR,
    LONGEST_DELAY_S,
    Estimate,
    Mounting,
    YawUnknownError,
    correlation,
    detrended,
    estimate,
    gather,
    shift,
    speed_delay,
    yaw_bias,
)
from .plausibility import (
    Slopes,
    check_axes,
    check_constancy,
    check_fastest,
    check_gravity,
    check_senses,
    check_slopes,
    silent_stretches,
)
from .proposal import Proposal
from .readers import read_recording
from .readers.recording import Recording
from .selection import selected, take
from .signals import (
    Change,
    Grid,
    ImportOptions,
    RawLog,
    Series,
    Timing,
    close_gaps,
    low_pass,
    make_grid,
    on_grid,
)
from .timing import in_order, without_repeats
from .units import FORCES, RATES

SPEED_CUTOFF_HZ: Final = 1.0
"""Cut-off of the speed channel, Hz: satellite and wheel speeds come in steps of about a tenth of a second."""


@dataclass(frozen=True)
class Findings:
    """What an import found and decided.

    Attributes:
        timing: Sample times and gaps.
        device: Mounting, biases and correlations.
        slopes: How steeply force and heading follow speed and course.
        speed_delay: How long the speed lags behind the force, s.
        gravity: Gravity as the device measures it, m/s^2.
        changes: What was mended in the log, by choice, with places in the trace's time.
        format: Of the file, with its dialect.
        selection: Columns that were taken, with their units.
    """

    timing: Timing
    device: Estimate
    slopes: Slopes
    speed_delay: float
    gravity: float
    changes: tuple[Change, ...] = ()
    format: str = ""
    selection: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """A report for people, angles in degrees."""
        t, d, m = self.timing, self.device, self.device.mounting
        roll, pitch, yaw = (math.degrees(angle) for angle in (m.roll, m.pitch, m.yaw))
        bias = ", ".join(f"{math.degrees(b):.2f}" for b in d.rate_bias)
        course = "no course" if d.rate_course is None else f"{d.rate_course:.3f}"
        return [
            f"format             {self.format}",
            *(f"column             {line}" for line in self.selection),
            f"rows               {t.rows}, {t.rate_hz:.1f} Hz, longest step {t.longest_step_s:.3f} s",
            f"missing            {t.repeated} stamps, {t.empty_cells} cells; {t.bridged} gaps bridged",
            f"mounting           roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} deg",
            f"lateral axis       {'mirrored' if m.lateral_sign < 0 else 'as it is'}",
            f"rates              {'reversed' if m.rate_sign < 0 else 'as they are'}",
            f"gravity            {self.gravity:.3f} m/s^2 ({d.rest_from})",
            f"bias of rates      {bias} deg/s (roll and pitch: {d.bias_from[0]}, yaw: {d.bias_from[1]})",
            f"delay of speed     {self.speed_delay:.2f} s",
            f"f_x with dv/dt     correlation {d.force_speed:.3f}",
            f"f_y with v r       correlation {d.force_turn:.3f}",
            f"heading, course    correlation {course}",
            *self.slopes.lines(),
            *(f"changed            {change.text}" for change in self.changes),
            *(f"note               {note}" for note in d.notes),
        ]


@dataclass(frozen=True)
class ImportedLog:
    """A converted drive, with what was found on the way.

    Attributes:
        trace: Cues in F_A, with the channel ``speed_m_s`` if the log has a speed.
        findings: What was estimated.
        raw_force: (n, 3) unfiltered specific force in device axes, at the trace's times, m/s^2.
        raw_rate: (n, 3) unfiltered angular velocity in device axes, at the trace's times, rad/s.
    """

    trace: CueTrace
    findings: Findings
    raw_force: Floats
    raw_rate: Floats


def import_log(
    path: str | Path,
    columns: Mapping[str, str] | None = None,
    *,
    units: Mapping[str, str] | None = None,
    options: ImportOptions | None = None,
    name: str | None = None,
) -> ImportedLog:
    """Turn a log into cues.

    The steps: read and scale the columns, close gaps, resample, estimate how the device sits
    in the car, turn its axes into the car's, take out biases so that the car at rest feels
    f = [0, 0, -9.81], and low-pass without delay.

    Args:
        path: A file of any format that :data:`.readers.FORMATS` lists.
        columns: Column of each signal (``time``, ``force_x`` to ``force_z``, ``rate_x`` to
            ``rate_z``, and, if there are any, ``speed`` and ``course``). A leading ``-``
            reverses a column; a number stands for a constant, ``none`` for no column. The log's own
            columns are found for signals that are missing here.
        units: Unit of each signal, see :data:`.units.UNITS`; that of the file, or SI, by default.
        options: Rate, filter, gaps, and what shall not be estimated.
        name: Name of the trace; that of the file by default.

    Raises:
        ConfigurationError: a signal, unit or option is wrong.
        DataError: the log is broken, or does not show what has to be estimated.
    """
    options = options or ImportOptions()
    return import_recording(
        read_recording(path, options),
        columns or {},
        units=units,
        options=options,
        name=name or Path(path).stem,
        source=path,
    )


def import_recording(
    recording: Recording,
    columns: Mapping[str, str],
    *,
    units: Mapping[str, str] | None = None,
    options: ImportOptions | None = None,
    name: str,
    source: str | Path,
) -> ImportedLog:
    """Turn a recording into cues, as :func:`import_log` does; ``source`` is the file, for messages."""
    options = options or ImportOptions()
    if recording.car_axes:
        options = _in_car(options)
    selection = select_columns(recording, columns, units or {}, options)
    changes = list(recording.changes)
    logs = []
    for log in take(recording, selection, source):
        try:
            log, repeats = without_repeats(log, options)
            log, mended = in_order(log, options)
        except DataError as error:
            raise DataError(f"{log.clock}: {error}" if log.clock else str(error)) from None
        logs.append(_cut(log, options))
        changes += [*repeats, *mended]
        changes += [
            Change(f"{signal}: {number:.6g} taken as no value ({count} in all, first at data row {row})")
            for signal, (number, row, count) in log.no_values.items()
        ]
    speed = next((log for log in logs if "speed" in log.signals), None)
    series: dict[str, Series] = {}
    timings = []
    for log in logs:
        log, thinned = thin_holds(log, options)
        log, spikes = mend_spikes(log, options)
        saturated = check_range(log, options)
        log, holds = drop_frozen(log, options, speed)
        check_speed(log)
        changes += [*thinned, *spikes, *saturated, *holds]
        found, timing = close_gaps(log, options)
        series |= found
        timings.append(timing)
    timing = replace(
        timings[0],
        repeated=sum(one.repeated for one in timings),
        empty_cells=sum(one.empty_cells for one in timings),
        bridged=sum(one.bridged for one in timings),
    )
    grid = make_grid(series, options.rate_hz, timing.rate_hz)
    raw = {signal: on_grid(series[signal], grid) for signal in selection.columns if signal in series}
    if options.force == "from-speed":
        raw, options, change = _with_force(raw, grid, options)
        changes.append(change)
    elif options.gravity == "add":
        raw, options, change = _with_gravity(raw, options)
        changes.append(change)
    if options.rates != "measured":
        raw, options, change = with_rates(raw, grid, options)
        changes.append(change)
    findings = _find(raw, grid, timing, changes, selection.units, options)
    if recording.car_axes and options.slopes == "refuse":
        check_senses(findings.slopes)
    return ImportedLog(
        trace=_trace(name, Path(source).name, raw, grid, findings, options),
        findings=replace(findings, format=recording.format, selection=tuple(selection.lines())),
        raw_force=_stacked(raw, FORCES)[:: grid.every],
        raw_rate=_stacked(raw, RATES)[:: grid.every],
    )


def _in_car(options: ImportOptions) -> ImportOptions:
    """Options for signals in the car's own axes: nothing is estimated that is not given."""
    known: dict[str, Any] = dict.fromkeys(("roll_deg", "pitch_deg", "yaw_deg", "speed_delay_s"), 0.0)
    known |= {"gravity_m_s2": GRAVITY, "rate_bias_deg_s": (0.0, 0.0, 0.0)}
    given = {name: value for name, value in known.items() if getattr(options, name) is None}
    given |= {name: "keep" for name in ("lateral_sign", "rate_sign") if getattr(options, name) == "estimate"}
    return replace(options, **given)


def select_columns(
    recording: Recording, columns: Mapping[str, str], units: Mapping[str, str], options: ImportOptions
) -> Proposal:
    """The columns that an import with these options takes from a recording."""
    required = ["time", *(FORCES if options.force == "measured" else ("speed",))]
    unused = [] if options.force == "measured" else [*FORCES]
    if options.rates == "measured":
        required += RATES
    else:
        required += ["course"] if options.rates == "from-course" else ["speed"]
        unused += RATES
    return selected(recording, columns, units, tuple(dict.fromkeys(required)), tuple(unused))


def _with_force(
    raw: Mapping[str, Floats], grid: Grid, options: ImportOptions
) -> tuple[dict[str, Floats], ImportOptions, Change]:
    """Signals with f = dv/dt + omega x v - g of a car that moves along its x axis, and its options."""
    rate = _stacked(raw, RATES)
    course = raw.get("course")
    evidence = gather(grid.rate_hz, np.zeros_like(rate), rate, raw["speed"], course, options.standstill_m_s)
    sign = {"keep": 1, "flip": -1}.get(options.rate_sign, 1)
    if options.rate_sign == "estimate" and evidence.course is not None:
        heading = detrended(np.cumsum(evidence.rate[:, 2]) * evidence.dt)
        sign = -1 if correlation(heading, detrended(evidence.course)) < -CLEAR else 1
    speed = low_pass(raw["speed"], grid.rate_hz, min(SPEED_CUTOFF_HZ, options.cutoff_hz))
    yaw_rate = sign * (rate[:, 2] - yaw_bias(evidence, evidence.rate[:, 2]))
    pitch_rate = sign * (rate[:, 1] - rate[:, 1].mean())
    force = {
        "force_x": np.gradient(speed, 1.0 / grid.rate_hz),
        "force_y": speed * yaw_rate,
        "force_z": -speed * pitch_rate - GRAVITY,
    }
    aligned = replace(
        options,
        roll_deg=0.0,
        pitch_deg=0.0,
        yaw_deg=0.0,
        lateral_sign="keep",
        rate_sign="flip" if sign < 0 else "keep",
        gravity_m_s2=GRAVITY,
        speed_delay_s=options.speed_delay_s or 0.0,
    )
    return (
        {**raw, **force},
        aligned,
        Change("force not measured: computed as dv/dt + omega x v, with gravity"),
    )


def _with_gravity(
    raw: Mapping[str, Floats], options: ImportOptions
) -> tuple[dict[str, Floats], ImportOptions, Change]:
    """Signals with the force of gravity at the attitude given, or at none, which then holds."""
    roll, pitch = options.roll_deg or 0.0, options.pitch_deg or 0.0
    rest = Mounting(math.radians(roll), math.radians(pitch)).matrix.T @ [0.0, 0.0, -GRAVITY]
    added = {name: raw[name] + rest[axis] for axis, name in enumerate(FORCES)}
    change = Change(f"gravity added, for a device at roll {roll:g}, pitch {pitch:g} deg")
    return {**raw, **added}, replace(options, roll_deg=roll, pitch_deg=pitch), change


def _find(
    raw: Mapping[str, Floats],
    grid: Grid,
    timing: Timing,
    changes: list[Change],
    units: Mapping[str, str],
    options: ImportOptions,
) -> Findings:
    evidence = gather(
        grid.rate_hz,
        _stacked(raw, FORCES),
        _stacked(raw, RATES),
        raw.get("speed"),
        raw.get("course"),
        options.standstill_m_s,
    )
    check_fastest(evidence, units)
    recorded = evidence
    delay = speed_delay(evidence) if options.speed_delay_s is None else options.speed_delay_s
    evidence = evidence.delayed(delay)
    check_constancy(evidence, options)
    check_gravity(evidence, options)
    check_standstill(evidence)
    try:
        device = estimate(evidence, options)
    except YawUnknownError:
        # Axes that change are a better reason than none that shows.
        if options.slopes == "refuse":
            check_axes(recorded)
        raise
    if options.speed_delay_s is None and delay >= LONGEST_DELAY_S - 1e-6:
        note = (
            f"the delay of the speed is at the end of its range of {LONGEST_DELAY_S:g} s: check speed and "
            "course, or give speed_delay_s"
        )
        device = replace(device, notes=(*device.notes, note))
    silent = silent_stretches(evidence, device.mounting)
    device = replace(device, notes=(*device.notes, *silent))
    slopes = Slopes.of(evidence, device.mounting)
    if options.slopes == "refuse":
        check_slopes(slopes)
        check_axes(recorded)
    gravity = float(np.linalg.norm(device.rest)) if options.gravity_m_s2 is None else options.gravity_m_s2
    return Findings(
        timing, device, slopes, delay, gravity, tuple(change.later(grid.start) for change in changes)
    )


def _trace(
    name: str, source: str, raw: Mapping[str, Floats], grid: Grid, findings: Findings, options: ImportOptions
) -> CueTrace:
    device = findings.device
    force = device.mounting.force_in_car(_stacked(raw, FORCES))
    force[:, 2] += findings.gravity - GRAVITY
    rate = device.mounting.rate_in_car(_stacked(raw, RATES)) - device.rate_bias
    channels = {}
    if "speed" in raw:
        smooth = low_pass(raw["speed"], grid.rate_hz, min(SPEED_CUTOFF_HZ, options.cutoff_hz))
        speed = shift(smooth, findings.speed_delay, 1.0 / grid.rate_hz)
        channels["speed_m_s"] = np.maximum(speed, 0.0)[:: grid.every]
    return CueTrace(
        name=name,
        time=np.arange(len(grid.time[:: grid.every])) / options.rate_hz,
        specific_force=low_pass(force, grid.rate_hz, options.cutoff_hz)[:: grid.every],
        angular_velocity=low_pass(rate, grid.rate_hz, options.cutoff_hz)[:: grid.every],
        channels=channels,
        source=source,
    )


def _stacked(signals: Mapping[str, Floats], names: tuple[str, ...]) -> Floats:
    return np.stack([signals[name] for name in names], axis=1)


def _cut(log: RawLog, options: ImportOptions) -> RawLog:
    """The rows between start and end; the course made continuous."""
    # A row without a stamp stays: it is a gap.
    before = log.time < options.start_s
    after = log.time > (math.inf if options.end_s is None else options.end_s)
    keep = ~(before | after)
    if not np.any(keep):
        raise DataError(f"start_s={options.start_s:g}: no rows are left; the log has {len(log.time)}")
    signals = {name: values[keep] for name, values in log.signals.items()}
    if "course" in signals:
        signals["course"] = _unwrapped(signals["course"], log.rows[keep])
    return replace(log, time=log.time[keep], signals=signals, rows=log.rows[keep])


def _unwrapped(course: Floats, rows: NDArray[np.intp]) -> Floats:
    """Course (n,) without jumps of a full turn; NaN stays NaN."""
    known = np.flatnonzero(np.isfinite(course))
    steps = np.abs(np.diff(course[known]))
    # The step across north is less than a full turn.
    if np.any(steps > 1.1 * math.tau):
        at = int(np.argmax(steps > 1.1 * math.tau))
        raise DataError(
            f"course jumps by {steps[at]:.4g} rad at data row {rows[known[at + 1]]}: its unit is not rad; "
            "declare course=COLUMN:deg, or mend the log"
        )
    result = course.copy()
    result[known] = np.unwrap(course[known])
    return result
