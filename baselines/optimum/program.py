r"""The optimal control problem of a drive: options, cost, motion from node to node, and limits, in symbols.

The drive is known. Unknown are the accelerations a_k at nodes ``steps`` time steps apart; between nodes they
are straight lines. With q and v positions and rates of the nine axes, and x the states of the vestibular
filters,

    minimize    sum over samples |e|^2 / steps + effort sum over nodes |s|^2
    subject to  [q, v, x]_{k+1} = F(q_k, v_k, x_k, a_k, a_{k+1})      (:func:`interval`)
                lower <= h(q_k, v_k, a_k) <= upper                    (:func:`node_limits`)
                [q, v, x]_0 given.

**Cost.** e is the error of the six cues in indifference zones, so that the first sum is J times the number of
nodes. For the perceived objective it is filtered by the vestibular system (:class:`PerceivedErrorFilter`): as
canals and otoliths are linear, the difference of two perceived cues is the perceived difference. s is the
machine's own motion, each part in its large value (:func:`effort`). It decides among motions of equal cues.

**Motion.** The machine takes the mean of each time step, which is the line at the middle of the step, and
integrates exactly. So nothing is lost between plan and machine, and the errors are those of every sample.

**Limits.** With extension l of an actuator, its limits V of speed and A of acceleration, the spacing T of the
nodes, and the clearance c of a pose (det J over its value at neutral),

    l + ldot^2 / (2 A) <= l_max,    l - ldot^2 / (2 A) >= l_min,
    |ldot + lddot T / 4| <= V,      |ldot - lddot T / 4| <= V,      |lddot| <= A,
    c(q) >= c_min,    c(q + v tau / 2) >= c_min,    tau = |ldot|_2 / A.

The first line holds exactly if the actuator can always be stopped in time. In the second, T / 4 covers the
way between nodes: where lddot is a straight line that crosses zero, ldot peaks there. The last line is
optional. It keeps the platform from singular poses: tau is no shorter than the legs take to brake.
"""

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
    """Options of the optimal control problem and its solver.

    Args:
        objective: "J" for the cues at the cab, "perceived" for the perceived cues at the head.
        steps: Time steps of the machine (10 ms) from one node to the next; accelerations are straight
            lines between nodes. Raise it and a solve is faster, and sharp cues are cut off.
        window: Greatest length of a drive that is solved as a whole, s. Longer ones are solved in windows.
        keep: Part of each window that is applied before the next one begins, s; the rest is preview.
        force_zone: Indifference zone of specific force, m/s^2; as in J (Slob et al.).
        rate_zone: Indifference zone of angular velocity, rad/s; as in J.
        effort: Weight of the machine's own motion, so that axes that do the same share it. Raise it and the
            machine stays nearer to neutral, with a higher J.
        margin: Share of the limits of speed and acceleration that is kept free, for the way between nodes.
        widenings: How often a plan that meets a limit between nodes is solved again: with three times the
            margin, or, where it came near a singular pose, with the limit on clearance.
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


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PerceivedErrorFilter:
    """x' = A x + B e, y = C x + D e for the error e (6,) of force and rate; each signal has its own states.

    Its order is that of the published models: two for each otolith, three for each canal.

    Args:
        a: (m, m).
        b: (m, 6).
        c: (6, m).
        d: (6,) feedthrough.
        size: (m,) value of one unit of each state in the published filter's own states.
        place: (m,) index of each state in rows of three, one row a signal, as the simulator keeps them.
    """

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    size: Floats
    place: NDArray[np.int64]

    def next_state(self, filters: Floats, error: Floats) -> Floats:
        """(m,) the next states, from the filters' (6, 3), otoliths first, and the error (6,)."""
        return np.asarray(self.a @ (filters.ravel()[self.place] / self.size) + self.b @ error)


def perceived_error_filter(model: VestibularModel, dt: float) -> PerceivedErrorFilter:
    """The filter at a time step, s; its states are scaled to unit size under white noise."""
    otolith = discretize(*model.otoliths.transfer_function(), dt)
    canals = [discretize(*model.canals.transfer_function(axis), dt) for axis in range(3)]
    parts = [_scaled(part) for part in [otolith] * 3 + canals]
    a, b, c = (np.asarray(block_diag(*(part[i] for part in parts))) for i in range(3))
    sizes = [part[3] for part in parts]
    place = np.concatenate([3 * i + np.arange(len(size)) for i, size in enumerate(sizes)])
    d = np.array([part.d for part in [otolith] * 3 + canals])
    return PerceivedErrorFilter(a, b, c, d, np.concatenate(sizes), place)


def _scaled(part: DiscreteFilter) -> tuple[Floats, Floats, Floats, Floats]:
    """A (m, m), B (m, 1), C (1, m) without padding, and the size (m,) of states they are in."""
    m = int(np.count_nonzero(np.any(part.a != 0.0, axis=1)))
    a, b, c = part.a[:m, :m], part.b[:m, None], part.c[None, :m]
    size = np.sqrt(np.diag(solve_discrete_lyapunov(a, b @ b.T)))
    return a * size / size[:, None], b / size[:, None], c * size, size


_REACH: Final = (10.0, 10.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 10.0)
"""A large position of each axis, m and rad."""

_PACE: Final = (3.0, 3.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 1.0)
"""A large rate of each axis, m/s and rad/s."""

_PUSH: Final = (3.0, 3.0, 3.0, 3.0, 3.0, 2.0, 2.0, 2.0, 2.0)
"""A large acceleration of each axis, m/s^2 and rad/s^2."""


def effort(q: Expression, v: Expression, a: Expression, b: Expression) -> Expression:
    """Displacements, rates, accelerations and their changes on an interval, each in its large value."""
    parts = (q / cs.DM(_REACH), v / cs.DM(_PACE), 0.5 * (a + b) / cs.DM(_PUSH), (b - a) / cs.DM(_PUSH))
    return cs.vertcat(*parts)


N_CUES = 6
"""Specific force and angular velocity."""


@dataclass(frozen=True)
class Interval:
    """Expressions of the interval's symbols.

    Args:
        q: (9,) positions at its first node.
        v: (9,) rates there.
        x: (m,) states of the vestibular filters there, empty for J.
        a: (9,) accelerations there.
        b: (9,) accelerations at its last node.
        reference: (7, steps) reference cue at its samples, and 1, or 0 after the end of the drive.
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
    machine: SymbolicMachine, options: OptimumOptions, perceived: PerceivedErrorFilter | None, dt: float
) -> Interval:
    """The motion and the errors, filtered by perception if that is given, from one node to the next."""
    q, v, a, b = (cs.SX.sym(name, N_AXES) for name in "qvab")
    x = cs.SX.sym("x", 0 if perceived is None else len(perceived.a))
    reference = cs.SX.sym("reference_cue", N_CUES + 1, options.steps)
    cab = machine.platform.cab
    point = cs.DM(cab.reference_point) + (0.0 if options.objective == "J" else cs.DM(cab.head))
    zones = cs.DM([options.force_zone] * 3 + [options.rate_zone] * 3)
    position, rate, memory, errors = q, v, x, []
    for k in range(options.steps):
        mean = a + (b - a) * ((k + 0.5) / options.steps)
        position, rate = position + dt * (rate + 0.5 * dt * mean), rate + dt * mean
        error = (cs.vertcat(*cues(point, position, rate, mean)) - reference[:N_CUES, k]) / zones
        if perceived is not None:
            cue_error = error
            error = _sparse(perceived.c) @ memory + cs.DM(perceived.d) * cue_error
            memory = _sparse(perceived.a) @ memory + _sparse(perceived.b) @ cue_error
        errors.append(error * reference[N_CUES, k])
    return Interval(q, v, x, a, b, reference, cs.vertcat(position, rate, memory), cs.vertcat(*errors))


def _sparse(matrix: NDArray[np.float64]) -> Expression:
    return cs.sparsify(cs.DM(matrix))


_SPARE_CLEARANCE: Final = 0.03
"""Clearance beyond the machine's own limit, for the way between nodes."""

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
        widened: A wider share for everything but braking; default: ``margin``.
        clear: Whether to limit the clearance. Most motions come nowhere near a singular pose.
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
