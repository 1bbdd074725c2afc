"""What a machine can do, as the numbers of an observation."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..platform.machines import Platform, Turntable
from ..platform.reach import axis_reach
from .layout import MACHINE
from .scaling import acceleration_scale, velocity_scale

Floats = NDArray[np.float64]

_TURN: Final = 2.0 * np.pi
"""Travel that is told of a turntable at most, rad: beyond a turn it hardly matters."""

_HEXAPOD: Final = slice(2, 8)
"""Of the nine axes."""


def ability_of(platform: Platform) -> NDArray[np.float32]:
    """Entries of the rows :data:`~.layout.MACHINE`, in their scales."""
    told = abilities(platform)
    values = [told[row.name] / row.scale for row in MACHINE]
    return np.concatenate(values).astype(np.float32)


def abilities(platform: Platform) -> dict[str, Floats]:
    """The rows :data:`~.layout.MACHINE` by name, in SI units: distances, speeds, accelerations.

    The axes of the hexapod by themselves: how far from neutral, how fast and how suddenly at neutral, as an
    action of 1. What a machine does not have is 0.
    """
    speed, acceleration = velocity_scale(platform), acceleration_scale(platform)
    reach, carriage = axis_reach(platform.hexapod), platform.carriage
    travel = np.zeros(4) if carriage is None else np.abs([*carriage.travel_x, *carriage.travel_y])
    kind, turns = _turntable(platform.turntable)
    return {
        "carriage_travel": travel,
        "carriage_top_speed": speed[:1],
        "carriage_top_acceleration": acceleration[:1],
        "displacement_reach": reach[:3].ravel(),
        "beta_reach": reach[3:].ravel(),
        "hexapod_top_speed": speed[_HEXAPOD],
        "hexapod_top_acceleration": acceleration[_HEXAPOD],
        "turntable_kind": kind,
        "turntable_travel": turns,
        "turntable_top_speed": speed[8:],
        "turntable_top_acceleration": acceleration[8:],
    }


def _turntable(turntable: Turntable | None) -> tuple[Floats, Floats]:
    """Whether there is one, and whether it is without ends; its travel down and up."""
    if turntable is None:
        return np.zeros(2), np.zeros(2)
    if turntable.travel is None:
        return np.ones(2), np.full(2, _TURN)
    return np.array([1.0, 0.0]), np.minimum(np.abs(turntable.travel), _TURN)
