"""The headline cost of a moment: how far what is felt lies from what is wanted, in indifference zones."""

from __future__ import annotations

import math
from typing import Any

import warp as wp

from .precision import real, vec3
from .settings import Positive, configuration
from .state import State


@configuration
class CueCost:
    """|df|^2 / force^2 + |dw|^2 / rate^2, whose mean over time is J.

    The defaults are the published indifference zone (Slob et al., Bosch Rexroth).

    Args:
        force: Error of specific force no driver minds, m/s^2.
        rate: Error of angular velocity no driver minds, rad/s.
    """

    force: Positive = 0.6
    rate: Positive = math.radians(3.0)


@wp.struct
class Zone:
    """The kernel's form of :class:`CueCost`."""

    force: real
    rate: real


def zone(cost: CueCost) -> Any:
    """The kernel's form of a cost."""
    values: Any = Zone()
    values.force, values.rate = cost.force, cost.rate
    return values


@wp.func
def error(z: Zone, force: vec3, wanted_force: vec3, rate: vec3, wanted_rate: vec3) -> real:
    """The cost of a pair of signals."""
    df = (force - wanted_force) / z.force
    dw = (rate - wanted_rate) / z.rate
    return wp.dot(df, df) + wp.dot(dw, dw)


@wp.func
def cue_error(z: Zone, s: State) -> real:
    """The cost of what is felt at the cab's reference point."""
    return error(z, s.felt.force, s.wanted.force, s.felt.rate, s.wanted.rate)


@wp.func
def perceived_error(z: Zone, s: State) -> real:
    """The cost of what the driver senses."""
    return error(z, s.sensed_felt.force, s.sensed_wanted.force, s.sensed_felt.rate, s.sensed_wanted.rate)
