"""The classical washout with a gain on the output of each block, for mutants.

Warp reads the annotations, so this module must not have ``from __future__ import annotations``.
"""

from typing import Any

import warp as wp

from motion_cueing.baselines.washout.classical.family import kernel_parameters
from motion_cueing.baselines.washout.kernels.blocks import (
    Command,
    Gains,
    Memory,
    Parameters,
    Reading,
    initial_memory,
)
from motion_cueing.baselines.washout.kernels.launch import make_kernels
from motion_cueing.baselines.washout.kernels.step import washout_with
from motion_cueing.envs.arrays import real, vec3


@wp.struct
class Mutated:
    """A parameter set, and factors on the outputs of HPS (in F_S) and on the Euler rates before HPR."""

    washout: Parameters
    gains: Gains


@wp.func
def begin(p: Mutated, now: Reading) -> Memory:
    """The memory when an episode begins."""
    return initial_memory(p.washout, now)


@wp.func
def step(p: Mutated, m: Memory, now: Reading, dt: real) -> Command:
    """One step."""
    return washout_with(p.washout, p.gains, m, now, dt).command


def values(mutant: Any, cab: Any, dt: float) -> Any:
    """The struct of a mutant (``parameters``, ``factors`` by the name of a block)."""
    p: Any = Mutated()
    p.washout = kernel_parameters(mutant.parameters, cab)
    factors = mutant.factors
    p.gains.force = vec3(*(factors.get(f"hps_{axis}", 1.0) for axis in "xyz"))
    p.gains.rate = vec3(*(factors.get(f"hpr_{axis}", 1.0) for axis in ("roll", "pitch", "yaw")))
    washout = p.washout
    washout.tilt_gain *= factors.get("tilt", 1.0)
    washout.carriage_share *= factors.get("lpc", 1.0)
    washout.turntable_gain *= factors.get("turntable", 1.0)
    p.washout = washout
    return p


KERNELS = make_kernels(Mutated, Memory, begin, step, values)
"""Kernels of the mutants."""
