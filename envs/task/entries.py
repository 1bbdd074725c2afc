"""Entries of an observation: float32, each clipped to its bound."""

from __future__ import annotations

from typing import Any

import warp as wp

from ..precision import real


@wp.func
def put_entry(
    out: wp.array2d(dtype=wp.float32), i: int, k: int, value: real, bounds: wp.array(dtype=wp.float32)
) -> int:
    """Write an entry, clipped to its bound."""
    # Once only: an entry that is written twice would count twice in the adjoint.
    out[i, k] = wp.clamp(wp.float32(value), -bounds[k], bounds[k])
    return k + 1


@wp.func
def put_vector(
    out: wp.array2d(dtype=wp.float32),
    i: int,
    first: int,
    value: Any,
    size: int,
    scale: real,
    bounds: wp.array(dtype=wp.float32),
) -> int:
    """Write ``size`` entries from ``first`` on; returns where the next row begins."""
    for k in range(size):
        put_entry(out, i, first + k, value[k] / scale, bounds)
    return first + size
