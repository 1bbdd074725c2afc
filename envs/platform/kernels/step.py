"""The step of the motion base: nine accelerations in, the true motion out, all limits kept.

    command -> limited set-point -> dead time -> lag -> true motion

**Set-point.** Each step begins where limiting left it, so a command never winds up. Carriage and turntable
are limited axis by axis. A hexapod command is followed exactly where every leg may; else each leg goes as
far towards it as its limits allow, and the platform goes where forward kinematics says. Where that finds
no pose, the platform holds its last one and the legs stop at once: an emergency stop, marked by :data:`HELD`.

**Limits.** An actuator moves with constant acceleration over a step. Its state (q, v) is safe at an upper end
q_max if it can stop before it with the acceleration limit A, in whole steps:

    v <= 0 and q <= q_max,   or   v^2 / (2 A) + A dt^2 / 8 <= q_max - q.

The set is invariant: from every safe state a speed v' exists with |v' - v| <= A dt that leads to a safe
state again. So position, speed and acceleration limits hold together and forever, and no end of travel is
met with a bump. Solving the condition of the next state for v' gives the bound of :func:`braking_speed`.

**Braking without a kick.** Where the machine bounds the jerk J of braking, the state (q, v) after a step is
safe at an upper end only if the actuator can stop there while its acceleration changes by at most J dt a
step. From the acceleration a of the step, braking goes to a peak, holds -A where that is reached, and ends
with speed and acceleration 0 together. It takes

    D = (w a - a^3 / 6 + g) / J^2,  w = J v + a^2 / 2,  g = w^(3/2) up to w = A^2, then (A w + w^2 / A) / 2,

and D <= q_max - A dt^2 / 8 - q is required. As a is constant within a step, it counts as J dt / 2 more than
it is. This set is invariant, too: from each of its states a next one is reached by lowering a by no more
than J dt. A speed limit V is approached likewise, with v + a^2 / (2 J) <= V. A command that leads to a safe
state is followed to the last bit, whatever its jerk; else each actuator takes the nearest safe acceleration.
From then until the command is met again, the felt force, too, goes towards it with bounded jerk, so that the
free actuators do not jump where the held ones do not balance them. The limits of the paragraph above hold
beside this.

**Actuators.** A second-order lag and a dead time for each subsystem; none by default, as in the paper. The
lag omega^2 / (s^2 + 2 zeta omega s + omega^2) has zeta >= 1, so its impulse response is nowhere negative:
position, speed and acceleration of the machine are weighted means of those of the set-point, and keep every
limit the set-point keeps. For a set-point of constant acceleration within a step the lag is discretized
exactly.
"""

from __future__ import annotations

from typing import Final

import warp as wp

from ...arrays import mat65, real, vec2, vec3, vec6, vec7, vec9
from ..kinematics import NEARLY_SINGULAR, NEIGHBORHOOD
from ..machines import ACTUATORS as ACTUATORS
from ..machines import AXES as AXES
from .geometry import (
    NEWTON_TOLERANCE,
    HexapodGeometry,
    Jacobian,
    determinant,
    forward_kinematics,
    leg_extensions,
    leg_jacobian,
    leg_rates,
    platform_rates,
    rate_matrix,
    rotation,
    turntable_rotation,
)


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
def stopping_distance(speed: real, acceleration: real, greatest: real, jerk: real) -> real:
    """Way to standstill with bounded jerk; 0 where the actuator moves away from the end and stays so.

    Args:
        speed: Towards the end.
        acceleration: Towards it, now.
        greatest: Acceleration limit.
        jerk: Greatest change of acceleration over time.
    """
    w = jerk * speed + real(0.5) * acceleration * acceleration
    if acceleration < real(0.0) and w < acceleration * acceleration:
        # It brakes harder than it need: the speed is gone before the acceleration has returned to 0.
        if speed <= real(0.0):
            return real(0.0)
        left = wp.sqrt(real(2.0) * (acceleration * acceleration - w))
        gone = -acceleration - left
        return gone * gone * (real(2.0) * left - acceleration) / (real(6.0) * jerk * jerk)
    if w <= real(0.0):
        return real(0.0)
    braking = w * wp.sqrt(w)
    if w > greatest * greatest:
        braking = real(0.5) * (greatest * w + w * w / greatest)
    cubic = acceleration * acceleration * acceleration / real(6.0)
    return (w * acceleration - cubic + braking) / (jerk * jerk)


@wp.func
def resting_way(rate: real, acceleration: real, greatest: real, jerk: real) -> real:
    """Way to rest with bounded jerk, with its sign: speed and acceleration end at 0 together."""
    ahead = wp.sign(jerk * rate + real(0.5) * acceleration * wp.abs(acceleration))
    return ahead * stopping_distance(ahead * rate, ahead * acceleration, greatest, jerk)


@wp.func
def resting_rate(rate: real, acceleration: real, greatest: real, jerk: real, dt: real) -> real:
    """Rate after the next step of braking to rest with bounded jerk.

    The acceleration p that returns to 0 in steps of J dt as the rate does has p^2 + p J dt = 2 J |rate|.
    """
    step = jerk * dt
    speed = wp.abs(rate)
    peak = real(0.5) * (wp.sqrt(step * step + real(8.0) * jerk * speed) - step)
    peak = wp.min(wp.min(peak, speed / dt), greatest)
    braking = wp.clamp(-wp.sign(rate) * peak, acceleration - step, acceleration + step)
    return rate + wp.clamp(braking, -greatest, greatest) * dt


@wp.func
def stopping_slopes(speed: real, acceleration: real, greatest: real, jerk: real) -> vec2:
    """Derivatives of :func:`stopping_distance` by speed and by acceleration."""
    w = jerk * speed + real(0.5) * acceleration * acceleration
    if acceleration < real(0.0) and w < acceleration * acceleration:
        if speed <= real(0.0):
            return vec2(real(0.0), real(0.0))
        gone = -acceleration - wp.sqrt(real(2.0) * (acceleration * acceleration - w))
        return vec2(gone / jerk, real(0.5) * gone * gone / (jerk * jerk))
    if w <= real(0.0):
        return vec2(real(0.0), real(0.0))
    slope = acceleration + real(1.5) * wp.sqrt(w)
    if w > greatest * greatest:
        slope = acceleration + real(0.5) * greatest + w / greatest
    return vec2(slope / jerk, (jerk * speed + slope * acceleration) / (jerk * jerk))


@wp.func
def stops_in_time(room: real, speed: real, acceleration: real, greatest: real, jerk: real, dt: real) -> bool:
    """Whether an actuator still stops within ``room`` after a step with this acceleration."""
    after = speed + acceleration * dt
    left = room - real(0.5) * (speed + after) * dt
    eased = acceleration + real(0.5) * jerk * dt
    return left >= real(0.0) and stopping_distance(after, eased, greatest, jerk) <= left


BISECTIONS = wp.constant(45 if real is wp.float64 else 22)
"""Halvings of the acceleration that just stops in time: to the precision of a number."""


@wp.func
def eased_acceleration(room: real, speed: real, greatest: real, jerk: real, dt: real) -> real:
    """Greatest acceleration towards an end of travel from which :func:`stops_in_time` holds.

    Where none does, the one that brings the actuator to rest, as far as its limit allows.
    """
    least = wp.max(-greatest, -wp.max(speed, real(0.0)) / dt - real(0.5) * jerk * dt)
    most = greatest
    for _ in range(BISECTIONS):
        middle = real(0.5) * (least + most)
        if stops_in_time(room, speed, middle, greatest, jerk, dt):
            least = middle
        else:
            most = middle
    return least


@wp.func_grad(eased_acceleration)
def adjoint_eased_acceleration(
    room: real, speed: real, greatest: real, jerk: real, dt: real, adjoint: real
) -> None:
    """Implicit function theorem: the stopping distance after the step equals the room that is left."""
    acceleration = eased_acceleration(room, speed, greatest, jerk, dt)
    slopes = stopping_slopes(speed + acceleration * dt, acceleration + real(0.5) * jerk * dt, greatest, jerk)
    by_acceleration = slopes[0] * dt + slopes[1] + real(0.5) * dt * dt
    wp.adjoint[room] += adjoint / by_acceleration
    wp.adjoint[speed] += -adjoint * (slopes[0] + dt) / by_acceleration


@wp.func
def eased_speed(speed: real, velocity: real, acceleration: real, jerk: real, dt: real) -> real:
    """Greatest speed after a step from which the speed limit is approached with bounded jerk."""
    step = jerk * dt
    most = wp.sqrt(step * step + real(2.0) * jerk * wp.max(velocity - speed, real(0.0))) - step
    return speed + wp.min(most, acceleration) * dt


@wp.func
def eased_rate(
    distance: real, speed: real, requested: real, velocity: real, acceleration: real, jerk: real, dt: real
) -> real:
    """The speed requested towards an end of travel, or the greatest that brakes with bounded jerk."""
    room = distance - real(0.125) * acceleration * dt * dt
    rate = wp.min(requested, eased_speed(speed, velocity, acceleration, jerk, dt))
    # At rest within the last tenth of a millimeter: no motion is needed to stop.
    if room < real(0.0) and speed <= real(0.0):
        return rate
    if not stops_in_time(room, speed, (rate - speed) / dt, acceleration, jerk, dt):
        rate = speed + eased_acceleration(room, speed, acceleration, jerk, dt) * dt
    return rate


@wp.func
def has_room(
    q: real,
    v: real,
    requested: real,
    q_min: real,
    q_max: real,
    velocity: real,
    greatest: real,
    jerk: real,
    dt: real,
) -> bool:
    """Whether an actuator is so far from all limits that any braking fits: a quick test of both ends.

    It takes g of the stopping distance for (A w + w^2 / A) / 2, which is never less.
    """
    acceleration = wp.abs(requested - v) / dt
    eased = acceleration + real(0.5) * jerk * dt
    speed = wp.abs(requested)
    w = jerk * speed + real(0.5) * eased * eased
    room = wp.min(q_max - q, q - q_min) - (wp.abs(v) + speed + greatest * dt) * dt
    near_speed = w > jerk * velocity
    return (
        acceleration <= greatest
        and not near_speed
        and w * (eased + real(0.5) * (greatest + w / greatest)) <= room * jerk * jerk
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


CARRIAGE = slice(0, 2)
LEGS = slice(2, 8)
TURNTABLE = 8
"""Order of the nine actuators: carriage x and y, legs 1 to 6, turntable."""

END_OF_TRAVEL: Final = 0x111111111
"""Bits of a step's limits that say an end of travel, one for each actuator."""

SINGULAR: Final = 0x888888888
"""Bits that say a nearly singular pose."""

CLOSES = wp.constant(real(1e-10 if real is wp.float64 else 1e-5))
"""Largest leg error of a pose that closes, m."""

HELD: Final = 1 << 36
"""Bit that says an emergency stop: the legs have no pose near the last one, which is held."""

EASED: Final = 1 << 37
"""Bit that says that the command is approached with bounded jerk, as a limit holds or has let go."""

_EMERGENCY_STOP: Final = HELD | 0x088888800


@wp.struct
class Machine:
    """Constants of one machine. Actuator vectors are in the order of :data:`ACTUATORS`."""

    geometry: HexapodGeometry
    neutral_determinant: real  # det(J) at neutral
    far_from_singular: real  # clearance from which braking leads to no singular pose; infinite where unknown
    position_min: vec9  # m, m, 6 x m, rad
    position_max: vec9
    velocity: vec9  # m/s, rad/s
    acceleration: vec9  # m/s^2, rad/s^2
    jerk: vec9  # with which limits brake, m/s^3, rad/s^3; 0 for any
    felt_jerk: real  # while a limit is active, m/s^3; 0 for any
    cab: vec3  # D_o: reference point of the cab from the turntable's axis, turntable at 0
    head: vec3  # D_o + OP_SS: the driver's head
    lag: mat65  # transition of the three actuator dynamics, see actuators.py
    lags: wp.vec3i  # whether carriage, legs, turntable lag
    dead_steps: wp.vec3i  # their dead times in steps
    has_dynamics: int  # whether any of them lags or has a dead time


@wp.struct
class Motion:
    """Where the machine is and how fast it moves."""

    position: vec9  # of the actuators: m, 6 x m from neutral, rad
    rate: vec9
    displacement: vec3  # s: origin of F_H from neutral, in F_V, m
    velocity: vec3  # sdot
    beta: vec3  # beta_H: roll, pitch, yaw of the hexapod, rad
    beta_rate: vec3


@wp.struct
class SetPoint:
    """Actuator set-points of an earlier step, for dead time and lag."""

    position: vec9
    rate: vec9


@wp.struct
class Step:
    """One step of the machine: where it came to, and what held it back."""

    motion: Motion
    limits: (
        wp.uint64
    )  # 4 bits an actuator: 1 end of travel, 2 velocity, 4 acceleration, 8 singular pose; HELD, EASED


@wp.func
def subsystem(actuator: int) -> int:
    """0 carriage, 1 hexapod, 2 turntable."""
    if actuator < 2:
        return 0
    if actuator < 8:
        return 1
    return 2


@wp.func
def lag(
    m: Machine, actuator: int, y: real, y_rate: real, u: real, u_rate: real, u_next: real, dt: real
) -> vec2:
    """Position and rate of a lagging actuator after a step; its set-point's rate goes to ``u_next``."""
    row = 2 * subsystem(actuator)
    u_acceleration = (u_next - u_rate) / dt
    position = (
        m.lag[row, 0] * y
        + m.lag[row, 1] * y_rate
        + m.lag[row, 2] * u
        + m.lag[row, 3] * u_rate
        + m.lag[row, 4] * u_acceleration
    )
    rate = (
        m.lag[row + 1, 0] * y
        + m.lag[row + 1, 1] * y_rate
        + m.lag[row + 1, 2] * u
        + m.lag[row + 1, 3] * u_rate
        + m.lag[row + 1, 4] * u_acceleration
    )
    return vec2(position, rate)


@wp.func
def clearance(m: Machine, displacement: vec3, beta: vec3) -> real:
    """det(J) of a pose over that of neutral: 0 in a singular pose, negative behind it."""
    return determinant(leg_jacobian(m.geometry, displacement, beta)) / m.neutral_determinant


@wp.func
def is_clear(m: Machine, pose: vec7, beta: vec3, least: real) -> bool:
    """Whether a pose of forward kinematics closes, is near one with ``beta``, and not nearly singular.

    Behind a singular pose Newton's iteration finds no pose, or one far off. Comparisons with NaN are false.
    """
    displacement = vec3(pose[0], pose[1], pose[2])
    angles = vec3(pose[3], pose[4], pose[5])
    closes = pose[6] <= real(10.0) * NEWTON_TOLERANCE
    near = wp.max(wp.abs(angles - beta)) <= real(wp.static(NEIGHBORHOOD))
    return closes and near and clearance(m, displacement, angles) >= least


LOOKS = wp.constant(32)
"""Most poses looked at while the legs of an odd geometry brake; all of them where these are steps enough."""


@wp.func
def braking_distance(rate: real, acceleration: real, steps: int, dt: real) -> real:
    """How far an actuator that brakes with its limit goes within a number of whole steps, with its sign."""
    speed = wp.abs(rate)
    full = wp.min(steps, int(wp.floor(speed / (acceleration * dt))))
    time = real(full) * dt
    distance = (speed - real(0.5) * acceleration * time) * time
    if steps > full:
        # The last step takes what is left of the speed.
        distance = distance + real(0.5) * (speed - acceleration * time) * dt
    return wp.sign(rate) * distance


@wp.func
def brakes_clear(
    m: Machine,
    start: Motion,
    displacement: vec3,
    beta: vec3,
    extensions: vec6,
    rates: vec6,
    least: real,
    dt: real,
) -> bool:
    """:func:`keeps_clear` for geometries that may be singular near any pose: looks at each step of braking.

    So what is clear now stays clear: the next step can always brake on along the poses seen here.
    """
    steps = int(0)
    for i in range(6):
        steps = wp.max(steps, int(wp.ceil(wp.abs(rates[i]) / (m.acceleration[i + 2] * dt))))
    looks = wp.min(steps, LOOKS)
    clear = bool(wp.max(wp.abs(beta - start.beta)) <= real(wp.static(NEIGHBORHOOD)))
    at = displacement
    angles = beta
    look = int(0)
    while clear and look < looks:
        look = look + 1
        legs = vec6()
        for i in range(6):
            way = braking_distance(rates[i], m.acceleration[i + 2], (look * steps) / looks, dt)
            legs[i] = extensions[i] + way
        pose = forward_kinematics(m.geometry, legs, at, angles)
        clear = is_clear(m, pose, angles, least)
        at = vec3(pose[0], pose[1], pose[2])
        angles = vec3(pose[3], pose[4], pose[5])
    return clear


@wp.func
def rests_clear(
    m: Machine, displacement: vec3, beta: vec3, extensions: vec6, ways: vec6, least: real
) -> bool:
    """Whether the poses half-way and at the end of the legs' stopping ways are clear."""
    half = real(0.5)
    middle = forward_kinematics(m.geometry, extensions + half * ways, displacement, beta)
    rest = forward_kinematics(
        m.geometry,
        extensions + ways,
        vec3(middle[0], middle[1], middle[2]),
        vec3(middle[3], middle[4], middle[5]),
    )
    return is_clear(m, middle, beta, least) and is_clear(m, rest, beta, least)


@wp.func
def keeps_clear(
    m: Machine,
    start: Motion,
    jacobian: Jacobian,
    displacement: vec3,
    beta: vec3,
    extensions: vec6,
    rates: vec6,
    dt: real,
) -> bool:
    """Whether the platform, braking from a pose with this Jacobian, comes to rest clear of singular poses.

    While each leg brakes, the extensions it comes to rest at stay the same, so what holds now holds until
    rest. In a nearly singular pose any motion that ends clearer than it began is allowed.
    """
    now = determinant(jacobian) / m.neutral_determinant
    if now >= m.far_from_singular:
        return True
    least = wp.min(real(wp.static(NEARLY_SINGULAR)), clearance(m, start.displacement, start.beta))
    if now < least:
        return False
    if m.far_from_singular > real(1.0):
        return brakes_clear(m, start, displacement, beta, extensions, rates, least, dt)
    ways = vec6()
    for i in range(6):
        ways[i] = real(0.5) * rates[i] * wp.abs(rates[i]) / m.acceleration[i + 2]
    return rests_clear(m, displacement, beta, extensions, ways, least)


CLEARER = wp.constant(real(wp.static(NEARLY_SINGULAR) + 0.1))
"""Clearance below which the platform is not let come to rest by braking with bounded jerk."""


@wp.func
def eases_clear(
    m: Machine,
    start: Motion,
    jacobian: Jacobian,
    displacement: vec3,
    beta: vec3,
    extensions: vec6,
    rates: vec6,
    dt: real,
) -> bool:
    """:func:`keeps_clear` for a platform whose legs brake with bounded jerk, and with some clearance more."""
    if m.felt_jerk <= real(0.0):
        return True
    now = determinant(jacobian) / m.neutral_determinant
    if now >= m.far_from_singular:
        return True
    least = wp.min(CLEARER, clearance(m, start.displacement, start.beta))
    if now < least:
        return False
    ways = vec6()
    for i in range(6):
        k = i + 2
        ways[i] = resting_way(rates[i], (rates[i] - start.rate[k]) / dt, m.acceleration[k], m.jerk[k])
    return rests_clear(m, displacement, beta, extensions, ways, least)


@wp.struct
class Bounds:
    """Least and greatest speed of every actuator after a step."""

    lower: vec9
    upper: vec9


@wp.func
def hard_bounds(m: Machine, start: Motion, dt: real) -> Bounds:
    """The bounds of all actuators, whatever the jerk."""
    lower = vec9()
    upper = vec9()
    for i in range(9):
        pair = rate_bounds(
            start.position[i], start.rate[i], m.position_min[i], m.position_max[i],
            m.velocity[i], m.acceleration[i], dt,
        )  # fmt: skip
        lower[i] = pair[0]
        upper[i] = pair[1]
    bounds = Bounds()
    bounds.lower = lower
    bounds.upper = upper
    return bounds


@wp.func
def all_bounds(m: Machine, start: Motion, requested: vec9, dt: real) -> Bounds:
    """The bounds of all actuators: where a requested rate needs it, those that brake with bounded jerk."""
    hard = hard_bounds(m, start, dt)
    lower = vec9()
    upper = vec9()
    for i in range(9):
        least = hard.lower[i]
        most = hard.upper[i]
        q = start.position[i]
        v = start.rate[i]
        if m.jerk[i] > real(0.0) and not has_room(
            q, v, requested[i], m.position_min[i], m.position_max[i],
            m.velocity[i], m.acceleration[i], m.jerk[i], dt,
        ):  # fmt: skip
            up = eased_rate(
                m.position_max[i] - q, v, requested[i], m.velocity[i], m.acceleration[i], m.jerk[i], dt
            )
            down = -eased_rate(
                q - m.position_min[i], -v, -requested[i], m.velocity[i], m.acceleration[i], m.jerk[i], dt
            )
            if up < requested[i]:
                most = wp.clamp(up, hard.lower[i], hard.upper[i])
            if down > requested[i]:
                least = wp.clamp(down, hard.lower[i], hard.upper[i])
        lower[i] = least
        upper[i] = most
    bounds = Bounds()
    bounds.lower = lower
    bounds.upper = upper
    return bounds


@wp.func
def limit_flag(m: Machine, start: Motion, bounds: Bounds, i: int, requested: real, dt: real) -> wp.uint64:
    """The limit that actuator ``i`` meets, as its four bits of :class:`Step`'s mask.

    1 end of travel, 2 velocity, 4 acceleration; 0 for none, and for a missing actuator.
    """
    if (requested >= bounds.lower[i] and requested <= bounds.upper[i]) or m.position_max[i] <= m.position_min[
        i
    ]:
        return wp.uint64(0)
    ahead = m.position_max[i] - start.position[i]
    towards = start.rate[i]
    bound = bounds.upper[i]
    if requested < bounds.lower[i]:
        ahead = start.position[i] - m.position_min[i]
        towards = -towards
        bound = -bounds.lower[i]
    code = 4
    if bound >= m.velocity[i]:
        code = 2
    if m.jerk[i] > real(0.0) and bound < towards + m.acceleration[i] * dt:
        # Braking for the speed limit gives this bound, braking for the end a lower one.
        code = 2
        if bound < eased_speed(towards, m.velocity[i], m.acceleration[i], m.jerk[i], dt):
            code = 1
    if braking_speed(ahead, towards, m.acceleration[i], dt) <= wp.min(m.velocity[i], bound):
        code = 1
    return wp.lshift(wp.uint64(code), wp.uint64(4 * i))


@wp.func
def limited_rate(bounds: Bounds, i: int, requested: real) -> real:
    """Speed of actuator ``i`` nearest the one requested for that keeps its limits."""
    return wp.min(wp.max(requested, bounds.lower[i]), bounds.upper[i])


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
def with_pose(motion: Motion, pose: vec7, pose_rate: vec6) -> Motion:
    """A motion with the platform's pose replaced."""
    after = motion
    after.displacement = vec3(pose[0], pose[1], pose[2])
    after.beta = vec3(pose[3], pose[4], pose[5])
    after.velocity = vec3(pose_rate[0], pose_rate[1], pose_rate[2])
    after.beta_rate = vec3(pose_rate[3], pose_rate[4], pose_rate[5])
    return after


@wp.func
def held(motion: Motion, last: Motion) -> Motion:
    """A motion whose legs stand still at the last pose."""
    after = with_legs(motion, legs_of(last.position), vec6())
    after.displacement = last.displacement
    after.beta = last.beta
    after.velocity = vec3()
    after.beta_rate = vec3()
    return after


@wp.func
def pose_from_legs(m: Machine, motion: Motion, last: Motion) -> Step:
    """The motion whose pose and rates follow from its legs, by forward kinematics from the last pose.

    Where no pose closes, the last one is held: an emergency stop.
    """
    result = Step()
    pose = forward_kinematics(m.geometry, legs_of(motion.position), last.displacement, last.beta)
    if pose[6] <= CLOSES:
        beta = vec3(pose[3], pose[4], pose[5])
        jacobian = leg_jacobian(m.geometry, vec3(pose[0], pose[1], pose[2]), beta)
        result.motion = with_pose(motion, pose, platform_rates(jacobian, beta, legs_of(motion.rate)))
    else:
        result.motion = held(motion, last)
        result.limits = wp.uint64(wp.static(_EMERGENCY_STOP))
    return result


@wp.func
def legs_towards(m: Machine, start: Motion, bounds: Bounds, target: Motion, rates: vec6, dt: real) -> Step:
    """``target`` with each leg brought as near to its rate as its limits allow, and the pose that follows."""
    extensions = vec6()
    limited = vec6()
    for i in range(6):
        limited[i] = limited_rate(bounds, i + 2, rates[i])
        extensions[i] = start.position[i + 2] + real(0.5) * dt * (start.rate[i + 2] + limited[i])
    return pose_from_legs(m, with_legs(target, extensions, limited), start)


@wp.func
def braking_rates(m: Machine, start: Motion, acceleration: vec9, dt: real) -> vec6:
    """Leg rates after a step of braking to rest with bounded jerk.

    The legs' accelerations are those that continue the platform's ``acceleration``.
    """
    half = real(0.5) * dt
    velocity = start.velocity + vec3(acceleration[2], acceleration[3], acceleration[4]) * dt
    beta_rate = start.beta_rate + vec3(acceleration[5], acceleration[6], acceleration[7]) * dt
    displacement = start.displacement + (start.velocity + velocity) * half
    beta = start.beta + (start.beta_rate + beta_rate) * half
    onward = leg_rates(leg_jacobian(m.geometry, displacement, beta), velocity, beta, beta_rate)
    rates = vec6()
    for i in range(6):
        k = i + 2
        now = start.rate[k]
        rates[i] = resting_rate(now, (onward[i] - now) / dt, m.acceleration[k], m.jerk[k], dt)
    return rates


@wp.func
def limited_legs(
    m: Machine, start: Motion, acceleration: vec9, bounds: Bounds, target: Motion, rates: vec6, dt: real
) -> Step:
    """Legs towards their requested rates, or braking to rest where that would lead into a singular pose."""
    moved = legs_towards(m, start, bounds, target, rates, dt)
    s = moved.motion.displacement
    b = moved.motion.beta
    legs = legs_of(moved.motion.position)
    leg_speeds = legs_of(moved.motion.rate)
    jacobian = leg_jacobian(m.geometry, s, b)
    if moved.limits == wp.uint64(0) and keeps_clear(m, start, jacobian, s, b, legs, leg_speeds, dt):
        if eases_clear(m, start, jacobian, s, b, legs, leg_speeds, dt):
            return moved
        eased = legs_towards(m, start, bounds, target, braking_rates(m, start, acceleration, dt), dt)
        s_eased = eased.motion.displacement
        b_eased = eased.motion.beta
        j_eased = leg_jacobian(m.geometry, s_eased, b_eased)
        l_eased = legs_of(eased.motion.position)
        if keeps_clear(m, start, j_eased, s_eased, b_eased, l_eased, legs_of(eased.motion.rate), dt):
            return eased
    # All the braking there is: the way to a singular pose was reckoned with it.
    return legs_towards(m, start, hard_bounds(m, start, dt), target, vec6(), dt)


@wp.func
def limit_axes(start: Motion, bounds: Bounds, requested: vec9, dt: real) -> Motion:
    """Carriage and turntable after the step, each within its own limits; the hexapod as it was."""
    half = real(0.5) * dt
    x = limited_rate(bounds, 0, requested[0])
    y = limited_rate(bounds, 1, requested[1])
    t = limited_rate(bounds, 8, requested[8])
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
def command_limits(
    m: Machine, start: Motion, bounds: Bounds, requested: vec9, clear: bool, dt: real
) -> wp.uint64:
    """Which limits the requested rates meet, as :class:`Step`'s mask."""
    mask = wp.uint64(0)
    for i in range(9):
        if i >= 2 and i < 8 and not clear:
            mask = mask | wp.lshift(wp.uint64(8), wp.uint64(4 * i))
        mask = mask | limit_flag(m, start, bounds, i, requested[i], dt)
    return mask


@wp.struct
class Request:
    """A command before limiting: the hexapod's motion after the step, and whether the machine may follow."""

    displacement: vec3
    velocity: vec3
    beta: vec3
    beta_rate: vec3
    extensions: vec6
    rates: vec9  # of all actuators
    bounds: Bounds
    clear: bool  # whether it leads to no singular pose
    limits: wp.uint64  # that it meets


@wp.func
def request(m: Machine, start: Motion, action: vec9, dt: real) -> Request:
    """What a command asks of the machine, and which limits it meets."""
    half = real(0.5) * dt
    r = Request()
    r.velocity = start.velocity + vec3(action[2], action[3], action[4]) * dt
    r.beta_rate = start.beta_rate + vec3(action[5], action[6], action[7]) * dt
    r.displacement = start.displacement + (start.velocity + r.velocity) * half
    r.beta = start.beta + (start.beta_rate + r.beta_rate) * half
    jacobian = leg_jacobian(m.geometry, r.displacement, r.beta)
    r.extensions = leg_extensions(m.geometry, r.displacement, r.beta)
    legs = leg_rates(jacobian, r.velocity, r.beta, r.beta_rate)
    r.rates = joined(
        start.rate[0] + action[0] * dt, start.rate[1] + action[1] * dt, legs, start.rate[8] + action[8] * dt
    )
    r.bounds = all_bounds(m, start, r.rates, dt)
    r.clear = determinant(jacobian) / m.neutral_determinant >= m.far_from_singular
    if not r.clear:
        r.clear = keeps_clear(
            m, start, jacobian, r.displacement, r.beta, r.extensions, legs, dt
        ) and eases_clear(m, start, jacobian, r.displacement, r.beta, r.extensions, legs, dt)
    r.limits = command_limits(m, start, r.bounds, r.rates, r.clear, dt)
    return r


@wp.func
def follow(m: Machine, start: Motion, acceleration: vec9, r: Request, dt: real) -> Step:
    """The set-point after a step: the request where the machine may, else the nearest that keeps limits.

    ``acceleration`` is that of the nine axes in the step before.
    """
    after = limit_axes(start, r.bounds, r.rates, dt)
    legs = legs_of(r.rates)
    result = Step()
    result.limits = r.limits
    if legs_may_follow(m, r.bounds, r.extensions, legs, dt) and r.clear:
        after = with_legs(after, r.extensions, legs)
        after.displacement = r.displacement
        after.velocity = r.velocity
        after.beta = r.beta
        after.beta_rate = r.beta_rate
        result.motion = after
    else:
        limited = limited_legs(m, start, acceleration, r.bounds, after, legs, dt)
        result.motion = limited.motion
        result.limits = r.limits | limited.limits
    return result


@wp.func
def mean_acceleration(before: Motion, after: Motion, dt: real) -> vec9:
    """Accelerations of the nine degrees of freedom over a step, in the order of AXES."""
    linear = (after.velocity - before.velocity) / dt
    angular = (after.beta_rate - before.beta_rate) / dt
    return vec9(
        (after.rate[0] - before.rate[0]) / dt, (after.rate[1] - before.rate[1]) / dt,
        linear[0], linear[1], linear[2], angular[0], angular[1], angular[2],
        (after.rate[8] - before.rate[8]) / dt,
    )  # fmt: skip


@wp.func
def felt_change(m: Machine, motion: Motion, change: vec9) -> real:
    """Change of the specific force in the cab, m/s^2, by a change of the nine accelerations.

    It is taken at the cab's reference point or at the head, where it is larger.
    """
    to_inertial = rotation(motion.beta)
    up = vec3(real(0.0), real(0.0), change[8])
    angular = to_inertial * (rate_matrix(motion.beta) * vec3(change[5], change[6], change[7]) + up)
    linear = vec3(change[0] + change[2], change[1] + change[3], change[4])
    table = to_inertial * turntable_rotation(motion.position[8])
    at_cab = linear + wp.cross(angular, table * m.cab)
    at_head = linear + wp.cross(angular, table * m.head)
    return wp.max(wp.length(at_cab), wp.length(at_head))


@wp.func
def command(m: Machine, start: Motion, acceleration: vec9, limits: wp.uint64, action: vec9, dt: real) -> Step:
    """The set-point after a step with nine accelerations, within all limits.

    Args:
        m: The machine.
        start: The set-point before the step.
        acceleration: Of the set-point in the step before, in the order of AXES.
        limits: Met in the step before.
        action: The command.
        dt: Time step, s.
    """
    direct = follow(m, start, acceleration, request(m, start, action, dt), dt)
    if m.felt_jerk <= real(0.0) or (limits | direct.limits) == wp.uint64(0):
        return direct
    # Limits hold an actuator, or let it go: the others must not jump either.
    change = mean_acceleration(start, direct.motion, dt) - acceleration
    felt = felt_change(m, start, change)
    most = m.felt_jerk * dt
    if felt <= most:
        return direct
    eased = acceleration + change * (most / felt)
    result = follow(m, start, acceleration, request(m, start, eased, dt), dt)
    result.limits = result.limits | direct.limits | wp.uint64(wp.static(EASED))
    return result


@wp.func
def actuate(
    m: Machine,
    motion: Motion,
    delay: wp.array2d(dtype=SetPoint),
    environment: int,
    setpoint: Motion,
    dt: real,
) -> Step:
    """The true motion after a step, the set-point after dead time and lag, and whether it was held.

    ``delay[environment, k]`` is the set-point k + 1 steps before ``setpoint``.
    """
    result = Step()
    if m.has_dynamics == 0:
        result.motion = setpoint
        return result
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
        result.motion = after
        return result
    return pose_from_legs(m, after, motion)
