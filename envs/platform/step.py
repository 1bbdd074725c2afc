"""One step of the machine: nine accelerations in, the true motion out.

    command -> limited set-point -> dead time -> lag -> true motion

The set-point starts each step where limiting left it, so a command never winds up. Carriage and
turntable are limited axis by axis. A hexapod command is followed exactly where every leg may; else each
leg goes as far towards it as its limits allow and the platform goes where forward kinematics says.
"""

from __future__ import annotations

import warp as wp

from ..precision import real, vec3, vec6, vec9
from .actuators import lag, subsystem
from .hexapod import forward_kinematics, leg_extensions, leg_jacobian, leg_rates, platform_rates
from .limiter import active_limit, is_safe, rate_bounds
from .singularity import keeps_clear
from .state import Machine, Motion, SetPoint, Step


@wp.struct
class Bounds:
    """Least and greatest speed of every actuator after a step, by :func:`~.limiter.rate_bounds`."""

    lower: vec9
    upper: vec9


@wp.func
def all_bounds(m: Machine, start: Motion, dt: real) -> Bounds:
    """The bounds of all actuators."""
    lower = vec9()
    upper = vec9()
    for i in range(9):
        pair = rate_bounds(
            start.position[i],
            start.rate[i],
            m.position_min[i],
            m.position_max[i],
            m.velocity[i],
            m.acceleration[i],
            dt,
        )
        lower[i] = pair[0]
        upper[i] = pair[1]
    bounds = Bounds()
    bounds.lower = lower
    bounds.upper = upper
    return bounds


@wp.func
def limit_flag(m: Machine, start: Motion, bounds: Bounds, i: int, asked: real, dt: real) -> wp.uint64:
    """The limit actuator ``i`` meets, as its four bits of :class:`Step`'s mask; none for a missing one."""
    if (asked >= bounds.lower[i] and asked <= bounds.upper[i]) or m.position_max[i] <= m.position_min[i]:
        return wp.uint64(0)
    code = active_limit(
        asked,
        start.position[i],
        start.rate[i],
        m.position_min[i],
        m.position_max[i],
        m.velocity[i],
        m.acceleration[i],
        dt,
    )
    return wp.lshift(wp.uint64(code), wp.uint64(4 * i))


@wp.func
def limited_rate(bounds: Bounds, i: int, asked: real) -> real:
    """Speed of actuator ``i`` nearest the one asked for that keeps its limits."""
    return wp.min(wp.max(asked, bounds.lower[i]), bounds.upper[i])


@wp.func
def legs_may_follow(m: Machine, bounds: Bounds, extensions: vec6, rates: vec6, dt: real) -> bool:
    """Whether every leg can be at these extensions and rates after the step, and stop in time thereafter."""
    may = bool(True)
    for i in range(6):
        k = i + 2
        if rates[i] < bounds.lower[k] or rates[i] > bounds.upper[k]:
            may = False
        if not is_safe(extensions[i], rates[i], m.position_min[k], m.position_max[k], m.acceleration[k], dt):
            may = False
    return may


@wp.func
def joined(carriage_x: real, carriage_y: real, legs: vec6, turntable: real) -> vec9:
    """The nine actuators of their parts."""
    return vec9(carriage_x, carriage_y, legs[0], legs[1], legs[2], legs[3], legs[4], legs[5], turntable)


@wp.func
def legs_of(actuators: vec9) -> vec6:
    """The six legs among the nine actuators."""
    return vec6(actuators[2], actuators[3], actuators[4], actuators[5], actuators[6], actuators[7])


@wp.func
def with_legs(motion: Motion, extensions: vec6, rates: vec6) -> Motion:
    """A motion with its legs replaced."""
    after = motion
    after.position = joined(motion.position[0], motion.position[1], extensions, motion.position[8])
    after.rate = joined(motion.rate[0], motion.rate[1], rates, motion.rate[8])
    return after


@wp.func
def with_pose(motion: Motion, pose: vec6, pose_rate: vec6) -> Motion:
    """A motion with the platform's pose replaced."""
    after = motion
    after.displacement = vec3(pose[0], pose[1], pose[2])
    after.beta = vec3(pose[3], pose[4], pose[5])
    after.velocity = vec3(pose_rate[0], pose_rate[1], pose_rate[2])
    after.beta_rate = vec3(pose_rate[3], pose_rate[4], pose_rate[5])
    return after


@wp.func
def pose_from_legs(m: Machine, motion: Motion, guess: Motion) -> Motion:
    """The motion whose pose and rates follow from its legs, by forward kinematics from a neighbouring one."""
    pose = forward_kinematics(m.geometry, legs_of(motion.position), guess.displacement, guess.beta)
    beta = vec3(pose[3], pose[4], pose[5])
    jacobian = leg_jacobian(m.geometry, vec3(pose[0], pose[1], pose[2]), beta)
    return with_pose(motion, pose, platform_rates(jacobian, beta, legs_of(motion.rate)))


@wp.func
def legs_towards(m: Machine, start: Motion, bounds: Bounds, target: Motion, rates: vec6, dt: real) -> Motion:
    """``target`` with each leg brought as near to its rate as its limits allow, and the pose that follows."""
    extensions = vec6()
    limited = vec6()
    for i in range(6):
        limited[i] = limited_rate(bounds, i + 2, rates[i])
        extensions[i] = start.position[i + 2] + real(0.5) * dt * (start.rate[i + 2] + limited[i])
    return pose_from_legs(m, with_legs(target, extensions, limited), start)


@wp.func
def limited_legs(m: Machine, start: Motion, bounds: Bounds, target: Motion, rates: vec6, dt: real) -> Motion:
    """Legs towards their asked rates, or braking to rest where that would lead into a singular pose."""
    moved = legs_towards(m, start, bounds, target, rates, dt)
    s = moved.displacement
    b = moved.beta
    jacobian = leg_jacobian(m.geometry, s, b)
    if keeps_clear(m, start, jacobian, s, b, legs_of(moved.position), legs_of(moved.rate)):
        return moved
    return legs_towards(m, start, bounds, target, vec6(), dt)


@wp.func
def limit_axes(start: Motion, bounds: Bounds, action: vec9, dt: real) -> Motion:
    """Carriage and turntable after the step, each within its own limits; the hexapod as it was."""
    half = real(0.5) * dt
    x = limited_rate(bounds, 0, start.rate[0] + action[0] * dt)
    y = limited_rate(bounds, 1, start.rate[1] + action[1] * dt)
    t = limited_rate(bounds, 8, start.rate[8] + action[8] * dt)
    after = start
    after.rate = joined(x, y, legs_of(start.rate), t)
    after.position = joined(
        start.position[0] + half * (start.rate[0] + x),
        start.position[1] + half * (start.rate[1] + y),
        legs_of(start.position),
        start.position[8] + half * (start.rate[8] + t),
    )
    return after


@wp.func
def command(m: Machine, start: Motion, action: vec9, dt: real) -> Step:
    """The set-point after a step with nine accelerations, within all limits."""
    half = real(0.5) * dt
    linear = vec3(action[2], action[3], action[4])
    angular = vec3(action[5], action[6], action[7])
    velocity = start.velocity + linear * dt
    beta_rate = start.beta_rate + angular * dt
    displacement = start.displacement + (start.velocity + velocity) * half
    beta = start.beta + (start.beta_rate + beta_rate) * half

    bounds = all_bounds(m, start, dt)
    after = limit_axes(start, bounds, action, dt)
    jacobian = leg_jacobian(m.geometry, displacement, beta)
    extensions = leg_extensions(m.geometry, displacement, beta)
    rates = leg_rates(jacobian, velocity, beta, beta_rate)
    clear = keeps_clear(m, start, jacobian, displacement, beta, extensions, rates)
    mask = command_limits(m, start, bounds, action, rates, clear, dt)
    if legs_may_follow(m, bounds, extensions, rates, dt) and clear:
        after = with_legs(after, extensions, rates)
        after.displacement = displacement
        after.velocity = velocity
        after.beta = beta
        after.beta_rate = beta_rate
    else:
        after = limited_legs(m, start, bounds, after, rates, dt)

    result = Step()
    result.motion = after
    result.limits = mask
    return result


@wp.func
def command_limits(
    m: Machine, start: Motion, bounds: Bounds, action: vec9, leg_rates_asked: vec6, clear: bool, dt: real
) -> wp.uint64:
    """Which limits a command meets, as :class:`Step`'s mask."""
    mask = wp.uint64(0)
    for i in range(9):
        asked = start.rate[i] + action[i] * dt
        if i >= 2 and i < 8:
            asked = leg_rates_asked[i - 2]
            if not clear:
                mask = mask | wp.lshift(wp.uint64(8), wp.uint64(4 * i))
        mask = mask | limit_flag(m, start, bounds, i, asked, dt)
    return mask


@wp.func
def mean_acceleration(before: Motion, after: Motion, dt: real) -> vec9:
    """Accelerations of the nine degrees of freedom over a step, in the order of AXES."""
    linear = (after.velocity - before.velocity) / dt
    angular = (after.beta_rate - before.beta_rate) / dt
    return vec9(
        (after.rate[0] - before.rate[0]) / dt,
        (after.rate[1] - before.rate[1]) / dt,
        linear[0],
        linear[1],
        linear[2],
        angular[0],
        angular[1],
        angular[2],
        (after.rate[8] - before.rate[8]) / dt,
    )


@wp.func
def actuate(
    m: Machine,
    motion: Motion,
    delay: wp.array2d(dtype=SetPoint),
    environment: int,
    setpoint: Motion,
    dt: real,
) -> Motion:
    """The true motion after a step: the set-point after dead time and lag.

    ``delay[environment, k]`` is the set-point k + 1 steps before ``setpoint``.
    """
    if m.has_dynamics == 0:
        return setpoint
    after = motion
    # New vectors: changing entries of a copied one loses gradients in Warp.
    position = vec9()
    rate = vec9()
    for i in range(9):
        k = subsystem(i)
        steps = m.dead_steps[k]
        begin = delay[environment, steps]
        later_position = setpoint.position[i]
        later_rate = setpoint.rate[i]
        if steps > 0:
            later = delay[environment, steps - 1]
            later_position = later.position[i]
            later_rate = later.rate[i]
        if m.lags[k] == 0:
            position[i] = later_position
            rate[i] = later_rate
        else:
            y = lag(
                m, i, motion.position[i], motion.rate[i], begin.position[i], begin.rate[i], later_rate, dt
            )
            position[i] = y[0]
            rate[i] = y[1]
    after.position = position
    after.rate = rate
    if m.lags[1] == 0 and m.dead_steps[1] == 0:
        after.displacement = setpoint.displacement
        after.velocity = setpoint.velocity
        after.beta = setpoint.beta
        after.beta_rate = setpoint.beta_rate
        return after
    return pose_from_legs(m, after, motion)
