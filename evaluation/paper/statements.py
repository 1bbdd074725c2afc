"""The statements of the paper on its six cases, measured: each one is a number with bounds.

A number of the paper has bounds around it. Words, such as "almost perfect", have bounds that wrong machines
fail: `python -m benchmarks.mutants` tries them. Each cue is measured in size and in shape. On axes of which the
paper says nothing its equations count, see :mod:`.equations`.

A number that describes the car or the locked parts of the machine is ``set_up``. No washout can fail it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from pydantic import computed_field

from ...baselines.washout.classical.family import WashoutParameters, load_washout
from ...envs.cues import GRAVITY
from ...envs.platform import get_platform
from ...envs.settings import configuration
from ..trajectory import Floats, Trajectory
from .equations import Motion, displacement, high_passed_rates, tilt

CASES: Final = {
    "EST1": ("steady-turn", "est1"),
    "EST2": ("steady-turn", "est2"),
    "EST3": ("steady-turn", "est3"),
    "BRK": ("braking", "brk"),
    "LC1": ("lane-change", "lc1"),
    "LC2": ("lane-change", "lc2"),
}
"""Maneuver and washout preset of each case."""

ONSET_WINDOW: Final = 1.5
"""From the beginning of a maneuver to the end of its onset cue, s."""

SETTLED: Final = 5.0
"""Length of the end of a steady turn over which steady values are taken, s."""

_AWAY: Final = math.radians(1.0)
"""Distance from its angle above which tilt is on its way there."""

_AXES: Final = ("f_x", "f_y", "f_z", "roll rate", "pitch rate", "yaw rate")
_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])


@configuration
class Check:
    """One statement of the paper and its measured number.

    Args:
        case: EST1 to LC2.
        quantity: Name of the number.
        reported: The words of the paper.
        measured: The number.
        unit: Of the number; empty for a pure one.
        low: Least value that passes.
        high: Greatest value that passes.
        set_up: Whether it describes the car or locked parts of the machine: no washout can fail it.
    """

    case: str
    quantity: str
    reported: str
    measured: float
    unit: str
    low: float
    high: float
    set_up: bool = False

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether the number lies within its bounds."""
        return self.low <= self.measured <= self.high


Drives = Mapping[str, Trajectory]
"""The trajectories by case."""


# Numbers of signals.


def beginning(trajectory: Trajectory) -> int:
    """First sample at which the car's horizontal specific force exceeds 0.1 m/s^2."""
    return int(np.argmax(np.hypot(*trajectory.f_reference[:, :2].T) > 0.1))


def ratio(a: float, b: float) -> float:
    """A / b, and 0 where there is nothing to compare with."""
    return float(a / b) if abs(b) > 1e-9 else 0.0


def rms(values: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def correlation(a: Floats, b: Floats) -> float:
    """Pearson correlation: the shape. 0 where a signal is constant."""
    a, b = a - a.mean(), b - b.mean()
    return ratio(float(a @ b), math.sqrt(float((a @ a) * (b @ b))))


def gain(simulator: Floats, car: Floats) -> float:
    """Least-squares factor from the car's signal to the simulator's: the size, with its sign."""
    return ratio(float(simulator @ car), float(car @ car))


def error(simulator: Floats, car: Floats) -> float:
    """Rms of the difference over the rms of the car's signal: size and shape; 1 where nothing moves."""
    return ratio(rms(simulator - car), rms(car))


def worst(a: Floats, b: Floats, floor: float) -> float:
    """The largest :func:`error` of the columns; the size of a column is ``floor`` at least."""
    return max(rms(a[:, k] - b[:, k]) / max(rms(b[:, k]), floor) for k in range(a.shape[1]))


def steady(trajectory: Trajectory, values: Floats) -> Floats:
    """The last seconds of a signal, in which a steady turn has settled."""
    return np.asarray(values[trajectory.time > trajectory.time[-1] - SETTLED])


def simulator_cues(t: Trajectory) -> Floats:
    """(n, 6) specific force and angular velocity of the cab, less those at rest."""
    return np.asarray(np.hstack([t.f_simulator, t.w_simulator]) - _REST)


def car_cues(t: Trajectory) -> Floats:
    """(n, 6) the same of the car."""
    return np.asarray(np.hstack([t.f_reference, t.w_reference]) - _REST)


# Statements on every case.


def all_checks(drives: Drives) -> list[Check]:
    """Every statement, case by case."""
    est1, est2, est3 = drives["EST1"], drives["EST2"], drives["EST3"]
    return [
        *(within_limits(case, drives[case]) for case in drives),
        *(check for case in drives for check in equations(case, drives[case])),
        *entry_and_turn(est1),
        *turn_cues("EST1", est1),
        *opened_yaw(est1, est2),
        *turn_cues("EST2", est2),
        *without_turntable(est1, est3),
        *turn_cues("EST3", est3),
        *braking(drives["BRK"]),
        *full_lane_change(drives["LC1"]),
        *reduced_lane_change(drives["LC1"], drives["LC2"]),
    ]


def within_limits(case: str, t: Trajectory) -> Check:
    """No limit of the hardware is met."""
    share = float(t.limits_active.any(axis=1).mean())
    return Check(case, "share of time at a limit", "within its physical limitations", share, "", 0.0, 0.0)


def equations(case: str, t: Trajectory) -> list[Check]:
    """Each cue and each filter against the paper's equations, axis by axis; the worst axis counts.

    Errors are rms of the difference over rms of the signal. Axes that hardly move count from a floor on.
    """
    p = load_washout(CASES[case][1])
    motion = Motion.of(t, get_platform("paper").cab)
    cues, turned = simulator_cues(t), high_passed_rates(p, t, motion)
    force = worst(cues[1:, :3], (motion.force - _REST[:3])[1:], 0.02)
    rate = worst(cues[:, 3:], motion.rate, 0.002)
    moved = worst(motion.displacement, displacement(p, t, motion), 0.02)
    checks = [
        Check(case, "specific force: error against the machine's motion", "Eqs. (1), (40)", force, "", 0.0, 0.05),
        Check(case, "angular velocity: error against the machine's motion", "Eq. (7)", rate, "", 0.0, 0.05),
        Check(case, "displacement Q: error against HPS and HPI", "Eqs. (48), (51)", moved, "", 0.0, 0.02),
    ]  # fmt: skip
    if case != "BRK":
        yaw = error(motion.euler_rates[:, 2], turned[:, 2])
        checks.append(Check(case, "yaw rate: error against HPR", "Eq. (23)", yaw, "", 0.0, 0.05))
    return checks + tilting(case, t, p, motion, (motion.euler_rates - turned)[:, :2])


def tilting(case: str, t: Trajectory, p: WashoutParameters, motion: Motion, rates: Floats) -> list[Check]:
    """Tilt coordination: its limits, and the angles of Eq. (19) where no limit holds.

    Args:
        case: The case.
        t: Its drive.
        p: Its washout.
        motion: Of the cab.
        rates: (n, 2) tilt rates of roll and pitch, rad/s.
    """
    fastest = math.degrees(float(np.abs(rates).max()))
    limits = "limits on both the tilt rate and the tilt acceleration"
    if p.tilt is None:
        return [Check(case, "largest tilt rate", "tilt coordination eliminated", fastest, "deg/s", 0.0, 0.1)]
    hardest = math.degrees(float(np.abs(np.diff(rates, axis=0)).max())) / t.dt
    checks = [
        Check(case, "largest tilt rate", limits, fastest, "deg/s", 2.8, 3.15),
        Check(case, "largest tilt acceleration", limits, hardest, "deg/s²", 6.0, 11.0),
    ]
    target = tilt(p, t, motion)[:, 1]
    if case != "BRK":
        held = error(rates[:, 1], np.gradient(target, t.dt))
        checks.append(Check(case, "tilt rate in pitch: error against N fL", "Eq. (19)", held, "", 0.0, 0.12))
        return checks
    # It is limited throughout: it must always move towards its angle.
    pitch = np.cumsum(rates[:, 1]) * t.dt
    away = np.abs(target - pitch) > _AWAY
    # A tilt that is never away from its angle is not limited.
    moves = np.sign(rates[away, 1]) == np.sign((target - pitch)[away])
    towards = float(moves.mean()) if away.any() else 0.0
    checks.append(
        Check(case, "share of time in which tilt moves to N fL", "Eq. (19)", towards, "", 0.99, 1.0)
    )
    return checks


# Statements on each.


def turn_cues(case: str, t: Trajectory) -> list[Check]:
    """Each cue of the steady turn: side force in size and shape, false cues, quick parts."""
    side, car = t.f_simulator[:, 1], t.f_reference[:, 1]
    return [
        Check(case, "f_y: error over the car's f_y", "a good job of representing this cue", error(side, car), "", 0.0, 0.15),
        Check(case, "f_y: correlation with the car's", "a good job of representing this cue", correlation(side, car), "", 0.93, 1.0),
    ]  # fmt: skip


def entry_and_turn(t: Trajectory) -> list[Check]:
    """EST1: side force, onset, dip, steady value, washed-out yaw rate, perceived yaw rate."""
    first = beginning(t)
    onset = slice(first, first + round(ONSET_WINDOW / t.dt))
    simulated, reference = t.f_simulator[:, 1], t.f_reference[:, 1]
    cue = float(simulated[onset].max())
    at = first + int(np.argmax(simulated[onset]))
    dip = float(simulated[at : at + round(4.0 / t.dt)].min())
    end = float(steady(t, simulated).mean())
    rapid = float(t.time[at] - t.time[first])
    yaw = ratio(float(steady(t, t.w_simulator[:, 2]).mean()), float(steady(t, t.w_reference[:, 2]).mean()))
    perceived, car = t.perceived_w_simulator[:, 2], t.perceived_w_reference[:, 2]
    similar = "sensed yaw rates quite similar"
    return [
        Check("EST1", "peak side force in the car", "about 0.25 g", float(reference.max()) / GRAVITY, "g", 0.23, 0.27, True),
        Check("EST1", "onset cue: time to its peak", "rapid onset", rapid, "s", 0.05, 1.0),
        Check("EST1", "onset cue over the car's peak", "below the car's", cue / float(reference.max()), "", 0.8, 0.99),
        Check("EST1", "dip after the onset, below the steady value", "a small dip", ratio(end - dip, end), "", 0.05, 0.35),
        Check(
            "EST1", "steady side force over the car's", "the right steady value",
            end / float(steady(t, reference).mean()), "", 0.95, 1.05,
        ),
        Check("EST1", "yaw rate at the end over the car's", "washed out", yaw, "", -0.05, 0.1),
        Check("EST1", "perceived yaw rate: correlation with the car's", similar, correlation(perceived, car), "", 0.8, 1.0),
        Check("EST1", "perceived yaw rate: its peak over the car's", similar, ratio(float(perceived.max()), float(car.max())), "", 0.85, 1.15),
        Check("EST1", "perceived yaw rate: error over the car's", similar, error(perceived, car), "", 0.0, 0.8),
    ]  # fmt: skip


def predicted_ripple(t: Trajectory) -> Floats:
    """Eq. (54), third row, with k_T = 1: the false yaw rate, rad/s, that turning a tilted cab causes.

    fL is taken as the car's horizontal specific force, which is slow here.
    """
    theta, psi = t.hexapod[:, 4], t.turntable
    low = t.f_reference[:, :2]
    return np.asarray(
        t.turntable_rate / GRAVITY * np.sin(theta) * (low[:, 1] * np.sin(psi) - low[:, 0] * np.cos(psi))
    )


def opened_yaw(est1: Trajectory, t: Trajectory) -> list[Check]:
    """EST2: the yaw rate tends to the car's, with the ripple of Eq. (54); the tilt angles oscillate."""
    late = t.time > t.time[-1] - 3.0 * SETTLED
    ripple = (t.w_simulator[:, 2] - t.w_reference[:, 2])[late]
    predicted = predicted_ripple(t)[late]
    yaw = float(np.mean(t.w_simulator[late, 2]) / np.mean(t.w_reference[late, 2]))
    difference = rms(t.f_simulator[:, 1] - est1.f_simulator[:, 1])
    swing = math.degrees(float(np.ptp(t.hexapod[late, 3])))
    size = ratio(float(np.ptp(ripple)), float(np.ptp(predicted)))
    return [
        Check("EST2", "yaw rate over the car's, last 15 s", "tends to the car's", yaw, "", 0.95, 1.05),
        Check("EST2", "yaw-rate ripple, correlation with (54)", "oscillatory, by (54)", correlation(ripple, predicted), "", 0.95, 1.0),
        Check("EST2", "yaw-rate ripple, size over (54)", "oscillatory, by (54)", size, "", 0.85, 1.15),
        Check("EST2", "swing of the roll angle, last 15 s", "the tilt angles oscillate", swing, "deg", 8.0, 30.0),
        Check("EST2", "side force: rms difference from EST1", "as EST1", difference / GRAVITY, "g", 0.0, 0.01),
    ]  # fmt: skip


def without_turntable(est1: Trajectory, t: Trajectory) -> list[Check]:
    """EST3: mainly lateral carriage travel, a very short yaw cue, side force as EST1."""
    travel = np.ptp(t.carriage, axis=0)
    yaw = t.w_simulator[:, 2]
    short = float(np.count_nonzero(yaw > 0.5 * yaw.max()) * t.dt)
    difference = rms(t.f_simulator[:, 1] - est1.f_simulator[:, 1])
    perceived, car = t.perceived_w_simulator[:, 2], t.perceived_w_reference[:, 2]
    different = "sensed yaw rate significantly different"
    return [
        Check("EST3", "carriage travel along over across", "primarily lateral", ratio(float(travel[0]), float(travel[1])), "", 0.0, 0.25),
        Check("EST3", "carriage travel along", "a small one is present", float(travel[0]), "m", 0.005, 1.0),
        Check("EST3", "yaw cue above half its peak", "very short duration", short, "s", 0.05, 1.5),
        Check("EST3", "perceived yaw rate: correlation with the car's", different, correlation(perceived, car), "", -1.0, 0.5),
        Check("EST3", "perceived yaw rate: error over the car's", different, error(perceived, car), "", 0.9, 2.0),
        Check("EST3", "side force: rms difference from EST1", "unchanged", difference / GRAVITY, "g", 0.0, 0.01),
        Check("EST3", "turntable angle", "turned off", float(np.abs(t.turntable).max()), "rad", 0.0, 0.0, True),
    ]  # fmt: skip


def braking(t: Trajectory) -> list[Check]:
    """BRK: onset, sag, transient at the stop, false cue after it, and 21 m of carriage."""
    first = beginning(t)
    simulated, reference = t.f_simulator[:, 0], t.f_reference[:, 0]
    stop = first + int(np.argmax(reference[first:] > -0.1))
    onset = float(simulated[first : first + round(ONSET_WINDOW / t.dt)].min())
    sag = float(simulated[first + round(ONSET_WINDOW / t.dt) : stop].max())
    around = slice(stop - round(0.6 / t.dt), stop + round(0.6 / t.dt))
    transient = float(np.ptp(simulated[around]) / np.ptp(reference[around]))
    false_cue = float(-simulated[stop + round(1.0 / t.dt) :].min() / GRAVITY)
    travel = float(np.ptp(t.carriage[:, 0]))
    reach = float(np.abs(t.carriage).max())
    plateau = float(np.median(reference[first:stop]))
    return [
        Check("BRK", "deceleration of the car", "0.25 g", -plateau / GRAVITY, "g", 0.23, 0.27, True),
        Check("BRK", "onset over the car's", "a good onset cue", onset / plateau, "", 0.7, 1.1),
        Check("BRK", "left over in the sag, over the car's", "a sag from tilt limiting", sag / plateau, "", 0.2, 0.7),
        Check("BRK", "transient at the stop over the car's", "a good transient cue", transient, "", 0.8, 1.1),
        Check("BRK", "false cue after the stop", "a large false cue", false_cue, "g", 0.1, 0.2),
        Check("BRK", "carriage travel used", "21 m", travel, "m", 19.0, 23.0),
        Check("BRK", "farthest carriage position", "within 13.72 m", reach, "m", 0.0, 13.72, True),
    ]  # fmt: skip


def full_lane_change(t: Trajectory) -> list[Check]:
    """LC1: the car's own motion, nearly, on each axis."""
    travel = np.ptp(t.carriage, axis=0)
    simulator, car = simulator_cues(t), car_cues(t)
    peak = float(np.abs(t.f_reference[:, 1]).max() / GRAVITY)
    return [
        Check("LC1", "peak side force in the car", "about 0.125 g", peak, "g", 0.115, 0.15, True),
        Check("LC1", "carriage travel across", "approximately 4 m", float(travel[1]), "m", 3.5, 4.5),
        Check("LC1", "carriage travel along", "very small", float(travel[0]), "m", 0.0, 0.5),
        *(
            Check("LC1", f"{name}: error over the car's", "almost perfect", error(simulator[:, k], car[:, k]), "", 0.0, 0.05 if name == "f_y" else 0.15)
            for k, name in enumerate(_AXES)
        ),
    ]  # fmt: skip


def reduced_lane_change(lc1: Trajectory, t: Trajectory) -> list[Check]:
    """LC2: without turntable and carriage the force degrades, the yaw rate does not."""
    force, yaw = t.f_simulator[:, 1], t.w_simulator[:, 2]
    car, car_yaw = t.f_reference[:, 1], t.w_reference[:, 2]
    moved = float(max(np.abs(t.carriage).max(), np.abs(t.turntable).max()))
    worse = error(force, car) - error(lc1.f_simulator[:, 1], lc1.f_reference[:, 1])
    return [
        Check("LC2", "f_y: correlation with the car's", "a degraded cue", correlation(force, car), "", 0.6, 0.95),
        Check("LC2", "f_y: size over the car's", "a degraded cue", gain(force, car), "", 0.3, 0.7),
        Check("LC2", "f_y: error over the car's, LC2 less LC1", "a degraded cue", worse, "", 0.2, 0.8),
        Check("LC2", "yaw rate: error over the car's", "still duplicated", error(yaw, car_yaw), "", 0.0, 0.1),
        Check("LC2", "motion of carriage and turntable", "turned off", moved, "m, rad", 0.0, 0.0, True),
    ]  # fmt: skip
