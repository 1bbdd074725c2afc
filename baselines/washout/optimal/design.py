"""Design of the optimal washout: weights, the linear-quadratic problems of its channels, and their filters.

Sivan, Ish-Shalom and Huang (1982), in the form of Telban and Cardullo, NASA/CR-2005-213747. The car's motion
w is white noise through first-order filters. z are the states of machine and perception. Perception is
linear, so one set of states, driven by the difference of car and machine, is enough. u are the machine's
accelerations:

    minimize  E[y'Qy],    dz/dt = A z + B u + E w,    y = C z + D u + H w.

The algebraic Riccati equation over [z, w] gives the regulator u = -K [z, w]. Regulator, machine and
perception together are a linear filter from w to u: the washout. There are four channels: surge with pitch
and sway with roll, where a tilt stands in for a force; heave; yaw.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import linalg, signal

from ....envs.cues import GRAVITY
from ....envs.errors import ConfigurationError
from ....envs.perception import Canals, Otoliths, get_vestibular_model
from ....envs.settings import Positive, Vector2, Vector3, configuration
from ..classical.family import Limits, LowPass, Share


@configuration
class PlaneWeights:
    """Weights of surge and pitch, or of sway and roll: the size at which each quantity costs 1.

    Args:
        sensed_force: Error of the perceived specific force, m/s^2.
        sensed_rate: Error of the perceived angular velocity, rad/s.
        integral: Time integral of the displacement, m s.
        displacement: Of the cab from where the drive began, m.
        velocity: Of it, m/s.
        tilt_rate: Angular velocity of the cab, rad/s.
        acceleration: Of the displacement, m/s^2.
        tilt_acceleration: Angular acceleration of the cab, rad/s^2.
    """

    sensed_force: Positive = 0.6
    sensed_rate: Positive = math.radians(3.0)
    integral: Positive = 50.0
    displacement: Positive = 10.0
    velocity: Positive = 10.0
    tilt_rate: Positive = 0.2
    acceleration: Positive = 10.0
    tilt_acceleration: Positive = 2.0


@configuration
class HeaveWeights:
    """Weights of heave: the size at which each quantity costs 1.

    Args:
        sensed_force: Error of the perceived specific force, m/s^2.
        integral: Time integral of the displacement, m s.
        displacement: Of the cab from where the drive began, m.
        velocity: Of it, m/s.
        acceleration: Of it, m/s^2.
    """

    sensed_force: Positive = 0.6
    integral: Positive = 0.5
    displacement: Positive = 0.2
    velocity: Positive = 0.5
    acceleration: Positive = 5.0


@configuration
class YawWeights:
    """Weights of yaw: the size at which each quantity costs 1.

    Args:
        sensed_rate: Error of the perceived angular velocity, rad/s.
        angle: Of the cab from where the drive began, rad.
        rate: Angular velocity of the cab, rad/s.
        acceleration: Angular acceleration of the cab, rad/s^2.
    """

    sensed_rate: Positive = math.radians(3.0)
    angle: Positive = 100.0
    rate: Positive = 5.0
    acceleration: Positive = 5.0


@configuration
class OptimalParameters:
    """Parameters of the optimal washout.

    Args:
        name: Preset name.
        description: One line for people.
        algorithm: Family, as parameter files name it.
        force_scale: Scale of f_AA an axis (z on f_z + g).
        force_limit: Greatest scaled specific force an axis, m/s^2 (z on f_z + g).
        rate_scale: Scale of omega_AA an axis.
        rate_limit: Greatest scaled angular velocity an axis, rad/s.
        force_bandwidth: Bandwidth of the first-order noise that models the car's specific force, rad/s.
        rate_bandwidth: Bandwidth of the noise that models its angular velocity, rad/s.
        vestibular: Name of the perception model that the filters are optimal for.
        surge: Weights of surge and pitch.
        sway: Weights of sway and roll.
        heave: Weights of heave.
        yaw: Weights of yaw.
        turntable_share: k_T: 1 turns the cab with the turntable, 0 with the hexapod.
        turntable_gain: k_yr, scales the turntable's angle for special effects.
        lpc: LPC FILT, which gives the carriage its part, or None to leave all to the hexapod.
        start_carriage: Where the carriage begins a drive, m.
        start_hexapod: Where the hexapod begins a drive, m from neutral.
        follow_frequency: How fast machine and filters come together again after a limit was hit, rad/s.
    """

    name: str
    description: str = ""
    algorithm: Literal["optimal"] = "optimal"
    force_scale: Vector3 = (1.0, 1.0, 1.0)
    force_limit: Limits = (10.0, 10.0, 10.0)
    rate_scale: Vector3 = (1.0, 1.0, 1.0)
    rate_limit: Limits = (1.5, 1.5, 1.5)
    force_bandwidth: Positive = 1.0
    rate_bandwidth: Positive = 1.0
    vestibular: str = "telban"
    surge: PlaneWeights = PlaneWeights()
    sway: PlaneWeights = PlaneWeights()
    heave: HeaveWeights = HeaveWeights()
    yaw: YawWeights = YawWeights()
    turntable_share: Share = 1.0
    turntable_gain: Positive = 1.0
    lpc: LowPass | None = LowPass(8.0)
    start_carriage: Vector2 = (0.0, 0.0)
    start_hexapod: Vector3 = (0.0, 0.0, 0.0)
    follow_frequency: Annotated[float, Field(gt=0.0, le=50.0)] = 5.0

    def __post_init__(self) -> None:
        get_vestibular_model(self.vestibular)


Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StateSpace:
    """dz/dt = A z + B w, u = C z + D w."""

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix


@dataclass(frozen=True, eq=False)
class ChannelProblem:
    """Minimize the mean of y'Qy, y = C z + D u + H w.

    dz/dt = A z + B u + E w, dw/dt = -diag(bandwidth) w + noise.

    Args:
        a: (n, n).
        b: (n, m).
        e: (n, k).
        c: (p, n).
        d: (p, m).
        h: (p, k).
        q: (p,) diagonal of Q.
        bandwidth: (k,) rad/s.
    """

    a: Matrix
    b: Matrix
    e: Matrix
    c: Matrix
    d: Matrix
    h: Matrix
    q: Matrix
    bandwidth: Matrix

    @property
    def joint(self) -> tuple[Matrix, Matrix, Matrix]:
        """A, B and C of [z, w]."""
        k = len(self.bandwidth)
        a = np.block([[self.a, self.e], [np.zeros((k, len(self.a))), -np.diag(self.bandwidth)]])
        b = np.vstack([self.b, np.zeros((k, self.b.shape[1]))])
        return a, b, np.hstack([self.c, self.h])


@dataclass(frozen=True, eq=False)
class Regulator:
    """The best linear regulator.

    Args:
        riccati: P of the algebraic Riccati equation over [z, w]; [z, w]' P [z, w] is the cost yet to come.
        gain: K: u = -K [z, w].
        filter: The regulator and what it drives, as a filter of w.
    """

    riccati: Matrix
    gain: Matrix
    filter: StateSpace


def optimal_regulator(problem: ChannelProblem) -> Regulator:
    """The regulator that minimizes the cost.

    Raises:
        ConfigurationError: the Riccati equation has no stabilizing solution in floating point.
    """
    a, b, c = problem.joint
    weighted = problem.q[:, None] * c
    q, s = c.T @ weighted, weighted.T @ problem.d
    r = problem.d.T @ (problem.q[:, None] * problem.d)
    try:
        riccati = np.asarray(linalg.solve_continuous_are(a, b, q, r, s=s), dtype=np.float64)
    except (linalg.LinAlgError, ValueError) as error:
        raise ConfigurationError(
            f"no optimal washout has these weights ({error}); bring them nearer"
        ) from None
    gain = linalg.solve(r, b.T @ riccati + s.T, assume_a="pos")
    return Regulator(riccati, gain, _closed_loop(problem, gain))


def _closed_loop(problem: ChannelProblem, gain: Matrix) -> StateSpace:
    """The loop of regulator, perception and machine, from the car's motion to the machine's accelerations."""
    n = len(problem.a)
    inner, forward = gain[:, :n], gain[:, n:]
    return StateSpace(
        problem.a - problem.b @ inner, problem.e - problem.b @ forward, -inner, -np.asarray(forward)
    )


Block = tuple[Matrix, Matrix, Matrix, Matrix]

PLANE_STATES: Final = 10
"""Canal 3, otolith 2, integral of the displacement, displacement, velocity, tilt, tilt rate."""
LINE_STATES: Final = 5
"""Heave: otolith 2, integral, displacement, velocity. Yaw: canal 3, angle, rate."""
DISPLACEMENT, VELOCITY, TILT, TILT_RATE = 6, 7, 8, 9
"""Where the machine's states stand in a plane."""
LINE_POSITION, LINE_VELOCITY = 3, 4
"""Where they stand in heave and yaw."""


def _state_space(numerator: Matrix, denominator: Matrix) -> Block:
    a, b, c, d = (np.asarray(m, dtype=np.float64) for m in signal.tf2ss(numerator, denominator))
    return a, b, c, d


def plane(
    w: PlaneWeights,
    canals: Canals,
    otoliths: Otoliths,
    axis: int,
    sign: float,
    bandwidth: tuple[float, float],
) -> ChannelProblem:
    """Surge and pitch (axis 1, sign 1) or sway and roll (axis 0, sign -1).

    u = [tilt acceleration, acceleration], w = [angular velocity, specific force], specific force
    x'' + sign g tilt. y = [perceived rate, perceived force, integral, displacement, velocity, tilt rate, u].

    Args:
        w: Weights.
        canals: Perception of the angular velocity.
        otoliths: Perception of the specific force.
        axis: Of the canals: 0 roll, 1 pitch.
        sign: Of the specific force that a positive tilt gives.
        bandwidth: Of the car's angular velocity and specific force, rad/s.
    """
    canal, otolith = (
        _state_space(*canals.transfer_function(axis)),
        _state_space(*otoliths.transfer_function()),
    )
    a = linalg.block_diag(canal[0], otolith[0], np.zeros((5, 5)))
    a[5, DISPLACEMENT] = a[DISPLACEMENT, VELOCITY] = a[TILT, TILT_RATE] = 1.0
    b, e = np.zeros((PLANE_STATES, 2)), np.zeros((PLANE_STATES, 2))
    b[TILT_RATE, 0] = b[VELOCITY, 1] = 1.0
    e[:3, 0], e[3:5, 1] = canal[1][:, 0], otolith[1][:, 0]
    c, d, h = np.zeros((8, PLANE_STATES)), np.zeros((8, 2)), np.zeros((8, 2))
    c[0, :3], h[0, 0] = canal[2][0], canal[3][0, 0]
    c[1, 3:5], h[1, 1] = otolith[2][0], otolith[3][0, 0]
    # Perception is driven by the car's motion less the machine's.
    for rows, inputs in ((a, e), (c, h)):
        rows[:, TILT_RATE] -= inputs[:, 0]
        rows[:, TILT] -= sign * GRAVITY * inputs[:, 1]
    b[:, 1] -= e[:, 1]
    d[:, 1] -= h[:, 1]
    c[2, 5] = c[3, DISPLACEMENT] = c[4, VELOCITY] = c[5, TILT_RATE] = d[6, 0] = d[7, 1] = 1.0
    sizes = (w.sensed_rate, w.sensed_force, w.integral, w.displacement, w.velocity, w.tilt_rate)
    return ChannelProblem(
        a, b, e, c, d, h, _weights(*sizes, w.tilt_acceleration, w.acceleration), np.array(bandwidth)
    )


def heave(w: HeaveWeights, otoliths: Otoliths, bandwidth: float) -> ChannelProblem:
    """Heave: u = acceleration, w = specific force; y = [perceived force, integral, position, velocity, u]."""
    otolith = _state_space(*otoliths.transfer_function())
    a = linalg.block_diag(otolith[0], np.zeros((3, 3)))
    a[2, LINE_POSITION] = a[LINE_POSITION, LINE_VELOCITY] = 1.0
    e = np.vstack([otolith[1], np.zeros((3, 1))])
    b = -e + np.eye(LINE_STATES)[:, [LINE_VELOCITY]]
    c = np.zeros((5, LINE_STATES))
    c[0, :2], c[1:4, 2:] = otolith[2][0], np.eye(3)
    h = np.array([[otolith[3][0, 0]], [0.0], [0.0], [0.0], [0.0]])
    d = -h + np.eye(5)[:, [4]]
    q = _weights(w.sensed_force, w.integral, w.displacement, w.velocity, w.acceleration)
    return ChannelProblem(a, b, e, c, d, h, q, np.array([bandwidth]))


def yaw(w: YawWeights, canals: Canals, bandwidth: float) -> ChannelProblem:
    """Yaw: u = angular acceleration, w = angular velocity. y = [perceived rate, angle, rate, u]."""
    canal = _state_space(*canals.transfer_function(2))
    a = linalg.block_diag(canal[0], np.zeros((2, 2)))
    e = np.vstack([canal[1], np.zeros((2, 1))])
    a[:, LINE_VELOCITY] -= e[:, 0]
    a[LINE_POSITION, LINE_VELOCITY] = 1.0
    b = np.eye(LINE_STATES)[:, [LINE_VELOCITY]]
    c = np.zeros((4, LINE_STATES))
    c[0, :3], c[1:3, 3:] = canal[2][0], np.eye(2)
    h = np.array([[canal[3][0, 0]], [0.0], [0.0], [0.0]])
    c[0, LINE_VELOCITY] -= h[0, 0]
    d = np.eye(4)[:, [3]]
    return ChannelProblem(
        a, b, e, c, d, h, _weights(w.sensed_rate, w.angle, w.rate, w.acceleration), np.array([bandwidth])
    )


def _weights(*sizes: float) -> Matrix:
    """Bryson's rule: a quantity at its size costs 1."""
    return np.asarray(sizes, dtype=np.float64) ** -2


@dataclass(frozen=True, eq=False)
class Design:
    """The regulators of all channels; surge goes with pitch, sway with roll."""

    surge: Regulator
    sway: Regulator
    heave: Regulator
    yaw: Regulator


def design(p: OptimalParameters) -> Design:
    """Solve the four Riccati equations.

    Raises:
        ConfigurationError: one of them has no solution in floating point.
    """
    model = get_vestibular_model(p.vestibular)
    canals, otoliths = model.canals, model.otoliths
    bandwidth = p.rate_bandwidth, p.force_bandwidth
    return Design(
        optimal_regulator(plane(p.surge, canals, otoliths, 1, 1.0, bandwidth)),
        optimal_regulator(plane(p.sway, canals, otoliths, 0, -1.0, bandwidth)),
        optimal_regulator(heave(p.heave, otoliths, p.force_bandwidth)),
        optimal_regulator(yaw(p.yaw, canals, p.rate_bandwidth)),
    )


def discrete(filter: StateSpace, dt: float) -> StateSpace:
    """The filter at a time step, s, implicit: accelerations follow from the states at the end of the step.

    Weights that ask for loops faster than the time step then give the acceleration that ends the error in one
    step; the bilinear transform would make them ring, and a machine at a limit would make the ringing grow.
    """
    parts = filter.a, filter.b, filter.c, filter.d
    a, b, c, d, _ = signal.cont2discrete(parts, dt, method="backward_diff")
    return StateSpace(a, b, c, d)
