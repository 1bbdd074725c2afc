"""The statements of the paper on its six cases, measured: each one is a number with bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from pydantic import computed_field

from ...envs.cues import GRAVITY
from ...envs.settings import configuration
from ..trajectory import Floats, Trajectory

ONSET_WINDOW: Final = 1.5
"""From the beginning of a maneuver to the end of its onset cue, s."""

SETTLED: Final = 5.0
"""Length of the end of a steady turn over which steady values are taken, s."""


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
    """

    case: str
    quantity: str
    reported: str
    measured: float
    unit: str
    low: float
    high: float

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether the number lies within its bounds."""
        return self.low <= self.measured <= self.high


Drives = Mapping[str, Trajectory]
"""The trajectories by case."""


def beginning(trajectory: Trajectory) -> int:
    """First sample at which the car's horizontal specific force exceeds 0.1 m/s^2."""
    return int(np.argmax(np.hypot(*trajectory.f_reference[:, :2].T) > 0.1))


def correlation(a: Floats, b: Floats) -> float:
    """Pearson correlation."""
    return float(np.corrcoef(a, b)[0, 1])


def steady(trajectory: Trajectory, values: Floats) -> Floats:
    """The last seconds of a signal, in which a steady turn has settled."""
    return np.asarray(values[trajectory.time > trajectory.time[-1] - SETTLED])


def all_checks(drives: Drives) -> list[Check]:
    """Every statement, case by case."""
    return [
        *(within_limits(case, drives[case]) for case in drives),
        *entry_and_turn(drives["EST1"]),
        *opened_yaw(drives["EST1"], drives["EST2"]),
        *without_turntable(drives["EST1"], drives["EST3"]),
        *braking(drives["BRK"]),
        *full_lane_change(drives["LC1"]),
        *reduced_lane_change(drives["LC1"], drives["LC2"]),
    ]


def within_limits(case: str, t: Trajectory) -> Check:
    """No limit of the hardware is met."""
    share = float(t.limits_active.any(axis=1).mean())
    return Check(case, "share of time at a limit", "within its physical limitations", share, "", 0.0, 0.0)


def entry_and_turn(t: Trajectory) -> list[Check]:
    """EST1: side force, onset, dip, steady value, washed-out yaw rate."""
    first = beginning(t)
    onset = slice(first, first + round(ONSET_WINDOW / t.dt))
    simulated, reference = t.f_simulator[:, 1], t.f_reference[:, 1]
    cue = float(simulated[onset].max())
    at = first + int(np.argmax(simulated[onset]))
    dip = float(simulated[at : at + round(4.0 / t.dt)].min())
    end = float(steady(t, simulated).mean())
    rapid = float(t.time[at] - t.time[first])
    yaw = float(steady(t, t.w_simulator[:, 2]).mean() / steady(t, t.w_reference[:, 2]).mean())
    return [
        Check("EST1", "peak side force in the car", "about 0.25 g", float(reference.max()) / GRAVITY, "g", 0.23, 0.27),
        Check("EST1", "onset cue: time to its peak", "rapid onset", rapid, "s", 0.0, 1.0),
        Check("EST1", "onset cue over the car's peak", "below the car's", cue / float(reference.max()), "", 0.6, 0.99),
        Check("EST1", "dip after the onset, below the steady value", "a small dip", (end - dip) / end, "", 0.05, 0.35),
        Check(
            "EST1", "steady side force over the car's", "the right steady value",
            end / float(steady(t, reference).mean()), "", 0.95, 1.05,
        ),
        Check("EST1", "yaw rate at the end over the car's", "washed out", yaw, "", -0.05, 0.1),
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
    difference = float(np.sqrt(np.mean((t.f_simulator[:, 1] - est1.f_simulator[:, 1]) ** 2)))
    swing = math.degrees(float(np.ptp(t.hexapod[late, 3])))
    size = float(np.ptp(ripple) / np.ptp(predicted))
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
    difference = float(np.sqrt(np.mean((t.f_simulator[:, 1] - est1.f_simulator[:, 1]) ** 2)))
    return [
        Check("EST3", "carriage travel along over across", "primarily lateral", float(travel[0] / travel[1]), "", 0.0, 0.25),
        Check("EST3", "carriage travel along", "a small one is present", float(travel[0]), "m", 0.005, 1.0),
        Check("EST3", "yaw cue above half its peak", "very short duration", short, "s", 0.05, 1.5),
        Check("EST3", "side force: rms difference from EST1", "unchanged", difference / GRAVITY, "g", 0.0, 0.015),
        Check("EST3", "turntable angle", "turned off", float(np.abs(t.turntable).max()), "rad", 0.0, 0.0),
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
        Check("BRK", "deceleration of the car", "0.25 g", -plateau / GRAVITY, "g", 0.23, 0.27),
        Check("BRK", "onset over the car's", "a good onset cue", onset / plateau, "", 0.7, 1.1),
        Check("BRK", "left over in the sag, over the car's", "a sag from tilt limiting", sag / plateau, "", 0.2, 0.7),
        Check("BRK", "transient at the stop over the car's", "a good transient cue", transient, "", 0.6, 1.2),
        Check("BRK", "false cue after the stop", "a large false cue", false_cue, "g", 0.05, 0.25),
        Check("BRK", "carriage travel used", "21 m", travel, "m", 19.0, 23.0),
        Check("BRK", "farthest carriage position", "within 13.72 m", reach, "m", 0.0, 13.72),
    ]  # fmt: skip


def full_lane_change(t: Trajectory) -> list[Check]:
    """LC1: the car's own motion, nearly."""
    travel = np.ptp(t.carriage, axis=0)
    yaw = correlation(t.w_simulator[:, 2], t.w_reference[:, 2])
    force = correlation(t.f_simulator[:, 1], t.f_reference[:, 1])
    return [
        Check("LC1", "peak side force in the car", "about 0.125 g", float(np.abs(t.f_reference[:, 1]).max() / GRAVITY), "g", 0.115, 0.15),
        Check("LC1", "carriage travel across", "approximately 4 m", float(travel[1]), "m", 3.5, 4.5),
        Check("LC1", "carriage travel along", "very small", float(travel[0]), "m", 0.0, 0.5),
        Check("LC1", "correlation of f_y with the car's", "almost perfect", force, "", 0.99, 1.0),
        Check("LC1", "correlation of yaw rate with the car's", "almost perfect", yaw, "", 0.99, 1.0),
    ]  # fmt: skip


def reduced_lane_change(lc1: Trajectory, t: Trajectory) -> list[Check]:
    """LC2: without turntable and carriage the force degrades, the yaw rate does not."""
    yaw = correlation(t.w_simulator[:, 2], t.w_reference[:, 2])
    force = correlation(t.f_simulator[:, 1], t.f_reference[:, 1])
    best = correlation(lc1.f_simulator[:, 1], lc1.f_reference[:, 1])
    moved = float(max(np.abs(t.carriage).max(), np.abs(t.turntable).max()))
    return [
        Check("LC2", "correlation of f_y with the car's, LC1 less LC2", "degraded", best - force, "", 0.2, 2.0),
        Check("LC2", "correlation of yaw rate with the car's", "still duplicated", yaw, "", 0.98, 1.0),
        Check("LC2", "motion of carriage and turntable", "turned off", moved, "m, rad", 0.0, 0.0),
    ]  # fmt: skip
