"""From actions in [-1, 1] to the accelerations of the nine axes."""

from __future__ import annotations

from typing import Final

import warp as wp

from ..precision import real, vec9
from ..state import State

ACCELERATION = wp.constant(0)
JERK = wp.constant(1)
VELOCITY = wp.constant(2)
RESIDUAL = wp.constant(3)
GAINS = wp.constant(4)

MODES: Final = {"acceleration": 0, "jerk": 1, "velocity": 2, "residual": 3, "gains": 4}
"""The kernel's number of each mode of :class:`~.options.ActionOptions`."""


@wp.struct
class ActionScale:
    """What an action of 1 stands for, in the order of ``AXES``."""

    mode: int
    acceleration: vec9  # m/s^2, rad/s^2
    jerk: vec9  # m/s^3, rad/s^3
    velocity: vec9  # m/s, rad/s
    free: vec9  # 0 for a frozen axis, else 1


@wp.struct
class Command:
    """What an environment's actions have asked for."""

    acceleration: vec9
    clipped: int  # entries of the action outside [-1, 1]


@wp.func
def axis_rate(s: State, axis: int) -> real:
    """Speed of the set-point of an axis, in the order of ``AXES``."""
    if axis < 2:
        return s.setpoint.rate[axis]
    if axis < 5:
        return s.setpoint.velocity[axis - 2]
    if axis < 8:
        return s.setpoint.beta_rate[axis - 5]
    return s.setpoint.rate[8]


@wp.func
def asked(scale: ActionScale, axis: int, u: real, before: real, rate: real, dt: real) -> real:
    """Acceleration that an entry of an action asks for; ``before`` is what was asked for a step earlier."""
    largest = scale.acceleration[axis]
    if scale.mode == JERK:
        return wp.clamp(before + scale.jerk[axis] * u * dt, -largest, largest)
    if scale.mode == VELOCITY:
        return wp.clamp((scale.velocity[axis] * u - rate) / dt, -largest, largest)
    return largest * u


@wp.func
def take_action(
    action: wp.array2d(dtype=wp.float32),
    now: wp.array2d(dtype=wp.float32),
    before: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Keep the clipped action and the one before; returns how many entries were clipped."""
    clipped = int(0)
    for k in range(action.shape[1]):
        u = action[i, k]
        if wp.abs(u) > wp.float32(1.0):
            clipped = clipped + 1
        before[i, k] = now[i, k]
        now[i, k] = wp.clamp(u, wp.float32(-1.0), wp.float32(1.0))
    return clipped


@wp.func
def asked_accelerations(
    scale: ActionScale,
    s: State,
    now: wp.array2d(dtype=wp.float32),
    i: int,
    base: vec9,
    before: vec9,
    dt: real,
) -> vec9:
    """The accelerations an action asks for in a time step; ``before`` are those of the step before."""
    wanted = vec9()
    for k in range(9):
        if scale.mode == GAINS:
            wanted[k] = base[k]
        else:
            wanted[k] = asked(scale, k, real(now[i, k]), before[k], axis_rate(s, k), dt)
        if scale.mode == RESIDUAL:
            wanted[k] = wanted[k] + base[k]
        wanted[k] = wanted[k] * scale.free[k]
    return wanted
