"""Output limiting of one actuator, which brakes in time.

An actuator moves with constant acceleration over a step. Its state (q, v) is safe at an upper end
q_max if it can stop before it with the acceleration limit A, in whole steps:

    v <= 0 and q <= q_max,   or   v^2 / (2 A) + A dt^2 / 8 <= q_max - q.

The set is invariant: from every safe state a speed v' exists with |v' - v| <= A dt that leads to a
safe state again, so position, speed and acceleration limits hold together and for ever, and no end
of travel is met with a bump. Solving the condition of the next state for v' gives the bound of
:func:`braking_speed`. Between the limits the actuator does exactly what it is told.
"""

from __future__ import annotations

import warp as wp

from ..precision import real, vec2


@wp.func
def braking_speed(distance: real, speed: real, acceleration: real, dt: real) -> real:
    """Greatest speed towards an end of travel ``distance`` away, after a step begun at ``speed``."""
    half_step = real(0.5) * acceleration * dt
    room = distance - real(0.5) * speed * dt
    # The threshold is where the root equals the half step; below it only standing still is safe.
    if room <= half_step * dt * real(0.25):
        return real(0.0)
    return wp.sqrt(real(2.0) * acceleration * room) - half_step


@wp.func
def rate_bounds(
    q: real, v: real, q_min: real, q_max: real, velocity: real, acceleration: real, dt: real
) -> vec2:
    """Least and greatest speed at the end of the step that keep the actuator within all its limits."""
    upper = wp.min(velocity, braking_speed(q_max - q, v, acceleration, dt))
    lower = -wp.min(velocity, braking_speed(q - q_min, -v, acceleration, dt))
    return vec2(
        wp.min(wp.max(lower, v - acceleration * dt), v + acceleration * dt),
        wp.max(wp.min(upper, v + acceleration * dt), v - acceleration * dt),
    )


@wp.func
def is_safe(q: real, v: real, q_min: real, q_max: real, acceleration: real, dt: real) -> bool:
    """Whether (q, v) lies in the safe set of both ends."""
    distance = q_max - q
    if v < real(0.0):
        distance = q - q_min
    needed = real(0.0)
    if v != real(0.0):
        needed = real(0.5) * v * v / acceleration + real(0.125) * acceleration * dt * dt
    return distance >= needed and q >= q_min and q <= q_max


@wp.func
def active_limit(
    asked: real, q: real, v: real, q_min: real, q_max: real, velocity: real, acceleration: real, dt: real
) -> int:
    """Which limit holds back the speed ``asked`` for: 0 none, 1 end of travel, 2 velocity, 4 acceleration."""
    bounds = rate_bounds(q, v, q_min, q_max, velocity, acceleration, dt)
    if asked >= bounds[0] and asked <= bounds[1]:
        return 0
    ahead = q_max - q
    towards = v
    bound = bounds[1]
    if asked < bounds[0]:
        ahead = q - q_min
        towards = -v
        bound = -bounds[0]
    if braking_speed(ahead, towards, acceleration, dt) <= wp.min(velocity, bound):
        return 1
    if bound >= velocity:
        return 2
    return 4
