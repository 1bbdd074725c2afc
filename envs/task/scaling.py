"""What an action of 1 stands for on a machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..platform.machines import Platform
from ..platform.parameters import neutral_jacobian
from ..platform.state import AXES
from .options import ActionOptions

Floats = NDArray[np.float64]


def acceleration_scale(platform: Platform) -> Floats:
    """(9,) largest acceleration of each axis by itself, m/s^2 and rad/s^2, in the order of ``AXES``.

    Carriage and turntable: their acceleration limits. Hexapod: that of the legs over the largest leg rate
    that unit motion of the axis takes at neutral. Axes of a missing subsystem have 0: they do not move.
    """
    return _axis_limits(platform, "acceleration")


def action_scale(platform: Platform, options: ActionOptions) -> Floats:
    """(9,) acceleration that an action of 1 stands for on a machine, m/s^2, rad/s^2; 0 for missing axes."""
    own = acceleration_scale(platform)
    largest = own if options.largest is None else np.where(own > 0.0, options.largest, 0.0)
    return np.asarray(largest * options.authority)


def velocity_scale(platform: Platform) -> Floats:
    """(9,) largest speed of each axis by itself, m/s and rad/s, found in the same way."""
    return _axis_limits(platform, "velocity")


def _axis_limits(platform: Platform, name: str) -> Floats:
    scale = np.zeros(len(AXES))
    if platform.carriage is not None:
        scale[:2] = getattr(platform.carriage, name)
    scale[2:8] = getattr(platform.hexapod, name) / np.abs(neutral_jacobian(platform.hexapod)).max(axis=0)
    if platform.turntable is not None:
        scale[8] = getattr(platform.turntable, name)
    return scale


def free_axes(frozen: tuple[str, ...]) -> Floats:
    """(9,) 0 for each frozen axis, 1 for the others."""
    return np.array([float(axis not in frozen) for axis in AXES])
