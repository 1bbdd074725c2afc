"""The thresholds every metric is measured against."""

from __future__ import annotations

from math import radians
from typing import Final

import numpy as np

from ..envs.cues import GRAVITY
from ..envs.platform.kernels import ACTUATORS, AXES
from ..envs.settings import Positive, Vector3, configuration
from ..envs.simulator.kernels.step import CueCost
from . import signals
from .trajectory import AT_ACCELERATION, AT_DISPLACEMENT, AT_VELOCITY, Floats, Trajectory

_ZONE = CueCost()


@configuration
class References:
    """The policies between which the share of the gap is measured; see ``share.py``.

    Args:
        baseline: The washout at its best, share 0.
        optimum: The lowest J there is, share 1.
        perceived_optimum: The lowest perceived J there is, share 1 of the perceived J.
    """

    baseline: str = "classical-tuned"
    optimum: str = "optimum"
    perceived_optimum: str = "optimum-perceived"


@configuration
class Criteria:
    """Published thresholds, and what J is compared with; every table of this project has the defaults.

    Args:
        indifference_force: Error of specific force no driver minds, m/s^2 (Slob et al., Bosch Rexroth).
        indifference_rate: Error of angular velocity no driver minds, rad/s (the same; 3 deg/s).
        force_threshold: Perception of specific force x, y, z, m/s^2 (Reid and Nahon, from memory).
        rate_threshold: Perception of angular velocity x, y, z, rad/s (Zacharias; Reid and Nahon;
            3.0, 3.6, 2.6 deg/s).
        tilt_rate: Rate up to which tilt coordination goes unnoticed, rad/s (3 deg/s, SIMONA).
        delay_range: Largest delay or lead searched, s; a cue that comes later is a missing cue instead.
        delay_correlation: Least correlation at which a delay is reported at all.
        action_tolerance: An applied acceleration this near the asked one is not clipped, m/s^2 and rad/s^2.
        vibration_above: Motion of a higher frequency is vibration, Hz.
        vibration_window: Length over which it is averaged, s (the running RMS of ISO 2631-1).
        references: Policies between which the share of the gap is measured.
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
    def scales(self) -> tuple[float, ...]:
        """Indifference zone of f x, y, z and w x, y, z."""
        return (self.indifference_force,) * 3 + (self.indifference_rate,) * 3

    @property
    def thresholds(self) -> tuple[float, ...]:
        """Perception thresholds of f x, y, z and w x, y, z."""
        return self.force_threshold + self.rate_threshold


# The metrics of a drive; docs/metrics.md defines each with its unit and source.


CUE_AXES: Final = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")
"""Specific force (m/s^2) and angular velocity (rad/s) in the cab's axes."""

_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""What a driver at rest on level ground feels on each of the axes."""


@configuration
class AxisMetrics:
    """Metrics of one axis; units of the axis (m/s^2 or rad/s) unless another is named.

    Args:
        rmse: Root mean square of felt minus wanted.
        nrmse: RMSE over the RMS of the car's motion, or over the perception threshold if that is larger.
        correlation: Pearson's; None where a signal is constant.
        delay: Of the simulator behind the car, s; None where there is no such peak of correlation.
        false_cues: Share of time with motion of the wrong sign, or noticeable where the car has none.
        missing_cues: Share of time without noticeable motion where the car has it.
        cue_error: This axis's part of J.
        cue_error_false: The part of ``cue_error`` that arises during false cues.
        cue_error_missing: The part of ``cue_error`` that arises during missing cues.
        perceived_rmse: RMSE of the sensed signals.
        perceived_nrmse: Normalized RMSE of the sensed signals.
        perceived_cue_error: This axis's part of the perceived J.
    """

    rmse: float
    nrmse: float
    correlation: float | None
    delay: float | None
    false_cues: float
    missing_cues: float
    cue_error: float
    cue_error_false: float
    cue_error_missing: float
    perceived_rmse: float
    perceived_nrmse: float
    perceived_cue_error: float


@configuration
class ActuatorMetrics:
    """Use of one actuator.

    Args:
        stroke: Largest distance from neutral, m or rad.
        stroke_share: The same as a share of the way to the limit; None without a limit or without travel.
        at_limit: Share of time at any limit.
    """

    stroke: float
    stroke_share: float | None
    at_limit: float


@configuration
class Metrics:
    """All metrics of one drive.

    Args:
        duration: Length of the drive, s.
        cue_error: J, the headline: squared error over the indifference zone, averaged; 0 is perfect.
        perceived_cue_error: J of the sensed signals.
        axes: By :data:`CUE_AXES`.
        false_cues: Share of time with a false cue on any axis.
        missing_cues: Share of time with a missing cue on any axis.
        tilt_rate_peak: Largest roll and pitch rate beyond the car's own, rad/s.
        tilt_rate_share: Share of time with such a rate above the tilt-coordination limit.
        actuators: By :data:`~.trajectory.ACTUATORS`.
        travel: Largest magnitude of each hexapod coordinate from neutral, m and rad.
        at_limit: Share of time with any actuator at any limit.
        at_displacement: Share of time with a displacement limit active.
        at_velocity: Share of time with a velocity limit active.
        at_acceleration: Share of time with an acceleration limit active.
        clipped: Share of steps whose applied acceleration differs from the asked one.
        step_time_mean: Mean time the policy takes a step, s; None where not measured.
        step_time_p99: 99th percentile of it, s.
        step_time_max: Longest of the drive, s.
        vibration: Of the specific force, beyond the car's own, in its worst second, m/s^2; None where the
            drive is too short or too coarse.
    """

    duration: float
    cue_error: float
    perceived_cue_error: float
    axes: dict[str, AxisMetrics]
    false_cues: float
    missing_cues: float
    tilt_rate_peak: float
    tilt_rate_share: float
    actuators: dict[str, ActuatorMetrics]
    travel: dict[str, float]
    at_limit: float
    at_displacement: float
    at_velocity: float
    at_acceleration: float
    clipped: float
    step_time_mean: float | None
    step_time_p99: float | None
    step_time_max: float | None = None
    vibration: float | None = None

    @property
    def worst_axis(self) -> str:
        """The axis with the largest part of J."""
        return max(self.axes, key=lambda axis: self.axes[axis].cue_error)


def measure(trajectory: Trajectory, criteria: Criteria | None = None) -> Metrics:
    """All metrics of a trajectory."""
    criteria = criteria or Criteria()
    reference, simulated = cab_motion(trajectory)
    axes = _axes(trajectory, criteria)
    false, missing = np.zeros(len(trajectory), bool), np.zeros(len(trajectory), bool)
    for i, threshold in enumerate(criteria.thresholds):
        false |= signals.false_cues(reference[:, i], simulated[:, i], threshold)
        missing |= signals.missing_cues(reference[:, i], simulated[:, i], threshold)
    rate = tilt_rate(trajectory)
    mean, p99, longest = _step_time(trajectory.step_time)
    flags = trajectory.limits_active
    return Metrics(
        duration=float(trajectory.time[-1] - trajectory.time[0]),
        cue_error=sum(axis.cue_error for axis in axes.values()),
        perceived_cue_error=sum(axis.perceived_cue_error for axis in axes.values()),
        axes=axes,
        false_cues=float(false.mean()),
        missing_cues=float(missing.mean()),
        tilt_rate_peak=float(rate.max()),
        tilt_rate_share=float(np.mean(rate > criteria.tilt_rate * (1.0 + signals.FLAT))),
        actuators=_actuators(trajectory),
        travel=dict(zip(AXES[2:8], np.abs(trajectory.hexapod).max(axis=0).tolist(), strict=True)),
        at_limit=float(np.any(flags, axis=1).mean()),
        at_displacement=float(np.any(flags & AT_DISPLACEMENT, axis=1).mean()),
        at_velocity=float(np.any(flags & AT_VELOCITY, axis=1).mean()),
        at_acceleration=float(np.any(flags & AT_ACCELERATION, axis=1).mean()),
        clipped=_clipped(trajectory, criteria.action_tolerance),
        step_time_mean=mean,
        step_time_p99=p99,
        step_time_max=longest,
        vibration=signals.vibration(
            reference[:, :3],
            simulated[:, :3],
            trajectory.dt,
            criteria.vibration_above,
            criteria.vibration_window,
        ),
    )


def cab_motion(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Wanted and felt motion at the cab point, (n, 6) by :data:`CUE_AXES`, zero at rest on level ground."""
    reference = np.column_stack([trajectory.f_reference, trajectory.w_reference]) - _REST
    simulated = np.column_stack([trajectory.f_simulator, trajectory.w_simulator]) - _REST
    return reference, simulated


def sensed_motion(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Sensed motion in car and simulator, (n, 6) by :data:`CUE_AXES`, zero at rest on level ground."""
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
    scales = np.array((criteria or Criteria()).scales)
    return np.asarray(np.sum(((simulated - reference) / scales) ** 2, axis=1))


def tilt_rate(trajectory: Trajectory) -> Floats:
    """(n,) magnitude of the cab's roll and pitch rate beyond the car's own, rad/s.

    Measured at the cab, where the driver sits, so that it holds for any policy. A cab that rolls with its
    car, or less, has none; a machine that stands still has none.
    """
    extra = signals.beyond(trajectory.w_reference[:, :2], trajectory.w_simulator[:, :2])
    return np.asarray(np.hypot(extra[:, 0], extra[:, 1]))


def _axes(trajectory: Trajectory, criteria: Criteria) -> dict[str, AxisMetrics]:
    motions = np.stack([*cab_motion(trajectory), *sensed_motion(trajectory)])
    return {axis: _axis(motions[:, :, i], trajectory.dt, criteria, i) for i, axis in enumerate(CUE_AXES)}


def _axis(motions: Floats, dt: float, criteria: Criteria, i: int) -> AxisMetrics:
    """Metrics of axis ``i`` from its (4, n) motions: wanted, felt, sensed wanted, sensed felt."""
    reference, simulated, sensed, perceived_simulator = motions
    threshold, scale = criteria.thresholds[i], criteria.scales[i]
    error = ((simulated - reference) / scale) ** 2
    false = signals.false_cues(reference, simulated, threshold)
    missing = signals.missing_cues(reference, simulated, threshold)
    # Below the threshold there is nothing whose delay a driver could feel.
    moves = min(np.abs(reference).max(), np.abs(simulated).max()) > threshold
    reach, least = criteria.delay_range, criteria.delay_correlation
    return AxisMetrics(
        rmse=signals.rms(simulated - reference),
        nrmse=signals.normalized_rmse(reference, simulated, threshold),
        correlation=signals.pearson(reference, simulated),
        delay=signals.delay(reference, simulated, dt, reach, least) if moves else None,
        false_cues=float(false.mean()),
        missing_cues=float(missing.mean()),
        cue_error=float(error.mean()),
        cue_error_false=float(np.mean(error * false)),
        cue_error_missing=float(np.mean(error * missing)),
        perceived_rmse=signals.rms(perceived_simulator - sensed),
        perceived_nrmse=signals.normalized_rmse(sensed, perceived_simulator, threshold),
        perceived_cue_error=float(np.mean(((perceived_simulator - sensed) / scale) ** 2)),
    )


def _actuators(trajectory: Trajectory) -> dict[str, ActuatorMetrics]:
    limits, positions = trajectory.limits, trajectory.positions
    active = np.mean(trajectory.limits_active != 0, axis=0)
    return {
        name: ActuatorMetrics(
            stroke=float(np.abs(positions[:, i]).max()),
            stroke_share=_stroke_share(positions[:, i], limits.position_min[i], limits.position_max[i]),
            at_limit=float(active[i]),
        )
        for i, name in enumerate(ACTUATORS)
    }


def _stroke_share(position: Floats, low: float, high: float) -> float | None:
    """Share of the way from neutral to the nearer-reached limit."""
    if not (np.isfinite(low) and np.isfinite(high) and low < 0.0 < high):
        return None
    return float(max(position.max() / high, position.min() / low, 0.0))


def _clipped(trajectory: Trajectory, tolerance: float) -> float:
    # Row 0 is the start: no action led to it.
    gap = np.abs(trajectory.applied[1:] - trajectory.action[1:])
    return float(np.mean(np.any(gap > tolerance, axis=1)))


def _step_time(step_time: Floats) -> tuple[float | None, float | None, float | None]:
    """Mean, 99th percentile and maximum."""
    measured = step_time[np.isfinite(step_time)]
    if not len(measured):
        return None, None, None
    return float(measured.mean()), float(np.percentile(measured, 99.0)), float(measured.max())
