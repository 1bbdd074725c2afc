"""What can be chosen about the optimum, as a configuration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.linalg import block_diag, solve_discrete_lyapunov

from ...envs.errors import ConfigurationError
from ...envs.perception import VestibularModel
from ...envs.perception.models import DiscreteFilter, discretize
from ...envs.platform.kernels.step import LEGS, TURNTABLE
from ...envs.platform.kinematics import NEARLY_SINGULAR
from ...envs.settings import NonNegative, Positive, configuration
from ...envs.simulator.simulator import N_AXES
from ..symbolic import Expression, SymbolicMachine, cs, cues

Share = Annotated[float, Field(ge=0.0, lt=0.5)]


@configuration
class OptimumOptions:
    """The problem that is solved, and how.

    Args:
        objective: "J" for the cues at the cab, "perceived" for what the driver senses of them at the head.
        steps: Time steps of the machine (10 ms) from one node to the next; accelerations are straight
            lines between nodes. Raise it and a solve is faster, and sharp cues are cut off.
        window: Greatest length of a drive that is solved as a whole, s. Longer ones are solved in windows.
        keep: Of each window that is kept before the next one begins, s; the rest is looking ahead.
        force_zone: Error of specific force no driver minds, m/s^2; as in J (Slob et al.).
        rate_zone: Error of angular velocity no driver minds, rad/s; as in J.
        effort: Weight of the machine's own motion, so that axes that do the same share it. Raise it and the
            machine stays nearer to neutral, with a higher J.
        margin: Share of the limits of speed and acceleration that is left free between nodes.
        widenings: How often a plan that meets a limit between nodes is solved anew: with three times the
            margin, or, where it came near a singular pose, clear of those.
        barrier: Weight of IPOPT's logarithmic barrier at the end. Lower it and plans come nearer to the
            limits, with a J lower by a percent at most and more iterations.
        tolerance: Of IPOPT: largest violation of the conditions of a minimum.
        iterations: Greatest number of IPOPT's iterations for a window.
    """

    objective: Literal["J", "perceived"] = "J"
    steps: Annotated[int, Field(ge=1, le=50)] = 5
    window: Positive = 60.0
    keep: Positive = 45.0
    force_zone: Positive = 0.6
    rate_zone: Positive = math.radians(3.0)
    effort: NonNegative = 1e-4
    margin: Share = 0.01
    widenings: Annotated[int, Field(ge=0, le=4)] = 2
    barrier: Positive = 1e-3
    tolerance: Positive = 2e-3
    iterations: Annotated[int, Field(ge=1)] = 200

    def __post_init__(self) -> None:
        if self.keep > self.window:
            raise ConfigurationError(
                f"keep = {self.keep:g} s must not be longer than window = {self.window:g} s"
            )


# The driver's vestibular system as one linear filter of the error of the cues.
#
# Canals and otoliths are linear, so what is sensed of the simulator less what is sensed of the car is what
# they would sense of the difference of both. Its order is that of the published models: two for each otolith,
# three for each canal, as ``envs.perception.models`` discretizes them.


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SensedError:
    """x' = A x + B e, y = C x + D e for the error e (6,) of force and rate; each signal has its own states.

    Args:
        a: (m, m).
        b: (m, 6).
        c: (6, m).
        d: (6,) feedthrough.
        size: (m,) what one unit of each state stands for in the published filter's own.
        place: (m,) where each state lies in rows of three, one row a signal, as the machine keeps them.
    """

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    size: Floats
    place: NDArray[np.int64]

    def ahead(self, filters: Floats, error: Floats) -> Floats:
        """(m,) the states for the next sample.

        Args:
            filters: (6, 3) states of the published filters now, otoliths before canals.
            error: (6,) the error now.
        """
        return np.asarray(self.a @ (filters.ravel()[self.place] / self.size) + self.b @ error)


def sensed_error(model: VestibularModel, dt: float) -> SensedError:
    """The filter at a time step, s; its states are scaled to unit size under white noise."""
    otolith = discretize(*model.otoliths.transfer_function(), dt)
    canals = [discretize(*model.canals.transfer_function(axis), dt) for axis in range(3)]
    parts = [_scaled(part) for part in [otolith] * 3 + canals]
    a, b, c = (np.asarray(block_diag(*(part[i] for part in parts))) for i in range(3))
    sizes = [part[3] for part in parts]
    place = np.concatenate([3 * i + np.arange(len(size)) for i, size in enumerate(sizes)])
    d = np.array([part.d for part in [otolith] * 3 + canals])
    return SensedError(a, b, c, d, np.concatenate(sizes), place)


def _scaled(part: DiscreteFilter) -> tuple[Floats, Floats, Floats, Floats]:
    """A (m, m), B (m, 1), C (1, m) without padding, and the size (m,) of states they are in."""
    m = int(np.count_nonzero(np.any(part.a != 0.0, axis=1)))
    a, b, c = part.a[:m, :m], part.b[:m, None], part.c[None, :m]
    size = np.sqrt(np.diag(solve_discrete_lyapunov(a, b @ b.T)))
    return a * size / size[:, None], b / size[:, None], c * size, size


# The machine's own motion, which costs next to nothing: it decides among plans of equal cues.


_REACH: Final = (10.0, 10.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 10.0)
"""A large position of each axis, m and rad."""

_PACE: Final = (3.0, 3.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 1.0)
"""A large rate of each axis, m/s and rad/s."""

_PUSH: Final = (3.0, 3.0, 3.0, 3.0, 3.0, 2.0, 2.0, 2.0, 2.0)
"""A large acceleration of each axis, m/s^2 and rad/s^2."""


def effort(q: Expression, v: Expression, a: Expression, b: Expression) -> Expression:
    """Distances from neutral, rates, accelerations and their changes, each in its large value."""
    parts = (
        q / cs.DM(_REACH),
        v / cs.DM(_PACE),
        0.5 * (a + b) / cs.DM(_PUSH),
        (b - a) / cs.DM(_PUSH),
    )
    return cs.vertcat(*parts)


# The motion from one node to the next, in symbols: where it leads, and the errors on its way.
#
# Accelerations are straight lines between nodes. The machine takes the mean of each of its time steps, which
# is the line at the middle of the step, and integrates exactly; so nothing is lost between this plan and the
# machine, and the errors are those of every sample.


N_CUES = 6
"""Specific force and angular velocity."""


@dataclass(frozen=True)
class Interval:
    """Expressions of the interval's symbols.

    Args:
        q: (9,) positions at its first node.
        v: (9,) rates there.
        x: (m,) states of the sensed error there, empty for J.
        a: (9,) accelerations there.
        b: (9,) accelerations at its last node.
        reference: (7, steps) the car's force and rate at its samples, and 1, or 0 after the end of the drive.
        end: (18 + m,) q, v, x at the last node.
        errors: (6 steps,) errors of all samples in indifference zones.
    """

    q: Expression
    v: Expression
    x: Expression
    a: Expression
    b: Expression
    reference: Expression
    end: Expression
    errors: Expression


def mean_accelerations(nodes: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """Accelerations (n steps, 9) of the machine's time steps, of those at n + 1 nodes (n + 1, 9)."""
    middle = (np.arange(steps) + 0.5) / steps
    lines = nodes[:-1, None] + (nodes[1:] - nodes[:-1])[:, None] * middle[:, None]
    return np.asarray(lines.reshape(-1, N_AXES))


def interval(
    machine: SymbolicMachine, options: OptimumOptions, sensed: SensedError | None, dt: float
) -> Interval:
    """The interval's expressions.

    Args:
        machine: The machine.
        options: Zones, and the number of steps.
        sensed: The filter to put errors through; None to take them as they are.
        dt: Time step of the machine, s.
    """
    q, v, a, b = (cs.SX.sym(name, N_AXES) for name in "qvab")
    x = cs.SX.sym("x", 0 if sensed is None else len(sensed.a))
    reference = cs.SX.sym("reference_cue", N_CUES + 1, options.steps)
    cab = machine.platform.cab
    point = cs.DM(cab.reference_point) + (0.0 if options.objective == "J" else cs.DM(cab.head))
    zones = cs.DM([options.force_zone] * 3 + [options.rate_zone] * 3)
    position, rate, memory, errors = q, v, x, []
    for k in range(options.steps):
        mean = a + (b - a) * ((k + 0.5) / options.steps)
        position, rate = position + dt * (rate + 0.5 * dt * mean), rate + dt * mean
        error = (cs.vertcat(*cues(point, position, rate, mean)) - reference[:N_CUES, k]) / zones
        if sensed is not None:
            simulated = error
            error = _sparse(sensed.c) @ memory + cs.DM(sensed.d) * simulated
            memory = _sparse(sensed.a) @ memory + _sparse(sensed.b) @ simulated
        errors.append(error * reference[N_CUES, k])
    return Interval(q, v, x, a, b, reference, cs.vertcat(position, rate, memory), cs.vertcat(*errors))


def _sparse(matrix: NDArray[np.float64]) -> Expression:
    return cs.sparsify(cs.DM(matrix))


# The limits of a machine at a node, as inequalities lower <= h(q, v, a) <= upper.
#
# With the extension l of an actuator, its limits of speed V and acceleration A, and the spacing T of
# the nodes:
#
#     l + ldot^2 / (2 A) <= l_max,    l - ldot^2 / (2 A) >= l_min,
#     |ldot + lddot T / 4| <= V,      |ldot - lddot T / 4| <= V,      |lddot| <= A,
#
# and where it is asked for, with the clearance c of a pose (det J over its value at neutral),
#
#     c(q) >= c_min,    c(q + v tau / 2) >= c_min,    tau = |ldot|_2 / A.
#
# The first line holds for a motion within its limits exactly if it can always be stopped in time. In
# the second
# one T / 4 is for the way between nodes: where lddot is a straight line that crosses zero, ldot peaks there.
# The last line keeps the platform from singular poses: tau is no shorter than the legs take to brake, v
# tau / 2
# no shorter than the way there.


_SPARE_CLEARANCE: Final = 0.03
"""On top of what the machine insists on, for the way between nodes."""

_NO_RATE: Final = 1e-3
"""Below it the way of braking legs is taken as none, m/s: keeps a square root smooth."""


@dataclass(frozen=True)
class NodeLimits:
    """Inequalities lower <= value <= upper.

    Args:
        value: (m,) expression.
        lower: (m,), -inf where there is none.
        upper: (m,), inf where there is none.
    """

    value: Expression
    lower: Floats
    upper: Floats


def node_limits(
    machine: SymbolicMachine,
    q: Expression,
    v: Expression,
    a: Expression,
    spacing: float,
    margin: float,
    widened: float | None = None,
    clear: bool = False,
) -> NodeLimits:
    """The inequalities of a node; the last six are those of leg accelerations.

    Args:
        machine: The machine.
        q: (9,) positions.
        v: (9,) rates.
        a: (9,) accelerations.
        spacing: From one node to the next, s.
        margin: Share of the limits of speed and acceleration that is kept free.
        widened: The same where it is wider than what was counted on for braking; default: ``margin``.
        clear: Whether to keep away from singular poses. Most motions come nowhere near one.
    """
    legs, limits = machine.leg_motion(q, v, a), machine.limits
    extension, rate, acceleration = (
        cs.vertcat(axes[:2], part, axes[TURNTABLE]) for axes, part in zip((q, v, a), legs, strict=True)
    )
    used = 1.0 - (margin if widened is None else widened)
    there = np.flatnonzero(_present(limits))
    stopping = _stopping(extension, rate, limits, spacing, 1.0 - margin)
    speed, force = limits["velocity"][there] * used, limits["acceleration"][LEGS] * used
    peak = acceleration[there.tolist()] * spacing / 4.0
    rates = rate[there.tolist()]
    poses = _clearances(machine, q, v, legs.rate) if clear else cs.SX(0, 1)
    least = np.full(poses.numel(), float(NEARLY_SINGULAR) + _SPARE_CLEARANCE)
    return NodeLimits(
        cs.vertcat(stopping.value, rates + peak, rates - peak, poses, legs.acceleration),
        np.concatenate([stopping.lower, -speed, -speed, least, -force]),
        np.concatenate([stopping.upper, speed, speed, np.full(len(least), np.inf), force]),
    )


def _clearances(machine: SymbolicMachine, q: Expression, v: Expression, leg_rates: Expression) -> Expression:
    """(2,) of a pose, and of one no nearer than where the platform comes to rest if the legs brake."""
    slowest = float(machine.limits["acceleration"][LEGS].min())
    time = cs.sqrt(cs.sumsqr(leg_rates) + _NO_RATE**2) / slowest
    return cs.vertcat(*(machine.clearance(pose) for pose in (q, q + 0.5 * time * v)))


def _stopping(
    extension: Expression, rate: Expression, limits: dict[str, Floats], spacing: float, used: float
) -> NodeLimits:
    """Every actuator with travel can stop before its ends."""
    with_travel = np.flatnonzero(np.isfinite(limits["position_max"]) & _present(limits))
    rows, most = with_travel.tolist(), limits["acceleration"][with_travel] * used
    # Between nodes an actuator that stops there goes at most A spacing^2 / 8 further.
    free = most * spacing**2 / 8.0
    way = rate[rows] ** 2 / (2.0 * cs.DM(most))
    unbounded = np.full(len(rows), np.inf)
    return NodeLimits(
        cs.vertcat(extension[rows] + way, extension[rows] - way),
        np.concatenate([-unbounded, limits["position_min"][with_travel] + free]),
        np.concatenate([limits["position_max"][with_travel] - free, unbounded]),
    )


def axis_bounds(machine: SymbolicMachine, margin: float) -> tuple[Floats, Floats]:
    """Greatest |v| and |a| of the nine axes, each (9,): 0 where missing, infinite for the hexapod."""
    limits = machine.limits
    axes = [0, 1, TURNTABLE]
    speed, acceleration = np.full(N_AXES, np.inf), np.full(N_AXES, np.inf)
    present = _present(limits)[axes]
    speed[axes] = limits["velocity"][axes] * (1.0 - margin) * present
    acceleration[axes] = limits["acceleration"][axes] * (1.0 - margin) * present
    return speed, acceleration


def _present(limits: dict[str, Floats]) -> NDArray[np.bool_]:
    return np.asarray(limits["position_max"] > limits["position_min"])
