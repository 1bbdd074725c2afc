"""Canals and otoliths as state-space filters inside the step kernel."""

from __future__ import annotations

from typing import Any

import warp as wp

from ..arrays import mat33, real, vec3
from .models import DiscreteFilter, VestibularModel, discretize


@wp.struct
class ThirdOrder:
    """Coefficients of one filter, see :class:`~.models.DiscreteFilter`."""

    a: mat33
    b: vec3
    c: vec3
    d: real
    rest: vec3


@wp.struct
class Vestibular:
    """Coefficients of a whole model: a canal for each axis, one otolith for all."""

    canal_x: ThirdOrder
    canal_y: ThirdOrder
    canal_z: ThirdOrder
    otolith: ThirdOrder


@wp.struct
class VestibularState:
    """Filter states, one row an axis."""

    canals: mat33
    otoliths: mat33


@wp.struct
class Perceived:
    """Perceived cues: specific force (m/s^2, at unit static gain) and angular velocity (rad/s)."""

    force: vec3
    rate: vec3


@wp.func
def output(filter: ThirdOrder, x: vec3, u: real) -> real:
    """Output now: y = C x + D u."""
    return wp.dot(filter.c, x) + filter.d * u


@wp.func
def advance(filter: ThirdOrder, x: vec3, u: real) -> vec3:
    """State one sample later: x' = A x + B u."""
    return filter.a * x + filter.b * u


@wp.func
def row(m: mat33, i: int) -> vec3:
    """Row ``i`` of a matrix."""
    return vec3(m[i, 0], m[i, 1], m[i, 2])


@wp.func
def perceive(v: Vestibular, x: VestibularState, force: vec3, rate: vec3) -> Perceived:
    """Perceived cues of the specific force and angular velocity at the head now."""
    perceived = Perceived()
    perceived.force = vec3(
        output(v.otolith, row(x.otoliths, 0), force[0]),
        output(v.otolith, row(x.otoliths, 1), force[1]),
        output(v.otolith, row(x.otoliths, 2), force[2]),
    )
    perceived.rate = vec3(
        output(v.canal_x, row(x.canals, 0), rate[0]),
        output(v.canal_y, row(x.canals, 1), rate[1]),
        output(v.canal_z, row(x.canals, 2), rate[2]),
    )
    return perceived


@wp.func
def advance_vestibular(v: Vestibular, x: VestibularState, force: vec3, rate: vec3) -> VestibularState:
    """The filter states one sample later."""
    after = VestibularState()
    after.otoliths = wp.matrix_from_rows(
        advance(v.otolith, row(x.otoliths, 0), force[0]),
        advance(v.otolith, row(x.otoliths, 1), force[1]),
        advance(v.otolith, row(x.otoliths, 2), force[2]),
    )
    after.canals = wp.matrix_from_rows(
        advance(v.canal_x, row(x.canals, 0), rate[0]),
        advance(v.canal_y, row(x.canals, 1), rate[1]),
        advance(v.canal_z, row(x.canals, 2), rate[2]),
    )
    return after


@wp.func
def rested(v: Vestibular, force: vec3, rate: vec3) -> VestibularState:
    """The state after constant signals that have lasted for ever."""
    x = VestibularState()
    x.otoliths = wp.matrix_from_rows(
        v.otolith.rest * force[0], v.otolith.rest * force[1], v.otolith.rest * force[2]
    )
    x.canals = wp.matrix_from_rows(
        v.canal_x.rest * rate[0], v.canal_y.rest * rate[1], v.canal_z.rest * rate[2]
    )
    return x


def vestibular_parameters(model: VestibularModel, dt: float) -> Any:
    """The kernel's :class:`Vestibular` of a model at a time step, s."""
    parameters: Any = Vestibular()
    for axis, name in enumerate(("canal_x", "canal_y", "canal_z")):
        setattr(parameters, name, _third_order(discretize(*model.canals.transfer_function(axis), dt)))
    parameters.otolith = _third_order(discretize(*model.otoliths.transfer_function(), dt))
    return parameters


def _third_order(discrete: DiscreteFilter) -> Any:
    coefficients: Any = ThirdOrder()
    coefficients.a = mat33(*discrete.a.ravel())
    coefficients.b = vec3(*discrete.b)
    coefficients.c = vec3(*discrete.c)
    coefficients.d = discrete.d
    coefficients.rest = vec3(*discrete.rest)
    return coefficients
