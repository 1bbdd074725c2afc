"""The step and the observation of a batch with their adjoints, out of place, one launch a time step.

They are made of the same functions as :mod:`.kernels`. Compiling the adjoint takes about a minute, once a
machine.
"""

from __future__ import annotations

import warp as wp

from ...arrays import real, vec9
from ...perception.kernels import Vestibular
from ...platform.kernels.step import Machine, SetPoint
from ...simulator.kernels.step import Drives, State, next_state, shift_delay
from .action import applied_accelerations, own_accelerations
from .episode import Rules
from .observation import Episode, write_frame
from .reward import action_change, terms_now, vec_terms

ACTION_RATE = wp.constant(6)
"""Place of the change of the action among the reward's terms."""


@wp.kernel(enable_backward=True, module="unique")
def play_with_adjoint(
    rules: Rules,
    episodes: wp.array(dtype=Episode),
    machines: wp.array(dtype=Machine),
    vestibular: wp.array(dtype=Vestibular),
    drives: Drives,
    machine_of: wp.array(dtype=int),
    drive_of: wp.array(dtype=int),
    first: int,
    now: wp.array2d(dtype=wp.float32),
    before: wp.array2d(dtype=wp.float32),
    own: wp.array(dtype=vec9),
    state: wp.array(dtype=State),
    delay: wp.array2d(dtype=SetPoint),
    own_out: wp.array(dtype=vec9),
    state_out: wp.array(dtype=State),
    delay_out: wp.array2d(dtype=SetPoint),
    terms: wp.array(dtype=vec_terms),
    cost: wp.array(dtype=real),
) -> None:
    """One time step; adds its terms, and minus its reward to the cost. ``now`` lies within [-1, 1]."""
    i = wp.tid()
    which = machine_of[i]
    m = machines[which]
    s = state[i]
    asked = own_accelerations(rules.action, which, s.setpoint, now, i, own[i], rules.dt)
    own_out[i] = asked
    wanted = wp.cw_mul(
        applied_accelerations(rules.action, s.setpoint, asked, vec9()), episodes[i].actuator_gain
    )
    after = next_state(m, vestibular[0], drives, drive_of[i], delay, i, s, wanted, rules.dt)
    if m.has_dynamics != 0:
        shift_delay(delay, delay_out, i, after.setpoint)
    state_out[i] = after
    found = terms_now(rules.reward, m, after, rules.share)
    wp.atomic_add(terms, i, found)
    spent = wp.dot(rules.reward.weights, found)
    if first != 0:
        spent = spent + rules.reward.weights[ACTION_RATE] * action_change(now, before, i)
    wp.atomic_add(cost, i, spent)


@wp.kernel(enable_backward=True, module="unique")
def look_with_adjoint(
    rules: Rules,
    episodes: wp.array(dtype=Episode),
    machines: wp.array(dtype=Machine),
    drives: Drives,
    machine_of: wp.array(dtype=int),
    drive_of: wp.array(dtype=int),
    memory: wp.array2d(dtype=wp.float32),
    bounds: wp.array(dtype=wp.float32),
    now: wp.array2d(dtype=wp.float32),
    own: wp.array(dtype=vec9),
    state: wp.array(dtype=State),
    fixed: wp.array2d(dtype=real),
    out: wp.array2d(dtype=wp.float32),
) -> None:
    """Observations before an action; ``now`` is the last one."""
    i = wp.tid()
    write_frame(
        rules.places,
        drives,
        drive_of[i],
        episodes[i],
        machine_of[i],
        machines[machine_of[i]],
        state[i],
        fixed,
        now,
        own[i],
        vec9(),
        memory,
        bounds,
        out,
        i,
    )
