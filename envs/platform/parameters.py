"""From a configured machine to the constants its kernels read."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..arrays import mat63, mat65, vec3, vec6, vec9
from ..errors import GeometryError
from .kernels.geometry import HexapodGeometry
from .kernels.step import NEARLY_SINGULAR, ActuatorDynamics, Machine, lag_transition
from .machines import Hexapod, Platform

UNLIMITED: Final = 1e9
"""Travel of an unlimited turntable in the kernels, rad: finite, so that no infinity meets a zero."""

_LEAST_CONDITION: Final = 1e-3
"""Least ratio of the neutral Jacobian's singular values (lengths over the joint radius)."""

LOCKED: Final = 1.0
"""Velocity and acceleration limit of a missing subsystem, whose travel is zero."""


def geometry_of(hexapod: Hexapod) -> Any:
    """The kernel's constants of a hexapod."""
    geometry: Any = HexapodGeometry()
    geometry.upper = mat63(*np.ravel(hexapod.upper_joints))
    geometry.lower = mat63(*np.ravel(hexapod.lower_joints))
    geometry.neutral = vec3(*hexapod.neutral)
    geometry.neutral_lengths = vec6(*hexapod.neutral_lengths)
    return geometry


def neutral_jacobian(hexapod: Hexapod) -> NDArray[np.float64]:
    """(6, 6) leg rates for the platform's velocity and angular velocity at neutral, where L_IH is unity."""
    upper = np.array(hexapod.upper_joints)
    return leg_jacobian_of(upper, upper - np.array(hexapod.lower_joints) + np.array(hexapod.neutral))


def leg_jacobian_of(upper: NDArray[np.float64], legs: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 6, 6) leg rates for the platform's velocity and angular velocity, both in F_V.

    Args:
        upper: (..., 6, 3) A_i from the origin of F_H, in F_V, m.
        legs: (..., 6, 3) from B_i to A_i, in F_V, m.
    """
    directions = legs / np.linalg.norm(legs, axis=-1, keepdims=True)
    return np.concatenate([directions, np.cross(upper, directions)], axis=-1)


def check_geometry(hexapod: Hexapod) -> None:
    """Refuse a hexapod that does not hold its platform at neutral.

    Raises:
        GeometryError: the platform is below its base, or the Jacobian at neutral is singular: legs are
            parallel or all meet one line.
    """
    radius = float(np.mean(np.linalg.norm(hexapod.upper_joints, axis=1)))
    if radius == 0.0:
        raise GeometryError(
            "hexapod.upper_joints: all joints lie in the origin of F_H; give the six places where the legs "
            "meet the platform, in m"
        )
    height = float(np.mean(np.array(hexapod.upper_joints) - np.array(hexapod.lower_joints), axis=0)[2])
    if height + hexapod.neutral[2] > 0.0:
        raise GeometryError(
            f"hexapod.neutral: with z = {hexapod.neutral[2]:g} the platform lies below its base; z points "
            "down, so give a negative number"
        )
    scaled = neutral_jacobian(hexapod) / np.array([1.0, 1.0, 1.0, radius, radius, radius])
    values = np.linalg.svd(scaled, compute_uv=False)
    if not values[-1] > _LEAST_CONDITION * values[0]:
        raise GeometryError(
            "the hexapod is singular at neutral (smallest over largest singular value "
            f"{values[-1] / values[0]:.1e}): move upper_joints, lower_joints or neutral so that the legs "
            "are not parallel and do not all meet one line"
        )


def _limits(platform: Platform) -> dict[str, NDArray[np.float64]]:
    carriage, hexapod, turntable = platform.carriage, platform.hexapod, platform.turntable
    low, high = np.zeros(9), np.zeros(9)
    velocity, acceleration = np.full(9, LOCKED), np.full(9, LOCKED)
    if carriage is not None:
        low[:2], high[:2] = np.array([carriage.travel_x, carriage.travel_y]).T
        velocity[:2], acceleration[:2] = carriage.velocity, carriage.acceleration
    low[2:8], high[2:8] = hexapod.extension
    velocity[2:8], acceleration[2:8] = hexapod.velocity, hexapod.acceleration
    if turntable is not None:
        low[8], high[8] = turntable.travel or (-UNLIMITED, UNLIMITED)
        velocity[8], acceleration[8] = turntable.velocity, turntable.acceleration
    return {"position_min": low, "position_max": high, "velocity": velocity, "acceleration": acceleration}


def actuator_limits(platform: Platform) -> dict[str, NDArray[np.float64]]:
    """position_min, position_max, velocity, acceleration, each (9,), for people: unlimited is infinite."""
    limits = _limits(platform)
    limits["position_min"][limits["position_min"] <= -UNLIMITED] = -np.inf
    limits["position_max"][limits["position_max"] >= UNLIMITED] = np.inf
    return limits


def dead_steps(platform: Platform, dt: float) -> list[int]:
    """Dead times of carriage, hexapod and turntable in time steps."""
    return [round(dynamics.dead_time / dt) for dynamics in _dynamics(platform)]


def _dynamics(platform: Platform) -> list[ActuatorDynamics]:
    unity = ActuatorDynamics()
    return [
        platform.carriage.dynamics if platform.carriage else unity,
        platform.hexapod.dynamics,
        platform.turntable.dynamics if platform.turntable else unity,
    ]


def machine_parameters(platform: Platform, dt: float) -> Any:
    """The kernel's :class:`~.state.Machine` of a platform at a time step, s.

    Raises:
        GeometryError: the hexapod is singular at neutral.
    """
    check_geometry(platform.hexapod)
    machine: Any = Machine()
    machine.geometry = geometry_of(platform.hexapod)
    machine.neutral_determinant = float(np.linalg.det(neutral_jacobian(platform.hexapod)))
    for name, values in _limits(platform).items():
        setattr(machine, name, vec9(*values))
    cab = np.array(platform.cab.reference_point)
    machine.cab = vec3(*cab)
    machine.head = vec3(*(cab + np.array(platform.cab.head)))
    dynamics = _dynamics(platform)
    machine.lag = mat65(*np.concatenate([lag_transition(d, dt) for d in dynamics]).ravel())
    lags = [int(d.natural_frequency is not None) for d in dynamics]
    machine.lags, machine.dead_steps = wp.vec3i(*lags), wp.vec3i(*dead_steps(platform, dt))
    machine.has_dynamics = int(any(lags) or any(dead_steps(platform, dt)))
    return machine


# How far a hexapod's platform goes from neutral along each axis by itself.


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
