"""The kernels of a batch: play a time step, look (observe), ask a base policy, forget an ended episode.

action -> accelerations -> **motion base, cues, perception** -> reward -> observation

Each is one launch for all environments. The second pair has adjoints and works out of place; compiling it
takes about a minute, once a machine.
"""

from __future__ import annotations

import warp as wp

from ...arrays import bool_array, float_rows, int_array, pair_array, real, real_rows, vec9
from ...perception.kernels import Vestibular
from ...platform.kernels.step import Machine, SetPoint
from ...simulator.kernels.observation import write_observation
from ...simulator.kernels.step import Drives, State, next_state, shift_delay
from .action import ActionScale, applied_accelerations, own_accelerations, take_action
from .observation import Episode, View, repeat_frame, shift_frames, write_frame
from .reward import Reward, action_terms, end_terms, state_terms, vec_terms

CORE = wp.constant(1)
FRAME = wp.constant(2)
"""Parts of an observation: the fixed rows in full precision, and the frame in float32."""


@wp.struct
class Rules:
    """What is the same for the whole batch."""

    action: ActionScale
    reward: Reward
    view: View
    repeat: int  # time steps in an action
    dt: real  # time step, s


@wp.struct
class Command:
    """Accelerations that an environment's actions command."""

    own: vec9  # the accelerations of the action itself, in its frame
    commanded: vec9  # with the base policy's, in the machine's frame
    clipped: int  # entries of the action outside [-1, 1]


@wp.struct
class Arrays:
    """What a batch holds a row of for each environment, beside the simulator's state."""

    episode: wp.array(dtype=Episode)
    begins: bool_array
    action: float_rows
    now: float_rows  # the clipped action
    before: float_rows  # the one before
    base: wp.array(dtype=vec9)
    command: wp.array(dtype=Command)
    terms: wp.array(dtype=vec_terms)
    reward: wp.array(dtype=real)
    terminated: bool_array
    truncated: bool_array
    core: real_rows
    fixed: real_rows  # the fixed rows in the observation's frame
    memory: float_rows  # low-passed cues of every sample of every drive
    known: float_rows  # controls and road of every sample of every drive
    bounds: pair_array  # of an observation's entries, and their factors
    observation: float_rows


@wp.func
def share_of(rules: Rules, step: int) -> real:
    """Share of an action's time that has passed after time step number ``step``."""
    return real(step + 1) / real(rules.repeat)


@wp.func
def commanded(rules: Rules, a: Arrays, which: int, s: State, i: int, step: int) -> vec9:
    """Accelerations of time step number ``step`` of an action."""
    c = a.command[i]
    if step == 0:
        c.clipped = take_action(a.action, a.now, a.before, rules.action.bound, i)
    share = share_of(rules, step)
    c.own = own_accelerations(
        rules.action, which, s.setpoint, a.now, a.before, i, share, c.own, rules.dt
    )  # fmt: skip
    c.commanded = applied_accelerations(rules.action, s.setpoint, c.own, a.base[i])
    a.command[i] = c
    return c.commanded


@wp.func
def judge(rules: Rules, a: Arrays, m: Machine, s: State, i: int, step: int) -> int:
    """Terms, reward and ends after a time step; terms are means over the time steps of an action."""
    terms = state_terms(rules.reward.scale, m, s, real(1.0) / real(rules.repeat))
    ended = bool(False)
    if step == 0:
        terms = terms + action_terms(a.now, a.before, i)
    else:
        terms = terms + a.terms[i]
        ended = a.terminated[i]
    if rules.reward.terminate != 0 and not ended:
        ends = end_terms(s.limits)
        terms = terms + ends
        ended = wp.max(ends) > real(0.0)
    a.terms[i] = terms
    a.reward[i] = wp.max(-wp.dot(rules.reward.weights, terms) / a.episode[i].cost_scale, -rules.reward.floor)
    a.terminated[i] = ended
    a.truncated[i] = s.sample >= a.episode[i].last
    return 0


@wp.func
def look_at(
    rules: Rules, a: Arrays, drives: Drives, drive: int, which: int, m: Machine, s: State, i: int, parts: int
) -> int:
    """Write the observation of an environment, or parts of it."""
    if parts & CORE:
        write_observation(m, s, s.setpoint, s.acceleration, s.simulator_cue, a.core, i)
    if parts & FRAME:
        command = a.command[i]
        shift_frames(a.observation, i, rules.view.frame)
        write_frame(
            rules.view, drives, drive, a.episode[i], which, m, s, a.fixed,
            a.now, command.own, a.base[i], a.memory, a.known, a.bounds, a.observation, i,
        )  # fmt: skip
    return 0


@wp.kernel(enable_backward=False, module="unique")
def play(
    rules: Rules,
    a: Arrays,
    machines: wp.array(dtype=Machine),
    vestibular: wp.array(dtype=Vestibular),
    drives: Drives,
    machine_of: int_array,
    drive_of: int_array,
    step: int,
    parts: int,
    state: wp.array(dtype=State),
    delay: wp.array2d(dtype=SetPoint),
    state_out: wp.array(dtype=State),
    delay_out: wp.array2d(dtype=SetPoint),
) -> None:
    """Time step number ``step`` of an action; ``parts`` says what of the observation is made."""
    i = wp.tid()
    which = machine_of[i]
    m = machines[which]
    s = state[i]
    acceleration = wp.cw_mul(commanded(rules, a, which, s, i, step), a.episode[i].actuator_gain)
    after = next_state(m, vestibular[0], drives, drive_of[i], delay, i, s, acceleration, rules.dt)
    if m.has_dynamics != 0:
        shift_delay(delay, delay_out, i, after.setpoint)
    state_out[i] = after
    judge(rules, a, m, after, i, step)
    look_at(rules, a, drives, drive_of[i], which, m, after, i, parts)


@wp.kernel(enable_backward=False, module="unique")
def look(
    rules: Rules,
    a: Arrays,
    machines: wp.array(dtype=Machine),
    drives: Drives,
    machine_of: int_array,
    drive_of: int_array,
    only_begins: int,
    parts: int,
    state: wp.array(dtype=State),
) -> None:
    """Observations outside of a step; frames begin anew where an episode ``begins``."""
    i = wp.tid()
    begins = a.begins[i]
    if only_begins != 0 and not begins:
        return
    which = machine_of[i]
    look_at(rules, a, drives, drive_of[i], which, machines[which], state[i], i, parts)
    if begins and parts & FRAME:
        repeat_frame(a.observation, i, rules.view.frame)


@wp.kernel(enable_backward=False, module="unique")
def ask(
    rules: Rules, a: Arrays, machine_of: int_array, only_begins: int, state: wp.array(dtype=State)
) -> None:
    """The accelerations that actions command now, without a time step: those of a base policy."""
    i = wp.tid()
    if only_begins != 0 and not a.begins[i]:
        return
    commanded(rules, a, machine_of[i], state[i], i, 0)


@wp.kernel(enable_backward=False, module="unique")
def forget(a: Arrays) -> None:
    """Clear actions and commands where an episode begins."""
    i = wp.tid()
    if not a.begins[i]:
        return
    for k in range(a.now.shape[1]):
        a.now[i, k] = wp.float32(0.0)
        a.before[i, k] = wp.float32(0.0)
    a.command[i] = Command()


@wp.kernel(enable_backward=True, module="unique")
def play_with_adjoint(
    rules: Rules,
    episodes: wp.array(dtype=Episode),
    machines: wp.array(dtype=Machine),
    vestibular: wp.array(dtype=Vestibular),
    drives: Drives,
    machine_of: int_array,
    drive_of: int_array,
    step: int,
    now: float_rows,
    before: float_rows,
    own: wp.array(dtype=vec9),
    state: wp.array(dtype=State),
    delay: wp.array2d(dtype=SetPoint),
    own_out: wp.array(dtype=vec9),
    state_out: wp.array(dtype=State),
    delay_out: wp.array2d(dtype=SetPoint),
    terms: wp.array(dtype=vec_terms),
    cost: wp.array(dtype=real),
) -> None:
    """Time step number ``step`` of an action; adds its terms, and minus its reward to the cost.

    ``now`` lies within the bound.
    """
    i = wp.tid()
    which = machine_of[i]
    m = machines[which]
    s = state[i]
    share = share_of(rules, step)
    own_now = own_accelerations(rules.action, which, s.setpoint, now, before, i, share, own[i], rules.dt)
    own_out[i] = own_now
    applied = applied_accelerations(rules.action, s.setpoint, own_now, vec9())
    commanded = wp.cw_mul(applied, episodes[i].actuator_gain)
    after = next_state(m, vestibular[0], drives, drive_of[i], delay, i, s, commanded, rules.dt)
    if m.has_dynamics != 0:
        shift_delay(delay, delay_out, i, after.setpoint)
    state_out[i] = after
    found = state_terms(rules.reward.scale, m, after, real(1.0) / real(rules.repeat))
    wp.atomic_add(terms, i, found)
    if step == 0:
        found = found + action_terms(now, before, i)
    wp.atomic_add(cost, i, wp.dot(rules.reward.weights, found) / episodes[i].cost_scale)


@wp.kernel(enable_backward=True, module="unique")
def look_with_adjoint(
    rules: Rules,
    episodes: wp.array(dtype=Episode),
    machines: wp.array(dtype=Machine),
    drives: Drives,
    machine_of: int_array,
    drive_of: int_array,
    memory: float_rows,
    known: float_rows,
    bounds: pair_array,
    now: float_rows,
    own: wp.array(dtype=vec9),
    state: wp.array(dtype=State),
    fixed: real_rows,
    out: float_rows,
) -> None:
    """Observations before an action; ``now`` is the last one."""
    i = wp.tid()
    write_frame(
        rules.view, drives, drive_of[i], episodes[i], machine_of[i], machines[machine_of[i]], state[i], fixed,
        now, own[i], vec9(), memory, known, bounds, out, i,
    )  # fmt: skip
