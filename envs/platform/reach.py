"""How far a hexapod's platform goes from neutral along each axis by itself."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .machines import Hexapod
from .parameters import leg_jacobian_of, neutral_jacobian
from .singularity import NEARLY_SINGULAR

Floats = NDArray[np.float64]

_POSES: Final = 61
"""Poses looked at on the way, so that the first that is out of reach is found."""

_LOOKS: Final = 4
"""Looks, each between the last pose that was within reach and the first that was not."""

_LARGEST_ANGLE: Final = 0.5 * np.pi
"""Angles are looked at up to here: Euler angles are singular at a pitch of +-90 degrees."""

_ROUNDING: Final = 1e-12
"""Of a leg's length, m."""

_SIGNS: Final = np.tile([-1.0, 1.0], 6)
_AXES: Final = np.repeat(np.arange(6), 2)
"""The twelve ways: each axis down, then up."""


def axis_reach(hexapod: Hexapod) -> Floats:
    """(6, 2) how far down and up surge, sway, heave (m), roll, pitch, yaw (rad) go, both as distances.

    From neutral along one axis, until a leg is at its end or the pose nearly singular.
    """
    return np.array(_reach(hexapod)).reshape(6, 2)


@lru_cache(maxsize=1024)
def _reach(hexapod: Hexapod) -> tuple[float, ...]:
    longest = float(hexapod.neutral_lengths.max()) + hexapod.extension[1]
    far = np.where(_AXES < 3, longest, _LARGEST_ANGLE)
    low, high, ways = np.zeros(12), np.ones(12), np.arange(12)
    for _ in range(_LOOKS):
        shares = np.linspace(low, high, _POSES)
        within = _holds(hexapod, shares * far)
        # Where all hold the way has no end within what is looked at.
        last = np.where(within.all(axis=0), _POSES - 1, np.argmin(within, axis=0) - 1)
        low, high = shares[last, ways], shares[np.minimum(last + 1, _POSES - 1), ways]
    return tuple((low * far).tolist())


def _holds(hexapod: Hexapod, distances: Floats) -> NDArray[np.bool_]:
    """(k, 12) whether poses at distances (k, 12) are within the legs' travel and clear of singular ones."""
    moved = _SIGNS * distances
    upper = np.array(hexapod.upper_joints) @ np.swapaxes(_rotations(moved), -1, -2)
    shift = np.where(_AXES[:, None] == np.arange(3), moved[..., None], 0.0)
    legs = upper + (np.array(hexapod.neutral) + shift)[..., None, :] - np.array(hexapod.lower_joints)
    extensions = np.linalg.norm(legs, axis=-1) - hexapod.neutral_lengths
    # Lengths at neutral are not always their own to the last bit; no travel may be without neutral.
    lowest, highest = hexapod.extension[0] - _ROUNDING, hexapod.extension[1] + _ROUNDING
    in_travel = np.all((extensions >= lowest) & (extensions <= highest), axis=-1)
    clearance = np.linalg.det(leg_jacobian_of(upper, legs)) / np.linalg.det(neutral_jacobian(hexapod))
    return np.asarray(in_travel & (clearance >= float(NEARLY_SINGULAR)))


def _rotations(moved: Floats) -> Floats:
    """(k, 12, 3, 3) rotations by the last six of each (k, 12), about x, y, z; the first six are none."""
    found = np.broadcast_to(np.eye(3), (*moved.shape, 3, 3)).copy()
    for way in range(6, 12):
        about = _AXES[way] - 3
        first, second = (about + 1) % 3, (about + 2) % 3
        c, s = np.cos(moved[:, way]), np.sin(moved[:, way])
        found[:, way, first, first], found[:, way, first, second] = c, -s
        found[:, way, second, first], found[:, way, second, second] = s, c
    return found
