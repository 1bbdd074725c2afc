"""Metrics of a drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np

from ...envs.cues import GRAVITY
from ...envs.platform.kernels import ACTUATORS, AXES
from ...envs.settings import configuration
from ..trajectory import AT_ACCELERATION, AT_DISPLACEMENT, AT_VELOCITY, Floats, Trajectory
from .actuators import ActuatorMetrics, ActuatorSignals
from .axes import CLEIJ, CUE_AXES, GRANT, INDIFFERENCE, AxisMetrics, AxisSignals
from .comfort import motion_sickness_dose, vibration_total
from .criteria import Criteria
from .declaration import (
    ACCELERATION,
    DEGREES_PER_SECOND,
    EVERY_TABLE,
    JERK,
    MICROSECONDS,
    PERCENT,
    TIME,
    Metric,
    declared,
    documented,
    measured,
    metric,
    undefined,
)
from .feel import incongruence, jerk, ratio, worst_window
from .formulas import FLAT, beyond, rms, vibration
from .sickness import HeadMotion, sickness_incidence

ISO: Final = "ISO 2631-1."
CONFLICT: Final = "Inoue, Liu and Wada, SAE 2023-01-0176."
_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Cue of a driver at rest on level ground, on each of the axes."""


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
        return {axis: measured(AxisMetrics, signals) for axis, signals in self.axes.items()}

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

    @cached_property
    def worst_second(self) -> tuple[float, float]:
        """See :func:`~.feel.worst_window`; of the integrand of J."""
        error = np.sum([axis.error for axis in self.axes.values()], axis=0)
        return worst_window(error, self.trajectory.dt, self.criteria.worst_window)

    @cached_property
    def incongruence(self) -> Floats:
        """See :func:`~.feel.incongruence`."""
        drive, criteria = self.trajectory, self.criteria
        error = drive.f_simulator[:, :2] - drive.f_reference[:, :2]
        return incongruence(error, criteria.incongruence_weights, drive.dt, criteria.incongruence_time)

    @cached_property
    def ride_comfort(self) -> tuple[float, float]:
        """See :func:`~.comfort.vibration_total`; of car and simulator."""
        return self._of_both(vibration_total)

    @cached_property
    def motion_dose(self) -> tuple[float, float]:
        """See :func:`~.comfort.motion_sickness_dose`; of car and simulator."""
        return self._of_both(motion_sickness_dose)

    def _of_both(self, dose: Callable[[Floats, float], float]) -> tuple[float, float]:
        drive = self.trajectory
        return dose(drive.f_reference, drive.dt), dose(drive.f_simulator, drive.dt)

    @cached_property
    def jerk(self) -> tuple[Floats, Floats] | None:
        """See :func:`~.feel.jerk`; of car and simulator."""
        drive, below = self.trajectory, self.criteria.jerk_below
        car, cab = (jerk(force, drive.dt, below) for force in (drive.f_reference, drive.f_simulator))
        return None if car is None or cab is None else (car, cab)

    @cached_property
    def sickness(self) -> tuple[float, float]:
        """Share of people who become sick in car and simulator; see :func:`~.sickness.sickness_incidence`."""
        drive, exposure = self.trajectory, self.criteria.sickness_exposure
        roll, pitch = drive.hexapod[0, 3:5]
        # The cab may begin tilted; the car begins level.
        vertical = -GRAVITY * np.array(
            [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
        )
        cab = HeadMotion(drive.head_f_simulator, drive.w_simulator, tuple(vertical.tolist()))
        car = _sickness_of_car(
            drive.head_f_reference.tobytes(), drive.w_reference.tobytes(), drive.dt, exposure
        )
        return car, 0.01 * float(sickness_incidence([cab], drive.dt, exposure)[0])

    def to_car(self, pair: tuple[float, float]) -> float | None:
        """The ratio of the simulator's dose to the car's, of (car, simulator)."""
        return ratio(pair[1], pair[0], self.criteria.dose_least)

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


@lru_cache(maxsize=8)
def _sickness_of_car(force: bytes, rate: bytes, dt: float, exposure: float) -> float:
    """Share of people who become sick in the car; kept, as every policy drives the same cues."""
    car = HeadMotion(np.frombuffer(force).reshape(-1, 3), np.frombuffer(rate).reshape(-1, 3))
    return 0.01 * float(sickness_incidence([car], dt, exposure)[0])


@documented
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
        header="J", source=INDIFFERENCE, tables=(*EVERY_TABLE, "feel"),
    )  # fmt: skip
    perceived_cue_error: float = metric(
        lambda d: sum(axis.perceived_cue_error for axis in d.axis_metrics.values()),
        "J of the perceived cues, with the same indifference zone.",
        header="perceived J", source=INDIFFERENCE, tables=(*EVERY_TABLE, "feel"),
    )  # fmt: skip
    false_cues: float = metric(
        lambda d: float(np.any([axis.false for axis in d.axes.values()], axis=0).mean()),
        "Share of samples with a false cue on any axis.",
        header="false cues", display=PERCENT, source=GRANT, tables=EVERY_TABLE,
    )  # fmt: skip
    missing_cues: float = metric(
        lambda d: float(np.any([axis.missing for axis in d.axes.values()], axis=0).mean()),
        "Share of samples with a missing cue on any axis.",
        header="missing cues", display=PERCENT, source=GRANT, tables=("drive",),
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
        tables=("benchmark", "feel"),
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
    worst_second: float | None = metric(
        lambda d: d.worst_second[0],
        "Largest mean of the integrand of J over any one second.",
        header="worst second of J", source="People judge a drive by its worst moment (Kolff et al.).",
        tables=("feel",), default=None,
    )  # fmt: skip
    worst_second_time: float | None = metric(
        lambda d: d.worst_second[1],
        "Time from the start of the drive to the begin of that second.",
        "s", "worst second at", TIME, undefined, better="", tables=("feel",), default=None,
    )  # fmt: skip
    incongruence_max: float | None = metric(
        lambda d: float(d.incongruence.max()),
        "Maximum of P, the predicted continuous rating of incongruence: T dP/dt + P = 0.66 |Δf_y| + "
        "0.34 |Δf_x|, P = 0 at the start, T = 2 s. Uncalibrated: gain and cut-off of the study are not "
        "public.",
        "m/s²", "incongruence max", ACCELERATION,
        source="Kolff et al., IEEE T-ITS: this maximum correlates 0.94 with the rating of a maneuver, 0.69 "
        "with that of a drive.",
        tables=("feel",), default=None,
    )  # fmt: skip
    incongruence_mean: float | None = metric(
        lambda d: float(d.incongruence.mean()),
        "Mean of P, the predicted continuous rating of incongruence.",
        "m/s²", "incongruence mean", ACCELERATION, source="Kolff et al.", tables=("feel",), default=None,
    )  # fmt: skip
    cue_error_scaled: float | None = metric(
        lambda d: sum(axis.cue_error_scaled for axis in d.axis_metrics.values()),
        "The part of J that arises in samples with neither a false nor a missing cue on the axis: a cue of "
        "the right sign with the wrong size or at the wrong time, or too small a one to be noticed. The "
        "three parts sum to J.",
        header="J of scaled cues", source=CLEIJ, tables=("feel",), default=None,
    )  # fmt: skip
    cue_error_missing: float | None = metric(
        lambda d: sum(axis.cue_error_missing for axis in d.axis_metrics.values()),
        "The part of J that arises in samples with a missing cue on the axis.",
        header="J of missing cues", source=CLEIJ, tables=("feel",), default=None,
    )  # fmt: skip
    cue_error_false: float | None = metric(
        lambda d: sum(axis.cue_error_false for axis in d.axis_metrics.values()),
        "The part of J that arises in samples with a false cue on the axis.",
        header="J of false cues", source=CLEIJ, tables=("feel",), default=None,
    )  # fmt: skip
    tilt_rate_share_high: float | None = metric(
        lambda d: float(np.mean(d.tilt_rate > d.criteria.tilt_rate_high * (1.0 + FLAT))),
        "Share of samples with a tilt rate above 6 deg/s.",
        header="tilt rate above 6 deg/s", display=PERCENT,
        source="Nesti et al. (threshold of roll rate in active driving: 6.3 deg/s).",
        tables=("feel",), default=None,
    )  # fmt: skip
    ride_comfort: float | None = metric(
        lambda d: d.ride_comfort[1],
        "a_v of the simulator: √(Σ mean(a_w²)) over the axes of specific force, weighted by Wd (x, y) and "
        "Wk (z).",
        "m/s²", better="", source=ISO, default=None,
    )  # fmt: skip
    ride_comfort_ratio: float | None = metric(
        lambda d: d.to_car(d.ride_comfort),
        "`ride_comfort` over that of the car. Undefined where the car's is below 10⁻³.",
        header="comfort a_v to car", better="one", source=ISO, tables=("feel",), default=None,
    )  # fmt: skip
    motion_dose: float | None = metric(
        lambda d: d.motion_dose[1],
        "MSDV of the simulator: √(∫ Σ a_wf² dt) over the three axes of specific force, weighted by Wf.",
        "m/s^1.5", better="", source=f"{ISO} It defines the vertical dose; x and y are added by custom.",
        default=None,
    )  # fmt: skip
    motion_dose_ratio: float | None = metric(
        lambda d: d.to_car(d.motion_dose),
        "`motion_dose` over that of the car. Undefined where the car's is below 10⁻³.",
        header="sickness dose to car", better="one", source=ISO, tables=("feel",), default=None,
    )  # fmt: skip
    sickness_incidence: float | None = metric(
        lambda d: d.sickness[1],
        "Share of people who become sick in the simulator when the drive is repeated for 30 min: the 6-DOF "
        "subjective vertical conflict model, of people who see nothing. On request only.",
        header="sick after 30 min", display=PERCENT, better="", source=CONFLICT,
        tables=("feel",), costly=True, default=None,
    )  # fmt: skip
    sickness_incidence_of_car: float | None = metric(
        lambda d: d.sickness[0],
        "The same in the car. On request only.",
        better="", source=CONFLICT, costly=True, default=None,
    )  # fmt: skip
    sickness_incidence_ratio: float | None = metric(
        lambda d: d.to_car(d.sickness),
        "`sickness_incidence` over `sickness_incidence_of_car`. Undefined where the car's is "
        "below 0.1 %. On request only.",
        header="sick to car", better="one", source=CONFLICT,
        tables=("feel",), costly=True, default=None,
    )  # fmt: skip
    jerk_max: float | None = metric(
        lambda d: None if d.jerk is None else float(d.jerk[1].max()),
        "Largest |df/dt| of the simulator's specific force after a low-pass of 10 Hz (Butterworth, order 2, "
        "run both ways). Undefined in drives of less than 20 samples or sampled at less than 20 Hz.",
        "m/s³", "jerk max", JERK, max, better="", tables=("feel",), default=None,
    )  # fmt: skip
    jerk_rms: float | None = metric(
        lambda d: None if d.jerk is None else rms(d.jerk[1]),
        "√mean(|df/dt|²), with the same low-pass.",
        "m/s³", "jerk rms", JERK, better="", tables=("feel",), default=None,
    )  # fmt: skip
    jerk_ratio: float | None = metric(
        lambda d: None if d.jerk is None else ratio(rms(d.jerk[1]), rms(d.jerk[0]), d.criteria.dose_least),
        "`jerk_rms` over that of the car. Undefined where the car's is below 10⁻³.",
        header="jerk rms to car", better="one", tables=("feel",), default=None,
    )  # fmt: skip
    axes: dict[str, AxisMetrics] = metric(lambda d: d.axis_metrics, "The metrics of each axis.", better="")
    actuators: dict[str, ActuatorMetrics] = metric(
        lambda d: {name: measured(ActuatorMetrics, signals) for name, signals in d.actuators.items()},
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


_NESTED: Final = ("axes", "actuators", "travel")
"""Fields of :class:`Metrics` that hold more than one number."""
METRICS: Final[dict[str, Metric]] = {one.name: one for one in declared(Metrics) if one.name not in _NESTED}
"""The metrics of a drive that are one number, by name."""


def measure(trajectory: Trajectory, criteria: Criteria | None = None, costly: bool = False) -> Metrics:
    """All metrics of a trajectory.

    Args:
        trajectory: The drive.
        criteria: Thresholds.
        costly: Whether the metrics that are declared as costly are measured, too; else they are None.
    """
    return measured(Metrics, DriveSignals(trajectory, criteria or Criteria()), costly)


def over_drives(drives: Sequence[Metrics]) -> dict[str, float | None]:
    """One value of each of :data:`METRICS` for several drives; None where no drive has one."""
    combined: dict[str, float | None] = {}
    for name, one in METRICS.items():
        known = [value for drive in drives if (value := getattr(drive, name)) is not None]
        combined[name] = one.over_drives(known) if known else None
    return combined
