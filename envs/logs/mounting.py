"""Mounting of a device in a car: its attitude and reversed axes, estimated from the drive itself.

Gravity gives roll and pitch. Horizontally the car's own motion is known twice: dv/dt along x and v r along
y. The turn (and, for left-handed axes, the reflection) that fits the measured force to both gives yaw and
the sense of y. The course gives the sense of r.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_erosion
from scipy.spatial.transform import Rotation

from ..cues import Floats
from ..errors import DataError
from .signals import ImportOptions, Sign, low_pass
from .units import FORCES


class YawUnknownError(DataError):
    """A record that does not show how the device is turned in the car."""


@dataclass(frozen=True)
class Mounting:
    """Attitude of a device in the car, and the signs of its axes.

    With R = Rz(yaw) Ry(pitch) Rx(roll), which turns device axes into car axes, and
    S = diag(1, lateral_sign, 1):

        f_car = S R f_device                  (f: specific force)
        w_car = rate_sign S R w_device        (w: angular velocity)

    Attributes:
        roll: Right side down positive, rad.
        pitch: Nose up positive, rad.
        yaw: To the right positive, rad.
        lateral_sign: -1 if the force axes are left-handed.
        rate_sign: -1 if the rates count the other way round than the right-hand rule
            about the force axes says.
    """

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    lateral_sign: int = 1
    rate_sign: int = 1

    @property
    def matrix(self) -> Floats:
        """(3, 3) S R, from device axes to car axes."""
        rotation = Rotation.from_euler("ZYX", [self.yaw, self.pitch, self.roll]).as_matrix()
        return np.asarray(np.diag([1.0, self.lateral_sign, 1.0]) @ rotation)

    def force_in_car(self, force: ArrayLike) -> Floats:
        """Specific force (..., 3) from device axes to car axes."""
        return np.asarray(np.asarray(force) @ self.matrix.T)

    def rate_in_car(self, rate: ArrayLike) -> Floats:
        """Angular velocity (..., 3) from device axes to car axes."""
        return np.asarray(self.rate_sign * (np.asarray(rate) @ self.matrix.T))


def level(rest: ArrayLike) -> tuple[float, float]:
    """Roll and pitch, rad, of a device that measures the specific force ``rest`` (3,) in a level car at rest.

    From rest = R^T [0, 0, -g].
    """
    x, y, z = np.asarray(rest, dtype=np.float64)
    return float(np.arctan2(-y, -z)), float(np.arctan2(x, np.hypot(y, z)))


SMOOTHING_HZ: Final = 0.5
"""Cut-off for everything that is estimated: below it, the car moves as a point with its speed and course."""

STILL_EDGE_S: Final = 1.0
"""Cut from both ends of a standstill, where the body still rocks, s."""

LONGEST_DELAY_S: Final = 2.0
"""Delay of a speed (satellite receivers average) searched for, s."""

_DELAY_STEP_S: Final = 0.02
_LEAST_SPEED_RATE: Final = 0.25
"""Standard deviation of dv/dt below which it is noise, and shows no delay, m/s^2."""

_UNMISTAKABLE: Final = 0.5
"""Standard deviation of dv/dt from which the force has to follow it, m/s^2."""

_LEAST_COURSE_RATE: Final = 0.02
"""The same of the rate of the course, rad/s."""

_CONSTANT: Final = 1e-6
"""A force that varies by less is a constant, m/s^2."""

_WEAK_FIT: Final = 0.1
"""Share of the variance of dv/dt that the force must explain before a delay is believed."""


@dataclass(frozen=True)
class Evidence:
    """Signals below :data:`SMOOTHING_HZ`, device axes, SI units.

    Attributes:
        dt: Time step, s.
        force: (n, 3) specific force.
        rate: (n, 3) angular velocity.
        speed: (n,) or None.
        course: (n,) unwrapped heading over ground, clockwise positive, or None.
        still: (n,) true where the car stands.
    """

    dt: float
    force: Floats
    rate: Floats
    speed: Floats | None
    course: Floats | None
    still: NDArray[np.bool_]

    @property
    def speed_rate(self) -> Floats:
        """dv/dt (n,), zero where there is no speed."""
        if self.speed is None:
            return np.zeros(len(self.force))
        return np.asarray(np.gradient(self.speed, self.dt))

    def delayed(self, delay: float) -> Evidence:
        """The evidence with speed and course moved ``delay`` seconds earlier, up to their last values."""
        whole = self._moved(delay)
        # At the end, nothing is known of the speed; half of the drive is kept in any case.
        kept = max(len(self.force) - round(max(delay, 0.0) / self.dt), len(self.force) // 2)
        return replace(
            whole,
            force=whole.force[:kept],
            rate=whole.rate[:kept],
            speed=None if whole.speed is None else whole.speed[:kept],
            course=None if whole.course is None else whole.course[:kept],
            still=whole.still[:kept],
        )

    def _moved(self, delay: float) -> Evidence:
        still = shift(self.still.astype(np.float64), delay, self.dt) > 0.5
        speed = None if self.speed is None else shift(self.speed, delay, self.dt)
        course = None if self.course is None else shift(self.course, delay, self.dt)
        return replace(self, speed=speed, course=course, still=still)


def gather(
    rate_hz: float,
    force: Floats,
    rate: Floats,
    speed: Floats | None,
    course: Floats | None,
    standstill: float,
) -> Evidence:
    """Smooth the signals of a log and find where the car stands (slower than ``standstill``, m/s)."""

    def smooth(values: Floats) -> Floats:
        return low_pass(values, rate_hz, SMOOTHING_HZ)

    if speed is None:
        still = np.zeros(len(force), dtype=np.bool_)
    else:
        window = np.ones(2 * int(STILL_EDGE_S * rate_hz) + 1, dtype=np.bool_)
        still = binary_erosion(speed < standstill, window, border_value=1)
    return Evidence(
        dt=1.0 / rate_hz,
        force=smooth(force),
        rate=smooth(rate),
        speed=None if speed is None else smooth(speed),
        course=None if course is None else smooth(course),
        still=still,
    )


def shift(values: Floats, delay: float, dt: float) -> Floats:
    """Values (n,) ``delay`` seconds earlier, the last one held."""
    time = dt * np.arange(len(values))
    return np.asarray(np.interp(time + delay, time, values))


def speed_delay(evidence: Evidence) -> float:
    """How long speed and course lag behind force and rates, s.

    The forward axis is not known yet, so dv/dt is regressed on all three axes of the force. At constant
    speed, the rate of the course is regressed on all three axes of the rates. A signal that hardly varies
    shows no delay. The course is the second choice: it leads the heading by the slip of the rear axle.
    """
    if evidence.speed is not None and evidence.speed_rate.std() >= _LEAST_SPEED_RATE:
        return _best_delay(evidence.force, evidence.speed_rate, evidence.dt)
    if evidence.course is not None:
        turning = np.gradient(evidence.course, evidence.dt)
        if turning.std() >= _LEAST_COURSE_RATE:
            return _best_delay(evidence.rate, turning, evidence.dt)
    return 0.0


def _best_delay(axes: Floats, target: Floats, dt: float) -> float:
    """The delay at which the axes (n, 3) explain most of the variance of the target (n,), s."""
    delays = np.arange(0.0, LONGEST_DELAY_S + _DELAY_STEP_S / 2, _DELAY_STEP_S)
    # The same rows for each delay, and none for which the target is not known.
    kept = max(len(axes) - round(LONGEST_DELAY_S / dt), len(axes) // 2)
    basis = np.linalg.qr(np.column_stack([axes[:kept], np.ones(kept)]))[0]
    fits = [_explained(basis, shift(target, delay, dt)[:kept]) for delay in delays]
    best = int(np.argmax(fits))
    return float(delays[best]) if fits[best] > _WEAK_FIT else 0.0


def _explained(basis: Floats, target: Floats) -> float:
    centered = target - target.mean()
    total = float(centered @ centered)
    return float(np.sum((basis.T @ centered) ** 2)) / total if total > 0.0 else 0.0


def correlation(a: Floats, b: Floats) -> float:
    """Pearson's correlation, 0 where a signal does not vary."""
    a, b = a - a.mean(), b - b.mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale > 0.0 else 0.0


CLEAR: Final = 0.3
"""A correlation below this one decides nothing."""

_STILL_S: Final = 2.0
"""Standstill needed before it counts, after its edges are cut, s."""

Origin = Literal["given", "standstill", "average", "course", "not estimated"]


@dataclass(frozen=True)
class Estimate:
    """What the log says about the device.

    Attributes:
        mounting: Attitude and signs.
        rest: (3,) specific force at rest, device axes, m/s^2.
        rest_from: How ``rest`` was found.
        rate_bias: (3,) rad/s, car axes.
        bias_from: How the biases of roll and pitch rate, and of yaw rate, were found.
        force_speed: Correlation of f_x with dv/dt.
        force_turn: Correlation of f_y with v r.
        rate_course: Correlation of the integrated yaw rate with the course, or None.
        notes: What the record could not tell.
    """

    mounting: Mounting
    rest: Floats
    rest_from: Origin
    rate_bias: Floats
    bias_from: tuple[Origin, Origin]
    force_speed: float
    force_turn: float
    rate_course: float | None
    notes: tuple[str, ...]


def estimate(evidence: Evidence, options: ImportOptions) -> Estimate:
    """Mounting and biases, each as given in ``options`` or else from the record.

    Raises:
        YawUnknownError: the yaw of the mounting is not given and the record does not show it.
        DataError: a horizontal force is missing, which would show it.
    """
    rest, rest_from = rest_force(evidence)
    roll, pitch = (
        found if given is None else math.radians(given)
        for given, found in zip((options.roll_deg, options.pitch_deg), level(rest), strict=True)
    )
    leveled = Mounting(roll, pitch)
    _check_constants(evidence, rest, options)
    rate_sign, rate_course = _rate_sign(evidence, leveled, options.rate_sign)
    yaw, lateral_sign = _heading(evidence, leveled, rate_sign, options)
    mounting = Mounting(roll, pitch, yaw, lateral_sign, rate_sign)
    straight = options.rate_sign == "estimate" and rate_course is not None and abs(rate_course) < CLEAR
    if straight and _squat(evidence, mounting) < -CLEAR:
        mounting = replace(mounting, rate_sign=-rate_sign)
    bias, bias_from = _rate_bias(evidence, mounting, options)
    force_speed, force_turn = _agreement(evidence, mounting)
    if options.yaw_deg is None and max(force_speed, force_turn) < CLEAR:
        raise YawUnknownError(
            f"yaw_deg: the record does not show how the device is turned in the car (f_x with dv/dt "
            f"{force_speed:.2f}, f_y with v r {force_turn:.2f}); give yaw_deg, or name a column for speed"
        )
    return Estimate(
        mounting=mounting,
        rest=rest,
        rest_from=rest_from,
        rate_bias=bias,
        bias_from=bias_from,
        force_speed=force_speed,
        force_turn=force_turn,
        rate_course=rate_course,
        notes=_notes(mounting, rate_course, (force_speed, force_turn), evidence, options),
    )


def _check_constants(evidence: Evidence, rest: Floats, options: ImportOptions) -> None:
    """Refuse to estimate the yaw of the mounting from a horizontal force that is missing."""
    if options.yaw_deg is not None:
        return
    turning = turn(evidence, evidence.rate @ (-rest / np.linalg.norm(rest)))
    excited = min(evidence.speed_rate.std(), turning.std()) >= _LEAST_SPEED_RATE
    for name, values, part in zip(FORCES, evidence.force.T, rest / np.linalg.norm(rest), strict=True):
        if excited and np.ptp(values) < _CONSTANT and abs(part) < math.sqrt(0.5):
            raise DataError(
                f"{name} is constant in a drive that speeds up and turns: it does not show how the device is "
                "turned in the car; name its column, or give yaw_deg"
            )


_SLOPE: Final = math.radians(0.5)
_LEAST_MOVING_S: Final = 20.0
"""A car stands on a slope at a larger angle to the mean of a drive of at least this length, s.

On level roads both agree to 0.2 deg. A road's slopes are nearer to level in the mean than at one place.
"""


def rest_force(evidence: Evidence) -> tuple[Floats, Origin]:
    """Specific force without the car's own acceleration: at rest, or as the constant of a regression.

    A standstill on a slope shows the length of gravity, but not its direction in a level car.
    """
    standing = evidence.still.sum() * evidence.dt >= _STILL_S
    if not standing:
        return _mean_force(evidence), "average"
    rest = evidence.force[evidence.still].mean(axis=0)
    if (~evidence.still).sum() * evidence.dt < _LEAST_MOVING_S or weightless(evidence.force):
        return rest, "standstill"
    mean = _mean_force(evidence)
    size = float(np.linalg.norm(rest))
    cosine = float(rest @ mean) / (size * float(np.linalg.norm(mean)))
    if cosine > math.cos(_SLOPE):
        return rest, "standstill"
    return mean * (size / float(np.linalg.norm(mean))), "average"


def _mean_force(evidence: Evidence) -> Floats:
    """Constant of a regression of the force (3,) on the car's acceleration."""
    mean = evidence.force.mean(axis=0)
    if weightless(evidence.force):
        return np.asarray(mean)
    up = mean / np.linalg.norm(mean)
    turning = turn(evidence, -evidence.rate @ up)
    plain = np.column_stack([np.ones(len(turning)), evidence.speed_rate, turning])
    # A car that leans by an angle in proportion to v r has a vertical force that varies with its square. The
    # horizontal force is the same to either side, so that its square would only explain what is noise.
    leaning = np.column_stack([plain, turning**2])
    flat, upright = (np.linalg.lstsq(part, evidence.force, rcond=None)[0][0] for part in (plain, leaning))
    return np.asarray(flat + ((upright - flat) @ up) * up)


def weightless(force: Floats) -> bool:
    """Whether a force (n, 3) lacks gravity, in any unit: its mean is then small beside its size."""
    return bool(np.linalg.norm(force.mean(axis=0)) < 0.7 * np.linalg.norm(force, axis=1).mean())


def turn(evidence: Evidence, yaw_rate: Floats) -> Floats:
    """The product v r (n,), without the bias of r as far as the record shows it."""
    if evidence.speed is None:
        return np.zeros(len(yaw_rate))
    return np.asarray(evidence.speed * (yaw_rate - yaw_bias(evidence, yaw_rate)))


def yaw_bias(evidence: Evidence, yaw_rate: Floats) -> float:
    """Bias of a yaw rate (n,) of unknown sense: at standstill, or as its drift against the course.

    The mean is no bias: a drive may turn more one way than the other.
    """
    if evidence.still.sum() * evidence.dt >= _STILL_S:
        return float(yaw_rate[evidence.still].mean())
    if evidence.course is None:
        return 0.0
    heading = np.cumsum(yaw_rate) * evidence.dt
    time = evidence.dt * np.arange(len(heading))
    alike = correlation(detrended(heading), detrended(evidence.course))
    # A course that is close to a straight line does not show the sense; the smaller bias is likelier.
    senses = (1.0, -1.0) if abs(alike) < CLEAR else (float(np.sign(alike)),)
    biases = [float(np.polyfit(time, heading - sense * evidence.course, 1)[0]) for sense in senses]
    return min(biases, key=abs)


def _rate_sign(evidence: Evidence, leveled: Mounting, choice: Sign) -> tuple[int, float | None]:
    """Sense of the yaw rate: its integral has to follow the course over ground."""
    if evidence.course is None:
        return _chosen(choice, 1), None
    heading = np.cumsum(leveled.rate_in_car(evidence.rate)[:, 2]) * evidence.dt
    found = correlation(detrended(heading), detrended(evidence.course))
    sign = _chosen(choice, -1 if found < -CLEAR else 1)
    return sign, sign * found


def detrended(values: Floats) -> Floats:
    """Values (n,) without their straight line."""
    # A straight line is what the bias of a rate leaves in its integral.
    time = np.linspace(-1.0, 1.0, len(values))
    slope, offset = np.polyfit(time, values, 1)
    return np.asarray(values - slope * time - offset)


def _heading(
    evidence: Evidence, leveled: Mounting, rate_sign: int, options: ImportOptions
) -> tuple[float, int]:
    """Yaw of the mounting, rad, and the sense of its lateral axis.

    For each sense, the turn psi that maximizes
    sum dv/dt f_x + v r f_y, with f_x + i f_y the leveled force turned by psi.
    """
    force = leveled.force_in_car(evidence.force)[:, :2]
    x, y = (force - force.mean(axis=0)).T
    along = evidence.speed_rate - evidence.speed_rate.mean()
    across = turn(evidence, rate_sign * leveled.rate_in_car(evidence.rate)[:, 2])
    across = across - across.mean()

    def fit(sign: int) -> tuple[float, float]:
        cosine = along @ x + sign * (across @ y)
        sine = sign * (across @ x) - along @ y
        if options.yaw_deg is None:
            return float(np.hypot(cosine, sine)), float(np.arctan2(sine, cosine))
        yaw = math.radians(options.yaw_deg)
        return float(np.cos(yaw) * cosine + np.sin(yaw) * sine), yaw

    trials = {sign: Mounting(leveled.roll, leveled.pitch, fit(sign)[1], sign, rate_sign) for sign in (1, -1)}
    mirrored = options.lateral_sign == "flip"
    if options.lateral_sign == "estimate":
        best = max(trials, key=lambda sign: fit(sign)[0])
        # A reflection shows only where both axes are excited. Otherwise the lean of the body decides.
        if min(_agreement(evidence, trials[best])) >= CLEAR:
            mirrored = best == -1
        elif evidence.course is not None:
            mirrored = _lean(evidence, trials[1]) < -CLEAR and _lean(evidence, trials[-1]) > CLEAR
    sign = -1 if mirrored else 1
    return fit(sign)[1], sign


def _lean(evidence: Evidence, mounting: Mounting) -> float:
    """Correlation of the roll rate with that of a body which leans out of its turns, in proportion to f_y."""
    lateral = mounting.force_in_car(evidence.force)[:, 1]
    roll_rate = mounting.rate_in_car(evidence.rate)[:, 0]
    return correlation(roll_rate, -np.gradient(lateral, evidence.dt))


def _squat(evidence: Evidence, mounting: Mounting) -> float:
    """Correlation of the pitch rate with the rate of f_x.

    A body that rises at its nose feels more force forward, uphill by gravity and under power by its squat.
    """
    along = mounting.force_in_car(evidence.force)[:, 0]
    return correlation(mounting.rate_in_car(evidence.rate)[:, 1], np.gradient(along, evidence.dt))


def _agreement(evidence: Evidence, mounting: Mounting) -> tuple[float, float]:
    """Correlations of f_x with dv/dt, and of f_y with v r."""
    force = mounting.force_in_car(evidence.force)
    turning = turn(evidence, mounting.rate_in_car(evidence.rate)[:, 2])
    return correlation(force[:, 0], evidence.speed_rate), correlation(force[:, 1], turning)


def _rate_bias(
    evidence: Evidence, mounting: Mounting, options: ImportOptions
) -> tuple[Floats, tuple[Origin, Origin]]:
    """Bias of the rates, rad/s, car axes: at standstill, or so that the car ends as it began.

    Roll and pitch come back to where they were on any road, yaw does not: without a
    standstill its bias needs the course.
    """
    if options.rate_bias_deg_s is not None:
        return np.radians(options.rate_bias_deg_s), ("given", "given")
    rate = mounting.rate_in_car(evidence.rate)
    if evidence.still.sum() * evidence.dt >= _STILL_S:
        return rate[evidence.still].mean(axis=0), ("standstill", "standstill")
    turning = turn(evidence, rate[:, 2])
    leaning = turning * (rate[:, 2] - yaw_bias(evidence, rate[:, 2]))
    # A car that leans in a turn has a pitch rate of r sin(roll), whose mean is no bias.
    regressors = np.column_stack([np.ones(len(rate)), leaning])
    pitch_bias = np.linalg.lstsq(regressors, rate[:, 1], rcond=None)[0][0]
    bias = np.array([rate[:, 0].mean(), pitch_bias, rate[:, 2].mean()])
    if evidence.course is None:
        return np.array([bias[0], bias[1], 0.0]), ("average", "not estimated")
    drift = np.cumsum(rate[:, 2]) * evidence.dt - evidence.course
    bias[2] = np.polyfit(evidence.dt * np.arange(len(drift)), drift, 1)[0]
    return bias, ("average", "course")


def _notes(
    mounting: Mounting,
    rate_course: float | None,
    agreement: tuple[float, float],
    evidence: Evidence,
    options: ImportOptions,
) -> tuple[str, ...]:
    notes = []
    if agreement[0] < CLEAR and evidence.speed_rate.std() >= _UNMISTAKABLE:
        notes.append("f_x does not follow dv/dt, although the speed changes: check the columns of both")
    for found, what in zip(agreement, ("change of speed", "turning"), strict=True):
        if found < CLEAR and options.lateral_sign == "estimate":
            notes.append(f"too little {what} to check the sense of the lateral axis; taken as right-handed")
    standing = evidence.still.sum() * evidence.dt >= _STILL_S
    if standing and rest_force(evidence)[1] == "average":
        notes.append("the car stands on a slope: roll and pitch of the device are from the whole drive")
    if not standing and evidence.course is None and options.rate_bias_deg_s is None:
        notes.append("neither standstill nor course: the bias of the yaw rate is taken as zero")
    if rate_course is None and options.rate_sign == "estimate":
        notes.append("no course: the sense of the rates is taken as it stands")
        if mounting.lateral_sign < 0:
            notes.append(
                "lateral force and yaw rate disagree; the lateral axis was mirrored, but reversed rates "
                "would look the same and the drive may be its mirror image: a column for course decides"
            )
    elif mounting.lateral_sign < 0 and mounting.rate_sign < 0 and options.lateral_sign == "estimate":
        notes.append(
            "lateral force and rates are both mirrored against the course; if the course counts "
            "counter-clockwise, reverse its column instead"
        )
    elif rate_course is not None and abs(rate_course) < CLEAR and options.rate_sign == "estimate":
        shown = abs(_squat(evidence, mounting)) >= CLEAR
        notes.append(
            "the course does not show the sense of the rates; "
            + ("taken from the pitch of the body" if shown else "taken as it stands")
        )
    return tuple(notes)


def _chosen(choice: Sign, estimated: int) -> int:
    return {"estimate": estimated, "keep": 1, "flip": -1}[choice]
