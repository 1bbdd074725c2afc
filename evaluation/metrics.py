"""Metrics: how well the motion of a simulator follows that of a car, and how the machine was used.

A metric is declared once, as a field of :class:`Metrics` (a drive), :class:`AxisMetrics` or
:class:`ActuatorMetrics`: see :func:`metric`. Tables, ``results.csv``, ``results.json``, reports, studies and
the page of metrics read this declaration. To add a metric, add a field with its function here.

In formulas c is the signal of the car on one axis, s that of the simulator, and e = s - c.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property
from math import radians
from typing import Any, Final, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..envs.cues import GRAVITY
from ..envs.platform.kernels import ACTUATORS, AXES
from ..envs.settings import Positive, Vector3, configuration
from ..envs.simulator.kernels.step import CueCost
from .reporting.text import degrees, microseconds, number, percent, seconds
from .trajectory import AT_ACCELERATION, AT_DISPLACEMENT, AT_VELOCITY, Floats, Trajectory

Mask = NDArray[np.bool_]
T = TypeVar("T")

CUE_AXES: Final = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")
"""Specific force (m/s^2) and angular velocity (rad/s) in the cab's axes."""
FLAT: Final = 1e-6
"""A standard deviation below this (m/s^2, rad/s) is rounding: the signal counts as constant."""
_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Cue of a driver at rest on level ground, on each of the axes."""
_ZONE: Final = CueCost()


# Criteria: the thresholds of the metrics.


@configuration
class References:
    """The policies between which the normalized score is measured; see ``comparison.py``.

    Args:
        baseline: The reference washout, score 0.
        optimum: The policy with the lowest J there is, score 1.
        perceived_optimum: The policy with the lowest perceived J there is, score 1 of the perceived J.
    """

    baseline: str = "classical-tuned"
    optimum: str = "optimum"
    perceived_optimum: str = "optimum-perceived"


@configuration
class Criteria:
    """Published thresholds, and the references of the score. Every table of this project has the defaults.

    Args:
        indifference_force: Indifference zone of specific force, m/s^2: an error that no driver minds (Slob
            et al., Bosch Rexroth).
        indifference_rate: Indifference zone of angular velocity, rad/s (the same source; 3 deg/s).
        force_threshold: Perception of specific force x, y, z, m/s^2 (Reid and Nahon, from memory).
        rate_threshold: Perception of angular velocity x, y, z, rad/s (Zacharias; Reid and Nahon;
            3.0, 3.6, 2.6 deg/s).
        tilt_rate: Rate up to which tilt coordination goes unnoticed, rad/s (3 deg/s, SIMONA).
        delay_range: Largest delay or lead searched, s; a cue that comes later is a missing cue instead.
        delay_correlation: Least correlation at which a delay is reported at all.
        action_tolerance: An applied acceleration this near the requested one is not clipped, m/s^2, rad/s^2.
        vibration_above: Motion of a higher frequency is vibration, Hz.
        vibration_window: Length over which it is averaged, s (the running RMS of ISO 2631-1).
        references: Policies between which the normalized score is measured.
    """

    indifference_force: Positive = _ZONE.force
    indifference_rate: Positive = _ZONE.rate
    force_threshold: Vector3 = (0.17, 0.17, 0.28)
    rate_threshold: Vector3 = (radians(3.0), radians(3.6), radians(2.6))
    tilt_rate: Positive = radians(3.0)
    delay_range: Positive = 1.0
    delay_correlation: Positive = 0.5
    action_tolerance: Positive = 1e-4
    vibration_above: Positive = 4.0
    vibration_window: Positive = 1.0
    references: References = References()

    @property
    def indifference_zone(self) -> tuple[float, ...]:
        """Indifference zone of f x, y, z and w x, y, z."""
        return (self.indifference_force,) * 3 + (self.indifference_rate,) * 3

    @property
    def thresholds(self) -> tuple[float, ...]:
        """Perception thresholds of f x, y, z and w x, y, z."""
        return self.force_threshold + self.rate_threshold


# Formulas: pure functions of arrays.


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


# Signals: the motion of a drive, as the metrics see it.


def cab_motion(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Reference and simulator cue at the cab, (n, 6) by :data:`CUE_AXES`, zero at rest on level ground."""
    reference = np.column_stack([trajectory.f_reference, trajectory.w_reference]) - _REST
    simulated = np.column_stack([trajectory.f_simulator, trajectory.w_simulator]) - _REST
    return reference, simulated


def perceived_motion(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Perceived cues in car and simulator, (n, 6) by :data:`CUE_AXES`, zero at rest on level ground."""
    reference = np.column_stack([trajectory.perceived_f_reference, trajectory.perceived_w_reference]) - _REST
    simulated = np.column_stack([trajectory.perceived_f_simulator, trajectory.perceived_w_simulator]) - _REST
    return reference, simulated


def cue_error(reference: Floats, simulated: Floats, criteria: Criteria | None = None) -> Floats:
    """(n,) |df|^2 / (0.6 m/s^2)^2 + |dw|^2 / (3 deg/s)^2, whose mean over time is J.

    Args:
        reference: (n, 6) by :data:`CUE_AXES`.
        simulated: (n, 6) the same of the simulator.
        criteria: The indifference zone.
    """
    zone = np.array((criteria or Criteria()).indifference_zone)
    return np.asarray(np.sum(((simulated - reference) / zone) ** 2, axis=1))


def tilt_rate(trajectory: Trajectory) -> Floats:
    """(n,) magnitude of the cab's roll and pitch rate beyond the car's own, rad/s.

    It is measured at the cab, where the driver sits, so that it holds for any policy. A cab that rolls with
    its car, or less, has none. A machine that stands still has none.
    """
    extra = beyond(trajectory.w_reference[:, :2], trajectory.w_simulator[:, :2])
    return np.asarray(np.hypot(extra[:, 0], extra[:, 1]))


@dataclasses.dataclass(eq=False)
class AxisSignals:
    """The signals of one axis, m/s^2 or rad/s, and its thresholds.

    Args:
        motions: (4, n) reference and simulator cue, then the perceived ones.
        dt: Time step, s.
        zone: Indifference zone.
        threshold: Of perception.
        criteria: All thresholds.
    """

    motions: Floats
    dt: float
    zone: float
    threshold: float
    criteria: Criteria

    def __post_init__(self) -> None:
        self.reference, self.simulated, self.perceived_reference, self.perceived_simulated = self.motions

    @cached_property
    def false(self) -> Mask:
        """(n,) samples with a false cue."""
        return false_cues(self.reference, self.simulated, self.threshold)

    @cached_property
    def missing(self) -> Mask:
        """(n,) samples with a missing cue."""
        return missing_cues(self.reference, self.simulated, self.threshold)

    @cached_property
    def error(self) -> Floats:
        """(n,) squared error over the indifference zone."""
        return np.asarray(((self.simulated - self.reference) / self.zone) ** 2)

    @property
    def delay(self) -> float | None:
        """See :func:`delay`. Below the threshold there is nothing whose delay a driver could feel."""
        if min(np.abs(self.reference).max(), np.abs(self.simulated).max()) <= self.threshold:
            return None
        reach, least = self.criteria.delay_range, self.criteria.delay_correlation
        return delay(self.reference, self.simulated, self.dt, reach, least)


@dataclasses.dataclass(eq=False)
class ActuatorSignals:
    """The (n,) position of one actuator from neutral, its limits, and where any of them is active."""

    position: Floats
    low: float
    high: float
    active: Mask

    @property
    def stroke_share(self) -> float | None:
        """Largest share of the way from neutral to a limit; None without a limit or without travel."""
        low, high, position = self.low, self.high, self.position
        if not (np.isfinite(low) and np.isfinite(high) and low < 0.0 < high):
            return None
        return float(max(position.max() / high, position.min() / low, 0.0))


class DriveSignals:
    """The signals of a drive."""

    def __init__(self, trajectory: Trajectory, criteria: Criteria) -> None:
        self.trajectory, self.criteria = trajectory, criteria
        motions = np.stack([*cab_motion(trajectory), *perceived_motion(trajectory)])
        self.axes = {
            axis: AxisSignals(motions[:, :, i], trajectory.dt, zone, threshold, criteria)
            for i, (axis, zone, threshold) in enumerate(
                zip(CUE_AXES, criteria.indifference_zone, criteria.thresholds, strict=True)
            )
        }

    @cached_property
    def axis_metrics(self) -> dict[str, AxisMetrics]:
        """Metrics by :data:`CUE_AXES`."""
        return {axis: _measured(AxisMetrics, signals) for axis, signals in self.axes.items()}

    @property
    def actuators(self) -> dict[str, ActuatorSignals]:
        """Signals by :data:`~.trajectory.ACTUATORS`."""
        drive = self.trajectory
        low, high, positions = drive.limits.position_min, drive.limits.position_max, drive.positions
        return {
            name: ActuatorSignals(positions[:, i], low[i], high[i], drive.limits_active[:, i] != 0)
            for i, name in enumerate(ACTUATORS)
        }

    @cached_property
    def tilt_rate(self) -> Floats:
        """See :func:`tilt_rate`."""
        return tilt_rate(self.trajectory)

    def time_at(self, bits: int) -> float:
        """Share of time with any actuator at a limit of these kinds."""
        return float(np.any(self.trajectory.limits_active & bits, axis=1).mean())

    @property
    def clipped(self) -> float:
        """Share of steps whose applied acceleration differs from the requested one."""
        # Row 0 is the start: no action led to it.
        gap = np.abs(self.trajectory.applied[1:] - self.trajectory.action[1:])
        return float(np.mean(np.any(gap > self.criteria.action_tolerance, axis=1)))

    @property
    def vibration(self) -> float | None:
        """See :func:`vibration`; of the specific force."""
        drive, criteria = self.trajectory, self.criteria
        reference, simulated = (motion[:, :3] for motion in cab_motion(drive))
        return vibration(reference, simulated, drive.dt, criteria.vibration_above, criteria.vibration_window)

    def step_time(self, of: Callable[[Floats], Any]) -> float | None:
        """A statistic of the time the policy takes for a step, s; None where it was not measured."""
        measured = self.trajectory.step_time[np.isfinite(self.trajectory.step_time)]
        return float(of(measured)) if len(measured) else None


# The declaration of a metric.


def mean(values: Sequence[float]) -> float:
    """Plain mean."""
    return sum(values) / len(values)


Table = Literal["drive", "benchmark", "study"]
"""The tables of one maneuver, of the benchmark, and of a condition of a study."""
EVERY_TABLE: Final[tuple[Table, ...]] = ("drive", "benchmark", "study")


@dataclasses.dataclass(frozen=True)
class Display:
    """How a table shows a value.

    Args:
        unit: Behind the header.
        text: Value in SI units to text.
    """

    unit: str
    text: Callable[[float | None], str]


PLAIN: Final = Display("", number)
PERCENT: Final = Display("%", percent)
DEGREES_PER_SECOND: Final = Display("deg/s", degrees)
MICROSECONDS: Final = Display("µs", microseconds)
ACCELERATION: Final = Display("m/s²", number)
SECONDS: Final = Display("s", seconds)
OF_AXIS: Final = Display("", number)
"""In m/s^2 on an axis of force, in deg/s on one of rotation."""


@dataclasses.dataclass(frozen=True)
class Metric:
    """The declaration of a metric.

    Args:
        measure: Gives the value from the signals of a drive, an axis or an actuator.
        definition: One to four sentences, for the page of metrics.
        unit: SI, of the value in files.
        header: In tables, without unit. A metric without header is in files only.
        display: How tables show the value.
        over_drives: Makes one value of those of several drives.
        better: The better direction, where there is one.
        source: Literature.
        tables: The tables in which it is a column.
        name: Of the field.
    """

    measure: Callable[[Any], Any]
    definition: str
    unit: str = "1"
    header: str = ""
    display: Display = PLAIN
    over_drives: Callable[[Sequence[float]], float] = mean
    better: Literal["lower", "higher", ""] = "lower"
    source: str = ""
    tables: tuple[Table, ...] = ()
    name: str = ""

    @property
    def title(self) -> str:
        """Header with its unit."""
        return f"{self.header} {self.display.unit}".strip()


def metric(
    measure: Callable[[Any], Any],
    definition: str,
    *more: Any,
    default: Any = dataclasses.MISSING,
    **named: Any,
) -> Any:
    """Declare a metric, as the field of a configuration.

    Args:
        measure: The first argument of :class:`Metric`.
        definition: The second.
        more: The others, by place.
        default: Value in files that were written before the metric was declared.
        named: The others, by name.
    """
    one = Metric(measure, definition, *more, **named)
    return dataclasses.field(default=default, kw_only=True, metadata={"metric": one})


def declared(cls: type[Any]) -> list[Metric]:
    """The metrics that a class declares, in order."""
    return [
        dataclasses.replace(field.metadata["metric"], name=field.name)
        for field in dataclasses.fields(cls)
        if "metric" in field.metadata
    ]


def _measured(cls: type[T], signals: Any) -> T:
    return cls(**{one.name: one.measure(signals) for one in declared(cls)})


# The metrics.

_INDIFFERENCE: Final = "Indifference zone: Slob et al., Bosch Rexroth."
_GRANT: Final = "After the classification of Grant and Reid (1997, from memory)."


@configuration
class AxisMetrics:
    """Metrics of one axis of :data:`CUE_AXES`."""

    rmse: float = metric(
        lambda a: rms(a.simulated - a.reference),
        "√mean(e²).",
        "m/s² or rad/s", "RMSE", OF_AXIS,
    )  # fmt: skip
    nrmse: float = metric(
        lambda a: normalized_rmse(a.reference, a.simulated, a.threshold),
        "rmse / max(√mean(c²), perception threshold). No motion has 1 where the car moves. Where it hardly "
        "moves, the error is read in thresholds.",
        header="normalized",
    )
    correlation: float | None = metric(
        lambda a: pearson(a.reference, a.simulated),
        "Pearson's r of c and s. Undefined where a standard deviation is below 10⁻⁶.",
        header="correlation", better="higher",
        source="An objective indicator of motion cueing in Casas et al.",
    )  # fmt: skip
    delay: float | None = metric(
        lambda a: a.delay,
        "The lag τ in ±1 s with the highest Pearson correlation of c(t) and s(t + τ) over their overlap, "
        "refined by a parabola; positive: the simulator is late. The range is at most a quarter of the "
        "drive. Undefined where car or simulator never exceeds the threshold, where the highest correlation "
        "is below 0.5, or where it lies at the end of the range.",
        "s", "delay", SECONDS, better="",
    )  # fmt: skip
    false_cues: float = metric(
        lambda a: float(a.false.mean()),
        "Share of samples with |s| > threshold, |e| > threshold, and (|c| ≤ threshold or c·s < 0): motion "
        "where the car has none, or of the wrong sign.",
        header="false", display=PERCENT, source=_GRANT,
    )  # fmt: skip
    missing_cues: float = metric(
        lambda a: float(a.missing.mean()),
        "Share of samples with |c| > threshold, |s| ≤ threshold, |e| > threshold.",
        header="missing", display=PERCENT, source=_GRANT,
    )  # fmt: skip
    cue_error: float = metric(
        lambda a: float(a.error.mean()),
        "mean(e²) / zone²: this axis's part of J.",
        header="part of J", source=_INDIFFERENCE,
    )  # fmt: skip
    cue_error_false: float = metric(
        lambda a: float(np.mean(a.error * a.false)),
        "The part of `cue_error` that arises in samples with a false cue, divided by all samples.",
    )
    cue_error_missing: float = metric(
        lambda a: float(np.mean(a.error * a.missing)),
        "The part of `cue_error` that arises in samples with a missing cue, divided by all samples.",
    )
    perceived_rmse: float = metric(
        lambda a: rms(a.perceived_simulated - a.perceived_reference),
        "`rmse` of the perceived cues.",
        "m/s² or rad/s", "perceived RMSE", OF_AXIS,
    )  # fmt: skip
    perceived_nrmse: float = metric(
        lambda a: normalized_rmse(a.perceived_reference, a.perceived_simulated, a.threshold),
        "`nrmse` of the perceived cues.",
    )
    perceived_cue_error: float = metric(
        lambda a: float(np.mean(((a.perceived_simulated - a.perceived_reference) / a.zone) ** 2)),
        "`cue_error` of the perceived cues: this axis's part of the perceived J.",
        header="perceived part",
    )


@configuration
class ActuatorMetrics:
    """Use of one actuator of :data:`~.trajectory.ACTUATORS`: carriage x and y, legs 1 to 6, turntable."""

    stroke: float = metric(
        lambda a: float(np.abs(a.position).max()),
        "Largest distance from neutral.",
        "m or rad", over_drives=max, better="",
    )  # fmt: skip
    stroke_share: float | None = metric(
        lambda a: a.stroke_share,
        "Largest share of the way from neutral to a limit. Undefined where there is no limit or no travel.",
        header="stroke % of the limit", display=Display("", percent), over_drives=max, better="",
    )  # fmt: skip
    at_limit: float = metric(
        lambda a: float(a.active.mean()),
        "Share of samples at any limit.",
        header="time at a limit", display=PERCENT,
    )  # fmt: skip


@configuration
class Metrics:
    """All metrics of one drive."""

    duration: float = metric(
        lambda d: float(d.trajectory.time[-1] - d.trajectory.time[0]),
        "Last time − first time.",
        "s", better="",
    )  # fmt: skip
    cue_error: float = metric(
        lambda d: sum(axis.cue_error for axis in d.axis_metrics.values()),
        "J, the headline: mean over time of |Δf|² / (0.6 m/s²)² + |Δω|² / (3 deg/s)², the error of specific "
        "force and angular velocity at the cab over the indifference zone. 0 is perfect.",
        header="J", source=_INDIFFERENCE, tables=EVERY_TABLE,
    )  # fmt: skip
    perceived_cue_error: float = metric(
        lambda d: sum(axis.perceived_cue_error for axis in d.axis_metrics.values()),
        "J of the perceived cues, with the same indifference zone.",
        header="perceived J", source=_INDIFFERENCE, tables=EVERY_TABLE,
    )  # fmt: skip
    false_cues: float = metric(
        lambda d: float(np.any([axis.false for axis in d.axes.values()], axis=0).mean()),
        "Share of samples with a false cue on any axis.",
        header="false cues", display=PERCENT, source=_GRANT, tables=EVERY_TABLE,
    )  # fmt: skip
    missing_cues: float = metric(
        lambda d: float(np.any([axis.missing for axis in d.axes.values()], axis=0).mean()),
        "Share of samples with a missing cue on any axis.",
        header="missing cues", display=PERCENT, source=_GRANT, tables=("drive",),
    )  # fmt: skip
    tilt_rate_peak: float = metric(
        lambda d: float(d.tilt_rate.max()),
        "Maximum of the tilt rate: roll and pitch rate of the cab beyond the car's own.",
        "rad/s", "tilt rate peak", DEGREES_PER_SECOND, max, tables=EVERY_TABLE,
    )  # fmt: skip
    tilt_rate_share: float = metric(
        lambda d: float(np.mean(d.tilt_rate > d.criteria.tilt_rate * (1.0 + FLAT))),
        "Share of samples with a tilt rate above 3 deg/s.",
        header="tilt rate above 3 deg/s", display=PERCENT, source="As used with SIMONA.",
        tables=("benchmark",),
    )  # fmt: skip
    vibration: float | None = metric(
        lambda d: d.vibration,
        "Largest √(mean |s|² − mean |c|²) over one second, of the three axes of specific force after a "
        "high-pass of 4 Hz (Butterworth, order 4, run both ways); 0 where that is never positive. Undefined "
        "in drives shorter than a second or sampled at less than 8 Hz.",
        "m/s²", "vibration", ACCELERATION, max,
        source="The window is that of the running RMS of ISO 2631-1.",
        tables=("drive", "benchmark"), default=None,
    )  # fmt: skip
    at_limit: float = metric(
        lambda d: d.time_at(AT_DISPLACEMENT | AT_VELOCITY | AT_ACCELERATION),
        "Share of samples with any actuator at any limit.",
        header="at a limit", display=PERCENT, tables=EVERY_TABLE,
    )  # fmt: skip
    at_displacement: float = metric(
        lambda d: d.time_at(AT_DISPLACEMENT),
        "Share of samples with any actuator at a displacement limit, braking before it included.",
    )
    at_velocity: float = metric(
        lambda d: d.time_at(AT_VELOCITY),
        "Share of samples with any actuator at a velocity limit.",
    )
    at_acceleration: float = metric(
        lambda d: d.time_at(AT_ACCELERATION),
        "Share of samples with any actuator at an acceleration limit.",
    )
    clipped: float = metric(
        lambda d: d.clipped,
        "Share of steps whose applied acceleration differs from the requested one by more than 10⁻⁴.",
        header="clipped", display=PERCENT, tables=("drive",),
    )  # fmt: skip
    step_time_mean: float | None = metric(
        lambda d: d.step_time(np.mean),
        "Mean time that the policy takes for a step. The time of `for_drive` is not in it.",
        "s", "step mean", MICROSECONDS, tables=("drive", "benchmark"),
    )  # fmt: skip
    step_time_p99: float | None = metric(
        lambda d: d.step_time(lambda times: np.percentile(times, 99.0)),
        "99th percentile of the time of a step.",
        "s", "step p99", MICROSECONDS, max, tables=("benchmark",),
    )  # fmt: skip
    step_time_max: float | None = metric(
        lambda d: d.step_time(np.max),
        "Longest step.",
        "s", "step max", MICROSECONDS, max, tables=("benchmark",), default=None,
    )  # fmt: skip
    axes: dict[str, AxisMetrics] = metric(lambda d: d.axis_metrics, "The metrics of each axis.", better="")
    actuators: dict[str, ActuatorMetrics] = metric(
        lambda d: {name: _measured(ActuatorMetrics, signals) for name, signals in d.actuators.items()},
        "The metrics of each actuator.",
        better="",
    )
    travel: dict[str, float] = metric(
        lambda d: dict(zip(AXES[2:8], np.abs(d.trajectory.hexapod).max(axis=0).tolist(), strict=True)),
        "Largest magnitude of each coordinate of the hexapod from neutral.",
        "m or rad", over_drives=max, better="",
    )  # fmt: skip

    @property
    def worst_axis(self) -> str:
        """The axis with the largest part of J."""
        return max(self.axes, key=lambda axis: self.axes[axis].cue_error)


for _cls in (AxisMetrics, ActuatorMetrics, Metrics):
    _arguments = [f"    {one.name}: {one.definition}" for one in declared(_cls)]
    _cls.__doc__ = "\n".join([f"{_cls.__doc__}\n\nArgs:", *_arguments])

_NESTED: Final = ("axes", "actuators", "travel")
"""Fields of :class:`Metrics` that hold more than one number."""
METRICS: Final[dict[str, Metric]] = {one.name: one for one in declared(Metrics) if one.name not in _NESTED}
"""The metrics of a drive that are one number, by name."""


def measure(trajectory: Trajectory, criteria: Criteria | None = None) -> Metrics:
    """All metrics of a trajectory."""
    return _measured(Metrics, DriveSignals(trajectory, criteria or Criteria()))


def over_drives(drives: Sequence[Metrics]) -> dict[str, float | None]:
    """One value of each of :data:`METRICS` for several drives; None where no drive has one."""
    combined: dict[str, float | None] = {}
    for name, one in METRICS.items():
        known = [value for drive in drives if (value := getattr(drive, name)) is not None]
        combined[name] = one.over_drives(known) if known else None
    return combined
