"""Kernels of a washout, made for its structs and step: on observations, fused with the machine, with adjoint.

Warp reads their annotations, so this module must not have ``from __future__ import annotations``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp

from ....envs.arrays import bool_array, int_array, real, real_rows, vec9
from ....envs.perception.kernels import Vestibular
from ....envs.platform.kernels.step import Machine, SetPoint
from ....envs.platform.machines import Cab
from ....envs.simulator.kernels.step import Drives, State, Zone, cue_error, next_state, perceived_error
from .blocks import read_observation, read_state


@wp.struct
class Score:
    """Means over a drive."""

    cue_error: real  # J
    perceived_error: real
    at_limit: real  # share of the steps in which a limit is met


@wp.func
def mean_score(cue_error: real, perceived_error: real, limited: real, count: real) -> Score:
    """A score of sums over ``count`` samples."""
    result = Score()
    result.cue_error = cue_error / count
    result.perceived_error = perceived_error / count
    result.at_limit = limited / count
    return result


def predict_kernel(Parameters: Any, Memory: Any, begin: Any, step: Any) -> Any:
    """A kernel: accelerations for a batch of observations; memories begin anew where an episode has begun.

    Args:
        Parameters: Struct of a parameter set.
        Memory: Struct of the filters' states.
        begin: (parameters, reading) -> memory when an episode begins.
        step: (parameters, memory, reading, dt) -> a struct with ``action`` and ``memory``.
    """

    @wp.kernel(enable_backward=False, module="unique")
    def predict(
        parameters: wp.array(dtype=Parameters),
        parameters_of: int_array,
        observation: real_rows,
        begins: bool_array,
        memory: wp.array(dtype=Memory),
        dt: real,
        memory_out: wp.array(dtype=Memory),
        action: wp.array(dtype=vec9),
    ) -> None:
        i = wp.tid()
        p = parameters[parameters_of[i]]
        now = read_observation(observation, i)
        m = memory[i]
        if begins[i]:
            m = begin(p, now)
        out = step(p, m, now, dt)
        memory_out[i] = out.memory
        action[i] = out.action

    return predict


def drive_kernel(Parameters: Any, begin: Any, step: Any) -> Any:
    """A kernel: algorithm and machine through whole drives in one launch, environment ``first`` and on.

    Arguments as in :func:`predict_kernel`.
    """

    @wp.kernel(enable_backward=False, module="unique")
    def drive_through(
        machines: wp.array(dtype=Machine),
        vestibular: wp.array(dtype=Vestibular),
        drives: Drives,
        machine_of: int_array,
        drive_of: int_array,
        dt: real,
        delay: wp.array2d(dtype=SetPoint),
        parameters: wp.array(dtype=Parameters),
        parameters_of: int_array,
        z: Zone,
        initial: wp.array(dtype=State),
        first: int,
        score: wp.array(dtype=Score),
    ) -> None:
        i = first + wp.tid()
        p = parameters[parameters_of[i]]
        m = machines[machine_of[i]]
        state = initial[i]
        memory = begin(p, read_state(state))
        count = drives.length[drive_of[i]]
        cue = cue_error(z, state)
        perceived = perceived_error(z, state)
        limited = real(0.0)
        for _ in range(1, count):
            out = step(p, memory, read_state(state), dt)
            memory = out.memory
            state = next_state(m, vestibular[0], drives, drive_of[i], delay, i, state, out.action, dt)
            cue = cue + cue_error(z, state)
            perceived = perceived + perceived_error(z, state)
            if state.limits != wp.uint64(0):
                limited = limited + real(1.0)
        score[i] = mean_score(cue, perceived, limited, real(count))

    return drive_through


def act_kernel(Parameters: Any, Memory: Any, begin: Any, step: Any) -> Any:
    """A kernel with adjoint: the algorithm on the simulator's own state; ``begins`` starts memories anew.

    Arguments as in :func:`predict_kernel`.
    """

    @wp.kernel(enable_backward=True, module="unique")
    def act(
        parameters: wp.array(dtype=Parameters),
        parameters_of: int_array,
        state: wp.array(dtype=State),
        memory: wp.array(dtype=Memory),
        begins: int,
        dt: real,
        memory_out: wp.array(dtype=Memory),
        action: wp.array(dtype=vec9),
    ) -> None:
        i = wp.tid()
        p = parameters[parameters_of[i]]
        now = read_state(state[i])
        m = memory[i]
        if begins != 0:
            m = begin(p, now)
        out = step(p, m, now, dt)
        memory_out[i] = out.memory
        action[i] = out.action

    return act


@dataclass(frozen=True)
class Kernels:
    """A washout algorithm as kernels.

    Args:
        parameters: Struct of a parameter set.
        memory: Struct of the filters' states.
        values: (set, cab, time step in s) -> the struct of a set.
        predict: Kernel from observations, see :func:`predict_kernel`.
        drive_through: Kernel fused with the machine, see :func:`drive_kernel`.
        act: Kernel with adjoint, see :func:`act_kernel`; None for an algorithm without a gradient.
        begin: The Warp function (parameters, reading) -> memory when an episode begins.
        step: The Warp function (parameters, memory, reading, dt) -> a struct with ``action`` and ``memory``.
    """

    parameters: Any
    memory: Any
    values: Callable[[Any, Cab, float], Any]
    predict: Any
    drive_through: Any
    act: Any
    begin: Any
    step: Any


def make_kernels(
    parameters: Any,
    memory: Any,
    begin: Any,
    step: Any,
    values: Callable[[Any, Cab, float], Any],
    differentiable: bool = False,
) -> Kernels:
    """The kernels of an algorithm from its structs, its first memory and its step."""
    return Kernels(
        parameters,
        memory,
        values,
        predict_kernel(parameters, memory, begin, step),
        drive_kernel(parameters, begin, step),
        act_kernel(parameters, memory, begin, step) if differentiable else None,
        begin,
        step,
    )
