"""The quadratic program of a plan: what it costs, and the limits as rows.

Unknown is the change of the accelerations at the nodes, one column for every axis that moves, flat by
node. Cost is the mean over the horizon of the squared cue error in zones, as J, and of the motion:

    1/2 sum_j w_j ( |y_j - wanted_j|^2 + position, rate and acceleration, weighted ) + end terms

with the cues y linearized. Every limit is a row whose violation has a price, so it always has a solution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...envs.platform import Platform, actuator_limits
from ...envs.simulator.simulator import N_AXES
from .parameters import AxisWeights, MpcParameters
from .prediction import N_CUES, Floats, Grid, Linearization, cue_scales

_TILT: slice = slice(3, 5)
"""Rows of the cab's roll and pitch rate among the cues."""


@dataclass(frozen=True)
class Plan:
    """Motion at n nodes, (n, 9) each: positions, rates and accelerations."""

    position: Floats
    rate: Floats
    acceleration: Floats


@dataclass(frozen=True)
class Quadratic:
    """1/2 z'Hz + g'z over z (m,) for ``hessian`` (m, m) and ``gradient`` (m,)."""

    hessian: Floats
    gradient: Floats


@dataclass(frozen=True)
class Bounds:
    """Bounds of the linearized rows, each (n, k), infinite where there is none.

    Args:
        lower: Least value.
        upper: Greatest.
        price: Cost of a violation, per unit; infinite where ``softness`` counts.
        softness: Reciprocal of the cost of half a violation's square; 0 where ``price`` counts.
    """

    lower: Floats
    upper: Floats
    price: Floats
    softness: Floats


class Problem:
    """Makes the program of one machine and one set of parameters.

    Args:
        platform: The machine.
        parameters: Of the controller.
        grid: Its nodes.
        perceived: (6, n, n) from the error of each cue at the nodes to that of what is sensed, or None.

    Attributes:
        axes: Axes that move, in the order of ``AXES``.
        size: Number of unknowns.
        motion_weights: (k, 3, n, n) on positions, rates and accelerations at the nodes, by moving axis.
    """

    def __init__(
        self, platform: Platform, parameters: MpcParameters, grid: Grid, perceived: Floats | None = None
    ) -> None:
        self.grid, self._parameters, self._perceived = grid, parameters, perceived
        self._cab_share = np.sqrt(parameters.cab_share)
        self.axes = moving_axes(platform)
        n, k = len(grid.times), len(self.axes)
        self.size = n * k
        weights = [_axis_weights(platform, parameters)[axis] for axis in self.axes]
        self.motion_weights = np.array([_motion_terms(grid, w) for w in weights])
        hessian = np.zeros((n, k, n, k))
        for i, (position, rate, acceleration) in enumerate(self.motion_weights):
            hessian[:, i, :, i] = (
                grid.position.T @ position @ grid.position + grid.rate.T @ rate @ grid.rate + acceleration
            )
        self._regular = hessian.reshape(n * k, n * k)
        self._scale = np.sqrt(grid.weights)[:, None]

    def cost(self, plan: Plan, about: Linearization, reference: Floats, sensed: Floats | None) -> Quadratic:
        """The cost about a plan.

        Args:
            plan: At the nodes.
            about: The machine linearized there.
            reference: (n, 6) the car's cues, SI.
            sensed: (n, 6) what the sensors' memory adds to the perceived error, in zones; None for none.
        """
        slope = self.condensed(about.slopes[:, :N_CUES])
        if self._perceived is not None:
            simulated = np.matmul(self._perceived, slope.transpose(1, 0, 2)).transpose(1, 0, 2)
            slope = np.concatenate([simulated, self._cab_share * slope], axis=1)
        residual = (self._scale * self._error(about, reference, sensed)).ravel()
        jacobian = (self._scale[:, :, None] * slope).reshape(len(residual), -1)
        return Quadratic(
            self._regular + jacobian.T @ jacobian, self._motion_gradient(plan) + residual @ jacobian
        )

    def merit(
        self, plan: Plan, about: Linearization, reference: Floats, sensed: Floats | None, bounds: Bounds
    ) -> float:
        """What a plan costs exactly, with the price of every limit it exceeds; see :meth:`cost`."""
        error = self._scale * self._error(about, reference, sensed)
        excess = np.maximum(np.maximum(about.values - bounds.upper, bounds.lower - about.values), 0.0)
        hard, soft = np.isfinite(bounds.price), bounds.softness > 0.0
        squares = np.sum(error**2) + np.sum(excess[soft] ** 2 / bounds.softness[soft])
        priced = bounds.price[hard] @ excess[hard]
        return float(0.5 * (squares + self._motion_cost(plan)) + priced)

    def _error(self, about: Linearization, reference: Floats, sensed: Floats | None) -> Floats:
        """(n, 6) error of the cues in zones; (n, 12) of what is sensed of them, and a share of themselves."""
        error = about.values[:, :N_CUES] - reference / cue_scales()
        if self._perceived is None:
            return np.asarray(error)
        simulated = np.einsum("cji,ic->jc", self._perceived, error)
        return np.hstack([simulated if sensed is None else simulated + sensed, self._cab_share * error])

    def condensed(self, slopes: Floats) -> Floats:
        """(n, r, m) derivatives of rows by the unknowns, from those by their node's motion (n, r, 27)."""
        n, rows = slopes.shape[:2]
        q, v, a = (slopes[:, :, N_AXES * i : N_AXES * (i + 1)][:, :, self.axes][:, :, None] for i in range(3))
        whole = q * self.grid.position[:, None, :, None] + v * self.grid.rate[:, None, :, None]
        nodes = np.arange(n)
        whole[nodes, :, nodes] += a[:, :, 0]
        return np.asarray(whole.reshape(n, rows, -1))

    def rows(self, slopes: Floats, chosen: NDArray[np.intp]) -> Floats:
        """(r, m) the same of some rows, numbered flat by node."""
        node, row = np.divmod(chosen, slopes.shape[1])
        picked = slopes[node, row].reshape(len(chosen), 3, N_AXES)[:, :, self.axes]
        q, v, a = picked[:, 0, None], picked[:, 1, None], picked[:, 2]
        whole = q * self.grid.position[node][:, :, None] + v * self.grid.rate[node][:, :, None]
        whole[np.arange(len(chosen)), node] += a
        return np.asarray(whole.reshape(len(chosen), -1))

    def change(self, unknowns: Floats) -> Plan:
        """What the unknowns (m,) add to a plan."""
        acceleration = np.zeros((len(self.grid.times), N_AXES))
        acceleration[:, self.axes] = unknowns.reshape(-1, len(self.axes))
        return Plan(self.grid.position @ acceleration, self.grid.rate @ acceleration, acceleration)

    def bounds(self, lower: Floats, upper: Floats, reference: Floats) -> Bounds:
        """Bounds of every row: the machine's limits, and the tilt rate beyond the car's own.

        Args:
            lower: (k - 6,) least values of the limit rows.
            upper: (k - 6,) greatest.
            reference: (n, 6) the car's cues, SI.
        """
        p, n = self._parameters, len(reference)
        free = np.full((n, N_CUES), np.inf)
        low, high, softness = -free, free.copy(), np.zeros((n, N_CUES))
        if p.tilt_rate.weight > 0.0:
            scale = cue_scales()[_TILT]
            own, limit = reference[:, _TILT] / scale, p.tilt_rate.limit / scale
            low[:, _TILT] = np.minimum(own, 0.0) - limit
            high[:, _TILT] = np.maximum(own, 0.0) + limit
            softness[:, _TILT] = 1.0 / (p.tilt_rate.weight * self.grid.weights[:, None])
        tiled = np.ones((n, 1))
        price = p.penalty * self.grid.weights[:, None] * np.ones((n, len(lower)))
        return Bounds(
            np.hstack([low, tiled * lower]),
            np.hstack([high, tiled * upper]),
            np.hstack([free, price]),
            np.hstack([softness, np.zeros((n, len(lower)))]),
        )

    def _motion_cost(self, plan: Plan) -> float:
        weighted = self._weighted(plan)
        return float(sum(np.sum(x[:, self.axes] * w) for x, w in zip(_parts(plan), weighted, strict=True)))

    def _motion_gradient(self, plan: Plan) -> Floats:
        q, v, a = self._weighted(plan)
        return np.asarray((self.grid.position.T @ q + self.grid.rate.T @ v + a).ravel())

    def _weighted(self, plan: Plan) -> list[Floats]:
        """Positions, rates and accelerations (n, k) times their weights."""
        return [
            (self.motion_weights[:, i] @ x[:, self.axes].T[:, :, None])[:, :, 0].T
            for i, x in enumerate(_parts(plan))
        ]


def _parts(plan: Plan) -> tuple[Floats, Floats, Floats]:
    return plan.position, plan.rate, plan.acceleration


def moving_axes(platform: Platform) -> NDArray[np.intp]:
    """Axes of the subsystems that a machine has."""
    limits = actuator_limits(platform)
    return np.flatnonzero(limits["position_max"] > limits["position_min"])


def _axis_weights(platform: Platform, parameters: MpcParameters) -> list[AxisWeights]:
    """By axis, in the order of ``AXES``. An unlimited turntable is nowhere away from neutral."""
    w = parameters.weights
    turntable = w.turntable
    if platform.turntable is not None and platform.turntable.travel is None:
        turntable = AxisWeights(0.0, turntable.rate, turntable.acceleration, 0.0, turntable.end_rate)
    return [w.carriage] * 2 + [w.translation] * 3 + [w.tilt] * 2 + [w.yaw, turntable]


def _motion_terms(grid: Grid, w: AxisWeights) -> Floats:
    """(3, n, n) weights on positions, rates and accelerations at the nodes."""
    along = np.diag(grid.weights)
    end = np.zeros_like(along)
    end[-1, -1] = 1.0 / grid.times[-1]
    return np.array(
        [
            w.position * along + w.end_position * end,
            w.rate * along + w.end_rate * end,
            w.acceleration * along,
        ]
    )
