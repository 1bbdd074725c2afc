"""The rows that tell a policy its machine: what it can do, and how much of its travel is used."""

from __future__ import annotations

import warp as wp

from ..observation import share_of_limit
from ..platform.state import Machine, Motion
from ..precision import real, vec2
from .entries import put_entry
from .heading import heading, turned


@wp.func
def put_abilities(
    abilities: wp.array2d(dtype=wp.float32),
    which: int,
    first: int,
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write what a machine can do, constants of the batch; returns where the next row begins."""
    for k in range(abilities.shape[1]):
        put_entry(out, i, first + k, real(abilities[which, k]), bounds)
    return first + abilities.shape[1]


@wp.func
def put_travel_used(
    m: Machine,
    setpoint: Motion,
    cab_frame: int,
    first: int,
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write the shares of their travel that carriage and turntable use, in the frame asked for."""
    p = setpoint.position
    used = vec2(
        share_of_limit(p[0], m.position_min[0], m.position_max[0]),
        share_of_limit(p[1], m.position_min[1], m.position_max[1]),
    )
    if cab_frame != 0:
        used = turned(used[0], used[1], heading(setpoint))
    k = put_entry(out, i, first, used[0], bounds)
    k = put_entry(out, i, k, used[1], bounds)
    return put_entry(out, i, k, share_of_limit(p[8], m.position_min[8], m.position_max[8]), bounds)
