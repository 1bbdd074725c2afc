"""One step of the adaptive washout: the classical one with gains, and the steepest descent of the gains.

A gain p stands before each high-pass that feeds an integrator: one an axis of the cab on the output of HPS,
and one on each Euler rate. The sensitivity of the motion to a gain, dQ'/dp, is the same high-pass driven by
the signal that the gain multiplies. Then (Parrish, Dieudonne, Bowles and Martin 1975; Nahon and Reid 1990)

    C = 1/2 (|a2S - L_SI Q''|^2 + |Q'|^2 + |Q'.|^2 + (p - 1)^2), each over its scale,   dp/dt = -G dC/dp

is integrated by a step that is implicit in the curvature of C. It is the published law for small steps, and
cannot overshoot the minimum of C, however large the input.
"""

from __future__ import annotations

import warp as wp

from ....envs.arrays import real, vec3, vec9
from ..kernels import step as classical
from ..kernels.blocks import Gains, Memory, Parameters, Reading, Step, initial_memory


@wp.struct
class AdaptiveKernelParameters:
    """The kernel's form of :class:`~.parameters.AdaptiveParameters`; weights are 1 / scale^2."""

    washout: Parameters
    force: real
    rate: real
    displacement: vec3
    velocity: vec3
    angle: vec3
    force_departure: real
    rate_departure: real
    force_speed: vec3
    rate_speed: vec3
    gain_min: real
    gain_max: real


@wp.struct
class Sensitivity:
    """dQ'/dp of one gain, and its rate; in F_I."""

    position: vec3
    velocity: vec3


@wp.struct
class AdaptiveMemory:
    """States of all filters, gains and sensitivities."""

    washout: Memory
    gains: Gains
    forward: Sensitivity
    sideways: Sensitivity
    vertical: Sensitivity
    hpr_position: vec3  # of HPR driven by the Euler rates themselves
    hpr_velocity: vec3
    beta_sensitivity: vec3  # d beta1HP / dp, each Euler angle by its own gain
    beta_sensitivity_rate: vec3


@wp.struct
class AdaptedGain:
    """A gain and its sensitivity after a step."""

    gain: real
    sensitivity: Sensitivity


@wp.struct
class AdaptiveCommand:
    """The accelerations of one step, and the filters after it."""

    action: vec9
    memory: AdaptiveMemory


@wp.func
def gradient_step(
    gain: real, speed: real, slope: real, curvature: real, low: real, high: real, dt: real
) -> real:
    """A gain one step of steepest descent later."""
    return wp.clamp(gain - dt * speed * slope / (real(1.0) + dt * speed * curvature), low, high)


@wp.func
def adapted_force_gain(
    p: AdaptiveKernelParameters, m: AdaptiveMemory, s: Step, sensitivity: Sensitivity, axis: int, dt: real
) -> AdaptedGain:
    """One translational gain and its sensitivity after the step."""
    l_is = s.inputs.l_is
    drive = vec3(l_is[0, axis], l_is[1, axis], l_is[2, axis]) * s.inputs.a2s_passed[axis]
    d = sensitivity.position
    v = sensitivity.velocity
    acceleration = classical.high_pass_in_space(p.washout, d, v, drive, dt)
    # Lengths are the same in F_S and F_I: the error need not be turned into the cab.
    error = l_is * s.inputs.a2s - s.q
    x = m.washout.displacement - m.washout.home
    gain = m.gains.force[axis]
    slope = (
        wp.dot(wp.cw_mul(p.displacement, x), d)
        + wp.dot(wp.cw_mul(p.velocity, m.washout.velocity), v)
        - p.force * wp.dot(error, acceleration)
        + p.force_departure * (gain - real(1.0))
    )
    curvature = (
        wp.dot(wp.cw_mul(p.displacement, d), d)
        + wp.dot(wp.cw_mul(p.velocity, v), v)
        + p.force * wp.dot(acceleration, acceleration)
        + p.force_departure
    )
    out = AdaptedGain()
    out.gain = gradient_step(gain, p.force_speed[axis], slope, curvature, p.gain_min, p.gain_max, dt)
    out.sensitivity.position = d + dt * v + (real(0.5) * dt * dt) * acceleration
    out.sensitivity.velocity = v + dt * acceleration
    return out


@wp.func
def adapted_forces(
    p: AdaptiveKernelParameters, m: AdaptiveMemory, s: Step, after: AdaptiveMemory, dt: real
) -> AdaptiveMemory:
    """All translational gains after the step."""
    x = adapted_force_gain(p, m, s, m.forward, 0, dt)
    y = adapted_force_gain(p, m, s, m.sideways, 1, dt)
    z = adapted_force_gain(p, m, s, m.vertical, 2, dt)
    out = after
    out.gains.force = vec3(x.gain, y.gain, z.gain)
    out.forward = x.sensitivity
    out.sideways = y.sensitivity
    out.vertical = z.sensitivity
    return out


@wp.func
def adapted_rate_gain(p: AdaptiveKernelParameters, m: AdaptiveMemory, s: Step, axis: int, dt: real) -> real:
    """One rotational gain after the step."""
    error = s.inputs.euler_rates[axis] - m.washout.beta_hp_rate[axis]
    d = m.beta_sensitivity[axis]
    v = m.beta_sensitivity_rate[axis]
    gain = m.gains.rate[axis]
    slope = (
        p.angle[axis] * m.washout.beta_hp[axis] * d
        - p.rate * error * v
        + p.rate_departure * (gain - real(1.0))
    )
    curvature = p.angle[axis] * d * d + p.rate * v * v + p.rate_departure
    return gradient_step(gain, p.rate_speed[axis], slope, curvature, p.gain_min, p.gain_max, dt)


@wp.func
def adapted_rates(
    p: AdaptiveKernelParameters, m: AdaptiveMemory, s: Step, after: AdaptiveMemory, dt: real
) -> AdaptiveMemory:
    """All rotational gains after the step."""
    half = real(0.5) * dt * dt
    driven = m.washout
    driven.hpr_position = m.hpr_position
    driven.hpr_velocity = m.hpr_velocity
    high_passed = classical.high_pass_rates(p.washout, driven, s.inputs.euler_rates, dt)
    alpha = (high_passed - m.beta_sensitivity_rate) * classical.rate_roll_off(p.washout, dt)
    out = after
    out.gains.rate = vec3(
        adapted_rate_gain(p, m, s, 0, dt),
        adapted_rate_gain(p, m, s, 1, dt),
        adapted_rate_gain(p, m, s, 2, dt),
    )
    out.hpr_position = m.hpr_position + dt * m.hpr_velocity + half * high_passed
    out.hpr_velocity = m.hpr_velocity + dt * high_passed
    out.beta_sensitivity = m.beta_sensitivity + dt * m.beta_sensitivity_rate + half * alpha
    out.beta_sensitivity_rate = m.beta_sensitivity_rate + dt * alpha
    return out


@wp.func
def initial_adaptive_memory(p: AdaptiveKernelParameters, now: Reading) -> AdaptiveMemory:
    """Filters at rest, gains at 1."""
    one = real(1.0)
    m = AdaptiveMemory()
    m.washout = initial_memory(p.washout, now)
    m.gains.force = vec3(one, one, one)
    m.gains.rate = vec3(one, one, one)
    return m


@wp.func
def adaptive_washout(
    p: AdaptiveKernelParameters, m: AdaptiveMemory, now: Reading, dt: real
) -> AdaptiveCommand:
    """One step."""
    s = classical.washout_with(p.washout, m.gains, m.washout, now, dt)
    after = AdaptiveMemory()
    after.washout = s.command.memory
    after = adapted_forces(p, m, s, after, dt)
    out = AdaptiveCommand()
    out.memory = adapted_rates(p, m, s, after, dt)
    out.action = s.command.action
    return out
