r"""Identification of actuator dynamics: lag and dead time of each subsystem from a log of its motion.

The model is that of the simulator: a dead time tau, then omega^2 / (s^2 + 2 zeta omega s + omega^2). It is
fitted to the sensors by least squares, all channels of a subsystem at once, each with its own offset and gain
(variable projection: for given omega, zeta and tau these two follow). Three models of growing size are tried:
dead time alone, with a critically damped lag, with a damping of its own. The Bayesian information criterion
chooses. Confidence intervals are those of the linearized fit, widened by the residual's correlation in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import lfilter

from ..errors import DataError
from .machines import LONGEST_DEAD_TIME, SUBSYSTEMS, ActuatorDynamics
from .motion_log import Channel, MotionLog
from .parameters import lag_transition

Floats = NDArray[np.float64]

_WARM_UP: Final = 1.0
"""Beginning of a log that is not fitted, s: what moved the machine before is not known."""

_LATEST: Final = 0.8
"""Largest dead time that is looked for, s."""

_SLOWEST: Final = 0.5
"""Largest time constant 1 / omega that is looked for, s."""

_LARGEST_DAMPING: Final = 5.0

_LEAST_MOTION: Final = 1e-3
"""Standard deviation of a set-point below which a channel does not move, m and rad."""

_WIDEST: Final = (0.005, 0.15)
"""Widest half interval of a lateness: s, or relative."""

_MOST_RESIDUAL: Final = 0.3
"""Largest residual over the sensor's motion: beyond, it does not follow its set-point."""

_GAINS: Final = (0.8, 1.25)
"""Range of the gain of a sensor in the units of its set-point."""

_95: Final = 1.96
"""Standard deviations of half a 95 % interval."""


@dataclass(frozen=True)
class Estimate:
    """A value and half its 95 % interval."""

    value: float
    half: float

    @property
    def interval(self) -> tuple[float, float]:
        """Its ends."""
        return self.value - self.half, self.value + self.half


@dataclass(frozen=True)
class Identified:
    """Lag and dead time of one subsystem.

    Args:
        subsystem: Carriage, hexapod or turntable.
        natural_frequency: omega, rad/s; None where no lag is seen.
        damping: zeta; 1 with no interval where no other is needed.
        dead_time: s.
        lateness: Delay of slow motion, dead time + 2 zeta / omega, s.
        gains: Of each channel's sensor, 1 for one that moves as far as its set-point.
        residual: Root mean square of what the model leaves of each channel, m or rad.
        share: The same over the motion of each channel.
    """

    subsystem: str
    natural_frequency: Estimate | None
    damping: Estimate
    dead_time: Estimate
    lateness: Estimate
    gains: dict[str, float]
    residual: dict[str, float]
    share: dict[str, float]

    @property
    def dynamics(self) -> ActuatorDynamics:
        """As a platform's fields."""
        return ActuatorDynamics(
            natural_frequency=None if self.natural_frequency is None else self.natural_frequency.value,
            damping=self.damping.value,
            dead_time=float(np.clip(self.dead_time.value, 0.0, LONGEST_DEAD_TIME)),
        )


def identify(log: MotionLog, subsystems: Sequence[str] = SUBSYSTEMS) -> list[Identified]:
    """Lag and dead time of the subsystems of a log.

    The lateness, their sum, shows in slow motion; how much of it is dead time only by motion that is fast
    for the machine, and the interval of the dead time says how well.

    Args:
        log: Of set-points and sensors.
        subsystems: Those to identify, where the log has channels of them.

    Raises:
        DataError: the log does not tell them: a subsystem hardly moves or does not follow, a sensor has
            another unit or clock, or an interval is too wide.
    """
    found = []
    for name in subsystems:
        channels = [one for one in log.channels if one.subsystem == name]
        if channels:
            found.append(_identified(name, channels, log.step))
    if not found:
        raise DataError(f"the log has no set-points and sensors of {' or '.join(subsystems)}")
    return found


class _Fit:
    """The model of one subsystem's channels, by parameters (dead time, 1 / omega, zeta)."""

    def __init__(self, channels: Sequence[Channel], step: float) -> None:
        self._step, self._time = step, step * np.arange(len(channels[0].setpoint))
        self._splines = [CubicSpline(self._time, one.setpoint - one.setpoint[0]) for one in channels]
        self._after = round(_WARM_UP / step)
        self._sensors = [one.sensor[self._after :] for one in channels]
        self.scales = [float(np.std(one)) for one in self._sensors]

    def _delayed(self, spline: Any, dead_time: float) -> tuple[Floats, Floats]:
        """Set-point and its rate, a dead time later; at rest before the log."""
        at = np.clip(self._time - dead_time, 0.0, self._time[-1])
        return np.asarray(spline(at)), np.asarray(spline(at, 1))

    def motion(self, which: int, parameters: Floats) -> Floats:
        """What the model gives for a channel, after the warm-up."""
        dead_time, lag, damping = parameters
        place, rate = self._delayed(self._splines[which], dead_time)
        if lag > 0.05 * self._step:
            dynamics = ActuatorDynamics(natural_frequency=1.0 / lag, damping=damping)
            place = _lagged(lag_transition(dynamics, self._step), place, rate, self._step)
        return place[self._after :]

    def projected(self, which: int, parameters: Floats) -> tuple[Floats, float]:
        """Residual of a channel with its best offset and gain, and the gain."""
        model, sensor = self.motion(which, parameters), self._sensors[which]
        centered, seen = model - model.mean(), sensor - sensor.mean()
        gain = float(centered @ seen / max(centered @ centered, 1e-30))
        return seen - gain * centered, gain

    def residuals(self, parameters: Floats) -> Floats:
        """Of all channels over their scales."""
        parts = [self.projected(k, parameters)[0] / scale for k, scale in enumerate(self.scales)]
        return np.concatenate(parts)


def _lagged(transition: Floats, place: Floats, rate: Floats, step: float) -> Floats:
    """The lag's motion for a set-point at rest before, exact for constant acceleration within a step."""
    acceleration = np.append(np.diff(rate) / step, 0.0)
    driven = transition[:, 2:] @ np.stack([place, rate, acceleration])
    (a, b), (c, d) = transition[:, :2]
    # Both states' recursion as one of the second order: y[k+2] - (a + d) y[k+1] + (a d - b c) y[k].
    forcing = np.zeros(len(place))
    forcing[1:] = driven[0, :-1]
    forcing[2:] += b * driven[1, :-2] - d * driven[0, :-2]
    return np.asarray(lfilter([1.0], [1.0, -(a + d), a * d - b * c], forcing))


_MODELS: Final = ((0,), (0, 1), (0, 1, 2))
"""Parameters that are free in each model: dead time; with 1 / omega; with zeta."""

_LOWEST: Final = np.array([-0.2, 1e-4, 1.0])
_HIGHEST: Final = np.array([_LATEST, _SLOWEST, _LARGEST_DAMPING])


def _identified(name: str, channels: Sequence[Channel], step: float) -> Identified:
    for one in channels:
        if np.std(one.setpoint) < _LEAST_MOTION:
            raise DataError(
                f"{one.name} hardly moves: its set-point deviates by {np.std(one.setpoint):.2g} from its "
                "mean; give a log in which it is driven over some centimeters or degrees, or leave it out"
            )
        if np.std(one.sensor) < 1e-2 * np.std(one.setpoint):
            raise DataError(
                f"the sensor of {one.name} moves by {np.std(one.sensor):.2g} where its set-point moves by "
                f"{np.std(one.setpoint):.2g}; give its unit by {one.name}_sensor=COLUMN:UNIT, or leave it out"
            )
    fit = _Fit(channels, step)
    best = _searched(fit, step)
    _check_following(fit, channels, best)
    # A second pass weighs channels by what the first left.
    fit.scales = [max(float(np.std(fit.projected(k, best)[0])), 1e-12) for k in range(len(channels))]
    solved = [_solved(fit, best, free) for free in _MODELS]
    width = _correlated(fit, solved[1], len(channels))
    costs = [_criterion(fit.residuals(p), len(free), width) for p, free in zip(solved, _MODELS, strict=True)]
    chosen = int(np.argmin(costs))
    parameters, free = solved[chosen], _MODELS[chosen]
    covariance = _covariance(fit, parameters, free, width)
    _check_clock(name, fit, channels, parameters, covariance, step)
    return _estimates(name, fit, channels, parameters, free, covariance)


def _searched(fit: _Fit, step: float) -> Floats:
    """Parameters near the best, over a grid of dead times and lags."""
    lags = np.array([1e-4, 0.01, 0.02, 0.04, 0.08, 0.16])
    dead_times = np.arange(_LOWEST[0], 0.61, 0.04)
    starts = [np.array([tau, lag, 1.0]) for lag in lags for tau in dead_times]
    costs = [float(np.sum(fit.residuals(start) ** 2)) for start in starts]
    return _solved(fit, starts[int(np.argmin(costs))], _MODELS[1])


def _solved(fit: _Fit, start: Floats, free: Sequence[int]) -> Floats:
    """Least squares over some parameters; a model without lag has none, one without damping 1."""
    chosen = list(free)
    begin = start.copy()
    if 1 not in chosen:
        begin[:2] = begin[0] + 2.0 * begin[1], 0.0
    low, high = _LOWEST[chosen], _HIGHEST[chosen]
    if 1 in chosen:
        # Less than no dead time is another clock, which a lag must not hide.
        low[0] = 0.0
    inside = np.clip(begin[chosen], low + 1e-6, high - 1e-6)

    def residuals(values: Floats) -> Floats:
        return fit.residuals(_with(begin, chosen, values))

    solution = least_squares(
        residuals, inside, bounds=(low, high), x_scale=np.array([0.01, 0.01, 0.3])[chosen]
    )
    return _with(begin, chosen, solution.x)


def _with(parameters: Floats, chosen: Sequence[int], values: Floats) -> Floats:
    whole = parameters.copy()
    whole[list(chosen)] = values
    return whole


def _correlated(fit: _Fit, parameters: Floats, channels: int) -> float:
    """Samples that count as one, by the residual's correlation in time."""
    widths = []
    for k in range(channels):
        residual = fit.projected(k, parameters)[0]
        power = float(residual @ residual)
        total, longest = 1.0, min(len(residual) // 4, 500)
        for shift in range(1, longest):
            correlation = float(residual[:-shift] @ residual[shift:]) / power
            if correlation < 0.05:
                break
            total += 2.0 * correlation
        widths.append(total)
    return max(widths)


def _criterion(residuals: Floats, parameters: int, width: float) -> float:
    """Bayesian information criterion of as many independent samples as there are."""
    n = len(residuals) / width
    return n * float(np.log(np.mean(residuals**2))) + parameters * float(np.log(n))


def _covariance(fit: _Fit, parameters: Floats, free: Sequence[int], width: float) -> Floats:
    """(3, 3) of the parameters, 0 for those that are not free."""
    steps = np.array([1e-4, 1e-4, 1e-2])
    slopes = []
    for k in free:
        change = np.zeros(3)
        change[k] = steps[k] if parameters[k] + steps[k] < _HIGHEST[k] else -steps[k]
        slopes.append((fit.residuals(parameters + change) - fit.residuals(parameters)) / change[k])
    residuals, jacobian = fit.residuals(parameters), np.stack(slopes, axis=1)
    variance = float(residuals @ residuals) / max(len(residuals) - len(free), 1)
    covariance = np.zeros((3, 3))
    covariance[np.ix_(free, free)] = width * variance * np.linalg.pinv(jacobian.T @ jacobian)
    return covariance


def _check_following(fit: _Fit, channels: Sequence[Channel], parameters: Floats) -> None:
    for k, one in enumerate(channels):
        residual, gain = fit.projected(k, parameters)
        share = float(np.std(residual) / np.std(one.sensor))
        if share > _MOST_RESIDUAL:
            raise DataError(
                f"the sensor of {one.name} does not follow its set-point: {100.0 * share:.0f} % of its "
                "motion is left by every lag and dead time; check that both are of one actuator and clock"
            )
        if not _GAINS[0] <= gain <= _GAINS[1]:
            raise DataError(
                f"the sensor of {one.name} moves {gain:.3g} times as far as its set-point; give the units of "
                f"both, as in {one.name}_sensor=COLUMN:{'deg' if 50.0 < abs(gain) < 65.0 else 'mm'}"
            )


def _check_clock(
    name: str, fit: _Fit, channels: Sequence[Channel], parameters: Floats, covariance: Floats, step: float
) -> None:
    half = _95 * float(np.sqrt(covariance[0, 0]))
    if parameters[0] < -0.5 * step:
        raise DataError(
            f"the {name} moves {-1e3 * parameters[0]:.0f} ms before its set-point: set-points and sensors "
            "have different clocks, or their columns are exchanged"
        )
    n = len(channels[0].setpoint) // 2
    if n * step < 0.5 * _WARM_UP + 4.0:
        return
    pieces = [slice(0, n), slice(n, None)]
    halves = [_late_by(channels, piece, parameters, step) for piece in pieces]
    apart = halves[1] - halves[0]
    if abs(apart) > max(4.0 * half, step, 0.004):
        raise DataError(
            f"the dead time of the {name} goes from {1e3 * halves[0]:.0f} ms in the first half of the log to "
            f"{1e3 * halves[1]:.0f} ms in the second: the clocks of set-points and sensors drift apart"
        )


def _late_by(channels: Sequence[Channel], piece: slice, parameters: Floats, step: float) -> float:
    """Dead time in a piece of a log, with the lag of all of it."""
    fit = _Fit([Channel(one.name, one.setpoint[piece], one.sensor[piece]) for one in channels], step)

    def residuals(values: Floats) -> Floats:
        return fit.residuals(_with(parameters, [0], values))

    return float(least_squares(residuals, parameters[:1], x_scale=0.01).x[0])


def _estimates(
    name: str,
    fit: _Fit,
    channels: Sequence[Channel],
    parameters: Floats,
    free: Sequence[int],
    covariance: Floats,
) -> Identified:
    dead_time, lag, damping = (float(value) for value in parameters)
    halves = _95 * np.sqrt(np.diag(covariance))
    along = np.array([1.0, 2.0 * damping, 2.0 * lag])
    late = Estimate(dead_time + 2.0 * damping * lag, _95 * float(np.sqrt(along @ covariance @ along)))
    if late.half > max(_WIDEST[0], _WIDEST[1] * late.value):
        raise DataError(
            f"the log does not tell how late the {name} is: {1e3 * late.value:.0f} ± {1e3 * late.half:.0f} "
            "ms; move it further, faster or for longer"
        )
    lagging = 1 in free
    fitted = {one.name: fit.projected(k, parameters) for k, one in enumerate(channels)}
    residual = {label: float(np.std(left)) for label, (left, _) in fitted.items()}
    return Identified(
        subsystem=name,
        natural_frequency=Estimate(1.0 / lag, float(halves[1]) / lag**2) if lagging else None,
        damping=Estimate(damping, float(halves[2])),
        dead_time=Estimate(dead_time, float(halves[0])),
        lateness=late,
        gains={label: gain for label, (_, gain) in fitted.items()},
        residual=residual,
        share={one.name: residual[one.name] / float(np.std(one.sensor)) for one in channels},
    )
