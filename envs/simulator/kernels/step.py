"""The simulator's step and its adjoint: state, cue cost, motion base, cues and perception.

car cue -> policy -> **motion base -> simulator cues -> perceived cues**
"""

from __future__ import annotations

import math
from typing import Any

import warp as wp

from ...arrays import bool_array, int_array, real, vec3, vec9
from ...perception.kernels import Perceived, Vestibular, VestibularState, advance_vestibular, perceive, rested
from ...platform.kernels.geometry import cab_angular_velocity, leg_extensions, specific_force
from ...platform.kernels.step import Machine, Motion, SetPoint, actuate, command, mean_acceleration
from ...settings import Positive, configuration


@wp.struct
class Cues:
    """Specific force at the cab's reference point and at the head, and angular velocity; in F_S or F_A."""

    force: vec3  # m/s^2
    rate: vec3  # rad/s
    head_force: vec3  # m/s^2


@wp.struct
class State:
    """Everything that changes in one environment."""

    sample: int  # index of the reference cue now
    setpoint: Motion  # limited commands
    motion: Motion  # the true machine: the set-point after dead time and lag
    acceleration: vec9  # of the true machine over the last step, in the order of AXES
    setpoint_acceleration: vec9  # of the set-points, likewise
    limits: wp.uint64  # limits met in the last step, see platform.state.Step
    reference_cue: Cues
    simulator_cue: Cues
    vestibular_reference: VestibularState
    vestibular_simulator: VestibularState
    perceived_reference: Perceived
    perceived_simulator: Perceived


@wp.struct
class Drives:
    """Cue traces of all drives, one behind another."""

    force: wp.array(dtype=vec3)
    rate: wp.array(dtype=vec3)
    rate_derivative: wp.array(dtype=vec3)
    first: int_array  # of each drive
    length: int_array


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
def error(z: Zone, force: vec3, reference_force: vec3, rate: vec3, reference_rate: vec3) -> real:
    """The cost of a pair of signals."""
    df = (force - reference_force) / z.force
    dw = (rate - reference_rate) / z.rate
    return wp.dot(df, df) + wp.dot(dw, dw)


@wp.func
def cue_error(z: Zone, s: State) -> real:
    """Cost of the cue error at the cab's reference point."""
    return error(z, s.simulator_cue.force, s.reference_cue.force, s.simulator_cue.rate, s.reference_cue.rate)


@wp.func
def perceived_error(z: Zone, s: State) -> real:
    """Cost of the error of the perceived cues."""
    return error(
        z,
        s.perceived_simulator.force,
        s.perceived_reference.force,
        s.perceived_simulator.rate,
        s.perceived_reference.rate,
    )


@wp.func
def reference_cues(m: Machine, drives: Drives, drive: int, sample: int) -> Cues:
    """The car's cues at a sample of a drive (the last one after its end), the head as in the machine."""
    i = drives.first[drive] + wp.clamp(sample, 0, drives.length[drive] - 1)
    cues = Cues()
    cues.force = drives.force[i]
    cues.rate = drives.rate[i]
    arm = m.head - m.cab
    omega = cues.rate
    cues.head_force = (
        cues.force + wp.cross(drives.rate_derivative[i], arm) + wp.cross(omega, wp.cross(omega, arm))
    )
    return cues


@wp.func
def simulator_cues(m: Machine, motion: Motion, acceleration: vec9) -> Cues:
    """The cues of the true motion, Eqs. (1), (7), (40), at the cab's reference point and at the head."""
    origin = vec3(acceleration[0] + acceleration[2], acceleration[1] + acceleration[3], acceleration[4])
    beta_acceleration = vec3(acceleration[5], acceleration[6], acceleration[7])
    psi_t = motion.position[8]
    omega_t = motion.rate[8]
    cues = Cues()
    cues.force = specific_force(
        m.cab, motion.beta, motion.beta_rate, beta_acceleration, psi_t, omega_t, acceleration[8], origin
    )
    cues.head_force = specific_force(
        m.head, motion.beta, motion.beta_rate, beta_acceleration, psi_t, omega_t, acceleration[8], origin
    )
    cues.rate = cab_angular_velocity(motion.beta, motion.beta_rate, psi_t, omega_t)
    return cues


@wp.func
def rest_motion(m: Machine, start: vec9) -> Motion:
    """The machine at rest: carriage x, y; hexapod displacement and Euler angles; turntable angle."""
    motion = Motion()
    motion.displacement = vec3(start[2], start[3], start[4])
    motion.beta = vec3(start[5], start[6], start[7])
    legs = leg_extensions(m.geometry, motion.displacement, motion.beta)
    motion.position = vec9(start[0], start[1], legs[0], legs[1], legs[2], legs[3], legs[4], legs[5], start[8])
    return motion


@wp.func
def initial_state(m: Machine, v: Vestibular, drives: Drives, drive: int, sample: int, start: vec9) -> State:
    """The machine at rest at ``start``, the driver at rest in it, the car at a sample of its drive."""
    state = State()
    state.sample = sample
    state.motion = rest_motion(m, start)
    state.setpoint = state.motion
    state.reference_cue = reference_cues(m, drives, drive, sample)
    state.simulator_cue = simulator_cues(m, state.motion, vec9())
    state.vestibular_reference = rested(v, state.reference_cue.head_force, state.reference_cue.rate)
    state.vestibular_simulator = rested(v, state.simulator_cue.head_force, state.simulator_cue.rate)
    state.perceived_reference = perceive(
        v, state.vestibular_reference, state.reference_cue.head_force, state.reference_cue.rate
    )
    state.perceived_simulator = perceive(
        v, state.vestibular_simulator, state.simulator_cue.head_force, state.simulator_cue.rate
    )
    return state


@wp.func
def next_state(
    m: Machine,
    v: Vestibular,
    drives: Drives,
    drive: int,
    delay: wp.array2d(dtype=SetPoint),
    environment: int,
    state: State,
    action: vec9,
    dt: real,
) -> State:
    """One step of one environment with nine accelerations."""
    commanded = command(m, state.setpoint, state.setpoint_acceleration, state.limits, action, dt)
    actuated = actuate(m, state.motion, delay, environment, commanded.motion, dt)
    motion = actuated.motion
    acceleration = mean_acceleration(state.motion, motion, dt)

    after = State()
    after.sample = state.sample + 1
    after.setpoint = commanded.motion
    after.limits = commanded.limits | actuated.limits
    after.motion = motion
    after.acceleration = acceleration
    after.setpoint_acceleration = mean_acceleration(state.setpoint, commanded.motion, dt)
    after.reference_cue = reference_cues(m, drives, drive, after.sample)
    after.simulator_cue = simulator_cues(m, motion, acceleration)
    after.vestibular_reference = advance_vestibular(
        v, state.vestibular_reference, state.reference_cue.head_force, state.reference_cue.rate
    )
    after.vestibular_simulator = advance_vestibular(
        v, state.vestibular_simulator, state.simulator_cue.head_force, state.simulator_cue.rate
    )
    after.perceived_reference = perceive(
        v, after.vestibular_reference, after.reference_cue.head_force, after.reference_cue.rate
    )
    after.perceived_simulator = perceive(
        v, after.vestibular_simulator, after.simulator_cue.head_force, after.simulator_cue.rate
    )
    return after


@wp.func
def shift_delay(
    delay: wp.array2d(dtype=SetPoint),
    delay_out: wp.array2d(dtype=SetPoint),
    environment: int,
    setpoint: Motion,
) -> int:
    """Put the newest set-point before the earlier ones."""
    newest = SetPoint()
    newest.position = setpoint.position
    newest.rate = setpoint.rate
    delay_out[environment, 0] = newest
    for k in range(1, delay.shape[1]):
        delay_out[environment, k] = delay[environment, k - 1]
    return 0


def step_kernel(
    machines: wp.array(dtype=Machine),
    vestibular: wp.array(dtype=Vestibular),
    drives: Drives,
    machine_of: int_array,
    drive_of: int_array,
    dt: real,
    state: wp.array(dtype=State),
    delay: wp.array2d(dtype=SetPoint),
    action: wp.array(dtype=vec9),
    state_out: wp.array(dtype=State),
    delay_out: wp.array2d(dtype=SetPoint),
) -> None:
    """One step of every environment, out of place."""
    i = wp.tid()
    m = machines[machine_of[i]]
    after = next_state(m, vestibular[0], drives, drive_of[i], delay, i, state[i], action[i], dt)
    if m.has_dynamics != 0:
        shift_delay(delay, delay_out, i, after.setpoint)
    state_out[i] = after


def reset_kernel(
    machines: wp.array(dtype=Machine),
    vestibular: wp.array(dtype=Vestibular),
    drives: Drives,
    machine_of: int_array,
    drive_of: int_array,
    sample: int_array,
    start: wp.array(dtype=vec9),
    mask: bool_array,
    state_out: wp.array(dtype=State),
    delay_out: wp.array2d(dtype=SetPoint),
) -> None:
    """Put the masked environments at rest at their start poses."""
    i = wp.tid()
    if not mask[i]:
        return
    m = machines[machine_of[i]]
    state = initial_state(m, vestibular[0], drives, drive_of[i], sample[i], start[i])
    state_out[i] = state
    newest = SetPoint()
    newest.position = state.setpoint.position
    for k in range(delay_out.shape[1]):
        delay_out[i, k] = newest


step_forward = wp.kernel(step_kernel, enable_backward=False, module="unique")
"""The step without its adjoint: compiles in seconds."""

reset_forward = wp.kernel(reset_kernel, enable_backward=False, module="unique")
"""The reset."""

step_with_adjoint = wp.kernel(step_kernel, enable_backward=True, module="unique")
"""The step with its adjoint, for gradients by Warp's tape: compiled when first used, for about a minute."""


@wp.kernel(enable_backward=True, module="unique")
def add_cue_error(z: Zone, state: wp.array(dtype=State), share: real, cost: wp.array(dtype=real)) -> None:
    """Add a share of the cost of this moment, for every environment."""
    i = wp.tid()
    wp.atomic_add(cost, i, share * cue_error(z, state[i]))
