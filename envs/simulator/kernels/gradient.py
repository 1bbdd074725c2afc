"""Adjoint of the simulator's step, for gradients of a cue cost through many steps by Warp's tape.

It is compiled as a module of its own, when it is first used (about a minute, once a machine).
"""

from __future__ import annotations

import warp as wp

from ...arrays import real
from .step import State, Zone, cue_error, step_kernel

step_with_adjoint = wp.kernel(step_kernel, enable_backward=True, module="unique")
"""The step of :mod:`.step` with its adjoint."""


@wp.kernel(enable_backward=True, module="unique")
def add_cue_error(z: Zone, state: wp.array(dtype=State), share: real, cost: wp.array(dtype=real)) -> None:
    """Add a share of the cost of this moment, for every environment."""
    i = wp.tid()
    wp.atomic_add(cost, i, share * cue_error(z, state[i]))
