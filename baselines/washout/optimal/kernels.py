r"""One step of the optimal washout: linear filters in the inertial frame between the paper's blocks.

    omega_AA -> scale, limit -> T_S ----\
                                         filters -> accelerations in F_I -> SPLIT, Q', LPC -> C', S'
    f_AA -> scale, limit -> Rz(psi_S) --/

The channels of F_I are those of the machine: the hexapod's roll and pitch turn about its axes, below the
turntable. The machine's displacements among the states of every filter are those of the references, which
are led to the machine after a limit.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from ....envs.arrays import mat22, real, vec2, vec3, vec9
from ....envs.platform.kernels.geometry import (
    angular_velocity,
    gravity,
    point_on_platform,
    point_velocity,
    rate_matrix_inverse,
    rotation,
)
from ..kernels.blocks import Memory, Parameters, Reading, Rotation, anti_windup, command_axes, initial_memory
from ..kernels.step import (
    advance_rotation,
    advance_translation,
    cab_angles,
    cab_relative_acceleration,
    carriage_acceleration,
    limited_force,
    limited_rate_cue,
    split,
)
from .design import (
    DISPLACEMENT,
    LINE_POSITION,
    LINE_STATES,
    LINE_VELOCITY,
    PLANE_STATES,
    TILT,
    TILT_RATE,
    VELOCITY,
)

vec5: Any = wp.types.vector(LINE_STATES, real)
mat55: Any = wp.types.matrix((LINE_STATES, LINE_STATES), real)
vec10: Any = wp.types.vector(PLANE_STATES, real)
mat1010: Any = wp.types.matrix((PLANE_STATES, PLANE_STATES), real)


@wp.struct
class Plane:
    """x' = A x + b_rate w_0 + b_force w_1; tilt acceleration and acceleration [c_tilt x, c_move x] + D w."""

    a: mat1010
    b_rate: vec10
    b_force: vec10
    c_tilt: vec10
    c_move: vec10
    d: mat22


@wp.struct
class Line:
    """x' = A x + b w, acceleration = c x + d w."""

    a: mat55
    b: vec5
    c: vec5
    d: real


@wp.struct
class OptimalKernelParameters:
    """The kernel's form of :class:`~.parameters.OptimalParameters`."""

    frame: Parameters  # scales, limits, split and cab; its own filters are not used
    surge: Plane
    sway: Plane
    heave: Line
    yaw: Line


@wp.struct
class OptimalMemory:
    """The states of all filters, and the references."""

    frame: Memory
    surge: vec10
    sway: vec10
    heave: vec5
    yaw: vec5


@wp.struct
class OptimalCommand:
    """The accelerations of one step, and the filters after it."""

    action: vec9
    memory: OptimalMemory


@wp.func
def plane_output(p: Plane, x: vec10, w: vec2) -> vec2:
    """Tilt acceleration and acceleration."""
    return vec2(wp.dot(p.c_tilt, x), wp.dot(p.c_move, x)) + p.d * w


@wp.func
def plane_after(p: Plane, x: vec10, w: vec2) -> vec10:
    """The states a step later."""
    return p.a * x + p.b_rate * w[0] + p.b_force * w[1]


@wp.func
def line_output(p: Line, x: vec5, w: real) -> real:
    """Acceleration."""
    return wp.dot(p.c, x) + p.d * w


@wp.func
def line_after(p: Line, x: vec5, w: real) -> vec5:
    """The states a step later."""
    return p.a * x + p.b * w


@wp.func
def plane_at(x: vec10, moved: real, moved_rate: real, tilt: real, tilt_rate: real) -> vec10:
    """A filter with the machine at a given place."""
    out = x
    out[wp.static(DISPLACEMENT)] = moved
    out[wp.static(VELOCITY)] = moved_rate
    out[wp.static(TILT)] = tilt
    out[wp.static(TILT_RATE)] = tilt_rate
    return out


@wp.func
def line_at(x: vec5, moved: real, moved_rate: real) -> vec5:
    """A filter of heave or yaw with the machine at a given place."""
    out = x
    out[wp.static(LINE_POSITION)] = moved
    out[wp.static(LINE_VELOCITY)] = moved_rate
    return out


@wp.func
def to_inertial(force: vec3, psi: real) -> vec2:
    """Horizontal force turned from the cab's heading into F_I."""
    s = wp.sin(psi)
    c = wp.cos(psi)
    return vec2(c * force[0] - s * force[1], s * force[0] + c * force[1])


@wp.func
def reference_rotation(p: Parameters, m: Memory) -> Rotation:
    """Angles and rates of the references."""
    zero = real(0.0)
    return split(p, m, vec3(zero, zero, zero), vec2(zero, zero))


@wp.func
def cab_position(p: Parameters, m: Memory, r: Rotation) -> vec3:
    """Of the cab's reference point in F_I."""
    return m.displacement + rotation(r.beta) * point_on_platform(p.cab, r.psi_t)


@wp.func
def cab_velocity(p: Parameters, m: Memory, r: Rotation) -> vec3:
    """Of the cab's reference point in F_I, Eqs. (34) and (36)."""
    op = point_on_platform(p.cab, r.psi_t)
    turning = wp.cross(angular_velocity(r.beta, r.beta_rate), op) + point_velocity(op, r.psi_t_rate)
    return m.velocity + rotation(r.beta) * turning


@wp.func
def synchronized(p: Parameters, m: OptimalMemory) -> OptimalMemory:
    """All filters with the machine at the references.

    Without a limit they agree by themselves but for products of small angles, which would add up.
    """
    frame = m.frame
    r = reference_rotation(p, frame)
    x = cab_position(p, frame, r) - frame.home
    v = cab_velocity(p, frame, r)
    out = m
    out.surge = plane_at(m.surge, x[0], v[0], frame.tilt[1], frame.tilt_rate[1])
    out.sway = plane_at(m.sway, x[1], v[1], frame.tilt[0], frame.tilt_rate[0])
    out.heave = line_at(m.heave, x[2], v[2])
    out.yaw = line_at(m.yaw, frame.beta_hp[2], frame.beta_hp_rate[2])
    return out


@wp.func
def initial_optimal_memory(p: OptimalKernelParameters, now: Reading) -> OptimalMemory:
    """Filters at rest; home is where the cab begins."""
    m = OptimalMemory()
    m.frame = initial_memory(p.frame, now)
    m.frame.home = cab_position(p.frame, m.frame, reference_rotation(p.frame, m.frame))
    return m


@wp.func
def optimal_washout(
    p: OptimalKernelParameters, memory: OptimalMemory, now: Reading, dt: real
) -> OptimalCommand:
    """One step."""
    m = synchronized(p.frame, memory)
    frame = m.frame
    beta_s = cab_angles(p.frame, frame)
    rates = rate_matrix_inverse(beta_s) * limited_rate_cue(p.frame, now.rate)
    force = limited_force(p.frame, now.force) + gravity()
    level = to_inertial(force, beta_s[2])
    surge = plane_output(p.surge, m.surge, vec2(rates[1], level[0]))
    sway = plane_output(p.sway, m.sway, vec2(rates[0], level[1]))
    zero = real(0.0)
    alpha = vec3(zero, zero, line_output(p.yaw, m.yaw, rates[2]))
    tilt = vec2(sway[0], surge[0])
    r = split(p.frame, frame, alpha, tilt)
    # The filters command the cab's motion, of which the hexapod's rotation already makes a part.
    cab_acceleration = vec3(surge[1], sway[1], line_output(p.heave, m.heave, force[2]))
    q = cab_acceleration - rotation(r.beta) * cab_relative_acceleration(p.frame, r)
    c = carriage_acceleration(p.frame, frame, dt)

    moved = advance_translation(frame, q, c, dt)
    moved = advance_rotation(p.frame, moved, vec3(zero, zero, zero), alpha, tilt, dt)
    out = OptimalCommand()
    out.memory.frame = anti_windup(p.frame, frame, now, r, moved, dt)
    out.memory.surge = plane_after(p.surge, m.surge, vec2(rates[1], level[0]))
    out.memory.sway = plane_after(p.sway, m.sway, vec2(rates[0], level[1]))
    out.memory.heave = line_after(p.heave, m.heave, force[2])
    out.memory.yaw = line_after(p.yaw, m.yaw, rates[2])
    out.action = command_axes(p.frame, frame, now, r, q, c)
    return out
