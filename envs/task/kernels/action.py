"""From actions in [-1, 1] to the accelerations of the nine axes."""

from __future__ import annotations

from typing import Final

import warp as wp

from ...arrays import real, vec9
from ...platform.kernels.step import Motion
from .observation import to_cab, to_machine

ACCELERATION = wp.constant(0)
JERK = wp.constant(1)
VELOCITY = wp.constant(2)
RESIDUAL = wp.constant(3)
GAINS = wp.constant(4)

MODES: Final = {"acceleration": 0, "jerk": 1, "velocity": 2, "residual": 3, "gains": 4}
"""The kernel's number of each mode of :class:`~.options.ActionOptions`."""


@wp.struct
class AxisScale:
    """What an action of 1 stands for on a machine, in the order of ``AXES``."""

    acceleration: vec9  # m/s^2, rad/s^2
    jerk: vec9  # m/s^3, rad/s^3
    velocity: vec9  # m/s, rad/s


@wp.struct
class ActionScale:
    """What an action stands for."""

    mode: int
    axes: wp.array(dtype=AxisScale)  # on each machine
    free: vec9  # 0 for a frozen axis, else 1
    cab_frame: int  # whether an action is turned with the cab's heading


@wp.func
def axis_rates(m: Motion) -> vec9:
    """Speeds in the order of ``AXES``."""
    v = m.velocity
    b = m.beta_rate
    return vec9(m.rate[0], m.rate[1], v[0], v[1], v[2], b[0], b[1], b[2], m.rate[8])


@wp.func
def asked(mode: int, scale: AxisScale, axis: int, u: real, before: real, rate: real, dt: real) -> real:
    """Acceleration that an entry of an action asks for; ``before`` is what was asked for a step earlier."""
    largest = scale.acceleration[axis]
    if mode == JERK:
        return wp.clamp(before + scale.jerk[axis] * u * dt, -largest, largest)
    if mode == VELOCITY:
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
def own_accelerations(
    scale: ActionScale,
    which: int,
    m: Motion,
    now: wp.array2d(dtype=wp.float32),
    i: int,
    before: vec9,
    dt: real,
) -> vec9:
    """The accelerations an action itself asks for in a time step, in its frame.

    ``which`` is the number of the machine, ``m`` are its set-points, ``before`` is what was asked for in the
    step before.
    """
    if scale.mode == GAINS:
        return vec9()
    rates = axis_rates(m)
    if scale.cab_frame != 0:
        rates = to_cab(m, rates)
    axes = scale.axes[which]
    return vec9(
        asked(scale.mode, axes, 0, real(now[i, 0]), before[0], rates[0], dt),
        asked(scale.mode, axes, 1, real(now[i, 1]), before[1], rates[1], dt),
        asked(scale.mode, axes, 2, real(now[i, 2]), before[2], rates[2], dt),
        asked(scale.mode, axes, 3, real(now[i, 3]), before[3], rates[3], dt),
        asked(scale.mode, axes, 4, real(now[i, 4]), before[4], rates[4], dt),
        asked(scale.mode, axes, 5, real(now[i, 5]), before[5], rates[5], dt),
        asked(scale.mode, axes, 6, real(now[i, 6]), before[6], rates[6], dt),
        asked(scale.mode, axes, 7, real(now[i, 7]), before[7], rates[7], dt),
        asked(scale.mode, axes, 8, real(now[i, 8]), before[8], rates[8], dt),
    )


@wp.func
def applied_accelerations(scale: ActionScale, m: Motion, own: vec9, base: vec9) -> vec9:
    """What the axes are told: ``own`` accelerations in the machine's frame, with the base policy's."""
    if scale.mode == GAINS:
        return wp.cw_mul(base, scale.free)
    reference = own
    if scale.cab_frame != 0:
        reference = to_machine(m, own)
    if scale.mode == RESIDUAL:
        reference = reference + base
    return wp.cw_mul(reference, scale.free)
