"""The washout as kernels: from observations, fused with the machine, and with its adjoint."""

from __future__ import annotations

import warp as wp

from ...envs.cue_cost import Zone, cue_error, perceived_error
from ...envs.cues import GRAVITY
from ...envs.observation import SCALES, SLICES
from ...envs.perception.filters import Vestibular
from ...envs.platform.state import Machine, SetPoint
from ...envs.precision import real, vec2, vec3, vec9
from ...envs.state import Drives, State
from ...envs.step import next_state
from .step import Memory, Parameters, Reading, initial_memory, washout


@wp.func
def triple(row: wp.array2d(dtype=real), i: int, first: int, scale: real) -> vec3:
    """Three entries of an observation in SI units."""
    return vec3(row[i, first], row[i, first + 1], row[i, first + 2]) * scale


@wp.func
def pair(row: wp.array2d(dtype=real), i: int, first: int, scale: real) -> vec2:
    """Two entries of an observation in SI units."""
    return vec2(row[i, first], row[i, first + 1]) * scale


@wp.func
def read_observation(row: wp.array2d(dtype=real), i: int) -> Reading:
    """What the algorithm needs of an observation; see ``envs.observation``."""
    one = real(1.0)
    seen = Reading()
    seen.force = triple(
        row, i, wp.static(SLICES["wanted_force"].start), real(wp.static(SCALES["wanted_force"]))
    ) - vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))
    seen.rate = triple(row, i, wp.static(SLICES["wanted_rate"].start), one)
    seen.carriage = pair(row, i, wp.static(SLICES["carriage"].start), real(wp.static(SCALES["carriage"])))
    seen.carriage_rate = pair(
        row, i, wp.static(SLICES["carriage_rate"].start), real(wp.static(SCALES["carriage_rate"]))
    )
    seen.displacement = triple(row, i, wp.static(SLICES["displacement"].start), one)
    seen.velocity = triple(row, i, wp.static(SLICES["velocity"].start), one)
    seen.beta = triple(row, i, wp.static(SLICES["beta"].start), one)
    seen.beta_rate = triple(row, i, wp.static(SLICES["beta_rate"].start), one)
    angle = pair(row, i, wp.static(SLICES["turntable"].start), one)
    seen.psi_t = wp.atan2(angle[0], angle[1])
    seen.psi_t_rate = row[i, wp.static(SLICES["turntable_rate"].start)]
    return seen


@wp.func
def read_state(state: State) -> Reading:
    """The same straight from the simulator's state."""
    p = state.setpoint
    seen = Reading()
    seen.force = state.wanted.force
    seen.rate = state.wanted.rate
    seen.carriage = vec2(p.position[0], p.position[1])
    seen.carriage_rate = vec2(p.rate[0], p.rate[1])
    seen.displacement = p.displacement
    seen.velocity = p.velocity
    seen.beta = p.beta
    seen.beta_rate = p.beta_rate
    seen.psi_t = p.position[8]
    seen.psi_t_rate = p.rate[8]
    return seen


@wp.kernel(enable_backward=False, module="unique")
def predict(
    parameters: wp.array(dtype=Parameters),
    parameters_of: wp.array(dtype=int),
    observation: wp.array2d(dtype=real),
    begins: wp.array(dtype=wp.bool),
    memory: wp.array(dtype=Memory),
    dt: real,
    memory_out: wp.array(dtype=Memory),
    action: wp.array(dtype=vec9),
) -> None:
    """Accelerations for a batch of observations; memories begin anew where an episode has begun."""
    i = wp.tid()
    p = parameters[parameters_of[i]]
    seen = read_observation(observation, i)
    m = memory[i]
    if begins[i]:
        m = initial_memory(p, seen)
    out = washout(p, m, seen, dt)
    memory_out[i] = out.memory
    action[i] = out.action


@wp.struct
class Score:
    """Means over a drive."""

    cue_error: real  # J
    perceived_error: real
    at_limit: real  # share of the steps in which a limit is met


@wp.kernel(enable_backward=False, module="unique")
def drive_through(
    machines: wp.array(dtype=Machine),
    vestibular: wp.array(dtype=Vestibular),
    drives: Drives,
    machine_of: wp.array(dtype=int),
    drive_of: wp.array(dtype=int),
    dt: real,
    delay: wp.array2d(dtype=SetPoint),
    parameters: wp.array(dtype=Parameters),
    parameters_of: wp.array(dtype=int),
    z: Zone,
    initial: wp.array(dtype=State),
    first: int,
    score: wp.array(dtype=Score),
) -> None:
    """Washout and machine through whole drives in one launch, environment ``first`` and on."""
    i = first + wp.tid()
    p = parameters[parameters_of[i]]
    m = machines[machine_of[i]]
    state = initial[i]
    memory = initial_memory(p, read_state(state))
    count = drives.length[drive_of[i]]
    cue = cue_error(z, state)
    perceived = perceived_error(z, state)
    limited = real(0.0)
    for _ in range(1, count):
        out = washout(p, memory, read_state(state), dt)
        memory = out.memory
        state = next_state(m, vestibular[0], drives, drive_of[i], delay, i, state, out.action, dt)
        cue = cue + cue_error(z, state)
        perceived = perceived + perceived_error(z, state)
        if state.limits != wp.uint64(0):
            limited = limited + real(1.0)
    result = Score()
    result.cue_error = cue / real(count)
    result.perceived_error = perceived / real(count)
    result.at_limit = limited / real(count)
    score[i] = result


@wp.kernel(enable_backward=True, module="unique")
def act(
    parameters: wp.array(dtype=Parameters),
    parameters_of: wp.array(dtype=int),
    state: wp.array(dtype=State),
    memory: wp.array(dtype=Memory),
    begins: int,
    dt: real,
    memory_out: wp.array(dtype=Memory),
    action: wp.array(dtype=vec9),
) -> None:
    """The washout on the simulator's own state, with its adjoint; memories begin anew where ``begins``."""
    i = wp.tid()
    p = parameters[parameters_of[i]]
    seen = read_state(state[i])
    m = memory[i]
    if begins != 0:
        m = initial_memory(p, seen)
    out = washout(p, m, seen, dt)
    memory_out[i] = out.memory
    action[i] = out.action
