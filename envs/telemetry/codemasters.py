"""Shared by games on Codemasters' engine: axes of the car in a world with y up, horizontal loads in g."""

from __future__ import annotations

import numpy as np

from ..cues import Floats
from .sample import Sample, attitude_from_axes, from_east_up_north, from_east_up_south

STANDARD_GRAVITY = 9.80665
"""Of a load in g, m/s^2."""


def sample_of(
    time: float,
    forward: Floats,
    right: Floats,
    velocity: Floats,
    position: Floats,
    loads: tuple[float, float],
) -> Sample:
    """A sample without vertical acceleration and rates, which follow from velocity and attitude.

    Args:
        time: s.
        forward: (3,) axis of the car in the game's world, which has y up.
        right: (3,) likewise.
        velocity: (3,) in the game's world, m/s.
        position: (3,) likewise, m.
        loads: Longitudinal and lateral acceleration in g, forward and to the right positive.
    """
    attitude, right_handed = attitude_from_axes(forward, right)
    change = from_east_up_south if right_handed else from_east_up_north
    longitudinal, lateral = (STANDARD_GRAVITY * load for load in loads)
    return Sample(
        time=time,
        acceleration=np.array([longitudinal, lateral, np.nan]),
        attitude=attitude,
        velocity=change(velocity),
        position=change(position),
    )
