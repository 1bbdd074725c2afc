"""Kinematics of a hexapod in NumPy, for everything outside the kernels: rotations, legs, poses, reach.

A pose is [x, y, z, roll, pitch, yaw] of the platform from neutral, m and rad. A leg is
l = L_IH A - B + S_0 + s, Eq. (12); its length changes at l . (ds/dt + omega x L_IH A) / |l|.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError, GeometryError
from .machines import Hexapod

Floats = NDArray[np.float64]

NEARLY_SINGULAR: Final = 0.15
"""Clearance (share of neutral's det(J)) below which the platform is not let come to rest."""

FAR_FROM_SINGULAR: Final = 0.75
"""Clearance from which braking may be taken not to lead to a singular pose, if sampling says so."""

NEIGHBORHOOD: Final = 0.35
"""Largest difference of an Euler angle between neighboring poses, rad; more means a singular pose between."""

_STEP: Final = 0.01
"""Time step at which a geometry must stay clear of singular poses, s."""

_FASTEST: Final = 2.0
"""Leg speed for which that must hold at most, m/s: real legs are slower. Machines without limits, as studies
use them, are faster; where their pose does not close the legs stop."""

_CORNERS: Final = np.array(list(product((-1.0, 1.0), repeat=6)))
"""Every combination of the ways that six legs go."""

_DIRECTIONS: Final = np.random.default_rng(0).normal(size=(12, 6))
_WAYS: Final = np.vstack(
    [np.eye(6), -np.eye(6), _DIRECTIONS / np.abs(_DIRECTIONS).max(axis=1, keepdims=True)]
)
_SHARES: Final = np.linspace(0.0, 1.0, 6)
_WORST: Final = 24
"""Directions in which poses are looked at, shares of the reach, and from how many of them legs brake."""

_DIFFERENCE: Final = 1e-6
"""Step of a difference quotient, m and rad."""

_LOOK_ITERATIONS: Final = 8
"""Newton's iterations of a look; a pose that needs more is not near."""

_LEAST_CONDITION: Final = 1e-3
"""Least ratio of the neutral Jacobian's singular values (lengths over the joint radius)."""

_NEWTON_ITERATIONS: Final = 20
"""More than Newton ever needs from a neighboring pose (3 to 5)."""

_NEWTON_TOLERANCE: Final = 1e-13
"""Largest leg error at which the iteration stops, m."""

_CLOSED: Final = 1e-9
"""Largest leg error of a pose that closes, m."""


def rotation(angles: ArrayLike) -> Floats:
    """Eq. (4): (..., 3, 3) L_IB = Rx(roll) Ry(pitch) Rz(yaw) of Euler angles (..., 3)."""
    (sp, st, ss), (cp, ct, cs) = _sines_cosines(angles)
    rows = [
        [ct * cs, -ct * ss, st],
        [cp * ss + sp * st * cs, cp * cs - sp * st * ss, -sp * ct],
        [sp * ss - cp * st * cs, sp * cs + cp * st * ss, cp * ct],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def turning_axes(angles: ArrayLike) -> Floats:
    """(..., 3, 3) whose product with Euler rates is the angular velocity in inertial axes, L_IB R_B.

    Its columns: roll turns about x, pitch about Rx y, yaw about Rx Ry z.
    """
    (sp, st, _), (cp, ct, _) = _sines_cosines(angles)
    zero = np.zeros_like(sp)
    rows = [[zero + 1.0, zero, st], [zero, cp, -sp * ct], [zero, sp, cp * ct]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _sines_cosines(angles: ArrayLike) -> tuple[Floats, Floats]:
    first = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
    return np.sin(first), np.cos(first)


def leg_vectors(hexapod: Hexapod, pose: Floats) -> tuple[Floats, Floats]:
    """Eq. (12), each (..., 6, 3) in F_V, m: A_i from the origin of F_H, and the legs from B_i to A_i."""
    arms = np.array(hexapod.upper_joints) @ np.swapaxes(rotation(pose[..., 3:]), -1, -2)
    origin = np.array(hexapod.neutral) + pose[..., :3]
    return arms, arms + origin[..., None, :] - np.array(hexapod.lower_joints)


class LegMotion(NamedTuple):
    """Legs of moving poses.

    Args:
        extension: (..., 6) from neutral, m.
        rate: (..., 6) m/s.
        clearance: (...) det of the Jacobian over that at neutral: 0 in a singular pose, negative behind it.
    """

    extension: Floats
    rate: Floats
    clearance: Floats


def leg_motion(hexapod: Hexapod, pose: Floats, pose_rate: Floats) -> LegMotion:
    """Extensions and rates of the legs of poses (..., 6) and their rates (..., 6), and the clearance."""
    arms, legs = leg_vectors(hexapod, pose)
    jacobian = leg_jacobian(arms, legs)
    omega = turning_axes(pose[..., 3:]) @ pose_rate[..., 3:, None]
    twist = np.concatenate([pose_rate[..., :3, None], omega], axis=-2)
    return LegMotion(
        np.linalg.norm(legs, axis=-1) - hexapod.neutral_lengths,
        (jacobian @ twist)[..., 0],
        np.linalg.det(jacobian) / np.linalg.det(neutral_jacobian(hexapod)),
    )


def leg_jacobian(arms: Floats, legs: Floats) -> Floats:
    """(..., 6, 6) leg rates for the platform's velocity and angular velocity, of :func:`leg_vectors`."""
    directions = legs / np.linalg.norm(legs, axis=-1, keepdims=True)
    return np.concatenate([directions, np.cross(arms, directions)], axis=-1)


def neutral_jacobian(hexapod: Hexapod) -> Floats:
    """(6, 6) the Jacobian at neutral, where L_IH is unity."""
    upper = np.array(hexapod.upper_joints)
    return leg_jacobian(upper, upper - np.array(hexapod.lower_joints) + np.array(hexapod.neutral))


def legs_of_pose(hexapod: Hexapod, pose: ArrayLike) -> Floats:
    """Inverse kinematics, Eqs. (12), (13): extensions (..., 6), m, of poses (..., 6).

    Raises:
        DataError: not six finite numbers, or rows of them.
    """
    _, legs = leg_vectors(hexapod, _sixes("pose", pose))
    return np.asarray(np.linalg.norm(legs, axis=-1) - hexapod.neutral_lengths)


def pose_of_legs(hexapod: Hexapod, extensions: ArrayLike, guess: ArrayLike = (0.0,) * 6) -> Floats:
    """Forward kinematics: poses (..., 6) with these leg extensions, m, by Newton iteration from ``guess``.

    Raises:
        DataError: not six finite numbers, or rows of them.
        GeometryError: no pose near ``guess`` has these legs.
    """
    target = _sixes("extensions", extensions)
    pose = np.broadcast_to(_sixes("guess", guess), target.shape).copy()
    error = np.full_like(target, np.inf)
    # What does not close runs away; it is refused below.
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_ITERATIONS):
            arms, legs = leg_vectors(hexapod, pose)
            error = target - (np.linalg.norm(legs, axis=-1) - hexapod.neutral_lengths)
            if not np.abs(error).max() > _NEWTON_TOLERANCE:
                break
            jacobian = leg_jacobian(arms, legs)
            jacobian[..., 3:] = jacobian[..., 3:] @ turning_axes(pose[..., 3:])
            try:
                pose = pose + np.linalg.solve(jacobian, error[..., None])[..., 0]
            except np.linalg.LinAlgError:
                break
    if not np.abs(error).max() <= _CLOSED:
        raise GeometryError(
            "no pose near the first guess has these leg extensions: the legs cannot close, "
            "or the way there passes a singular pose"
        )
    return pose


def _sixes(label: str, values: ArrayLike) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim not in (1, 2) or array.shape[-1] != 6:
        raise DataError(f"{label} must be 6 numbers, or (n, 6); found shape {array.shape}")
    if not np.isfinite(array).all():
        raise DataError(f"{label} is not finite: {array[~np.isfinite(array)][0]} among its values")
    return array


def check_geometry(hexapod: Hexapod) -> None:
    """Refuse a hexapod that does not hold its platform at neutral.

    Raises:
        GeometryError: the platform is below its base; or the Jacobian at neutral is singular, as legs are
            parallel or all meet one line; or legs at full speed lead to a singular pose within a time step.
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
    if not _is_clear_for_a_step(hexapod):
        raise GeometryError(
            f"the hexapod reaches a singular pose within {_STEP:g} s of neutral when its legs move at "
            f"{min(hexapod.velocity, _FASTEST):g} m/s, so no limit keeps it away: move upper_joints, "
            "lower_joints or neutral so that the legs lie less alike, or lower hexapod.velocity"
        )


def _clearances(hexapod: Hexapod, pose: Floats) -> tuple[Floats, Floats, Floats]:
    """Of poses (n, 6): extensions (n, 6), their derivative by the pose (n, 6, 6), and the clearance (n,)."""
    arms, legs = leg_vectors(hexapod, pose)
    jacobian = leg_jacobian(arms, legs)
    clearance = np.linalg.det(jacobian) / np.linalg.det(neutral_jacobian(hexapod))
    jacobian[..., 3:] = jacobian[..., 3:] @ turning_axes(pose[..., 3:])
    return np.linalg.norm(legs, axis=-1) - hexapod.neutral_lengths, jacobian, clearance


def _clearance_after(hexapod: Hexapod, start: Floats, way: Floats) -> Floats:
    """(n,) clearance after legs go a way (n, 6) from poses (n, 6); minus infinity where none near closes."""
    pose = start
    extensions, jacobian, clearance = _clearances(hexapod, pose)
    target = extensions + way
    # What does not close runs away; its error shows it.
    with np.errstate(all="ignore"):
        for _ in range(_LOOK_ITERATIONS):
            try:
                pose = pose + np.linalg.solve(jacobian, (target - extensions)[..., None])[..., 0]
            except np.linalg.LinAlgError:
                return np.full(len(start), -np.inf)
            extensions, jacobian, clearance = _clearances(hexapod, pose)
            error = np.abs(extensions - target).max(axis=1)
            if error.max() <= _CLOSED:
                break
    near = np.abs(pose - start)[:, 3:].max(axis=1) <= NEIGHBORHOOD
    return np.where((error <= _CLOSED) & near, clearance, -np.inf)


@lru_cache(maxsize=4096)
def _is_clear_for_a_step(hexapod: Hexapod) -> bool:
    """Whether legs at full speed, in every combination of ways, are at clear poses after a time step."""
    step = min(hexapod.velocity, _FASTEST) * _STEP
    way = np.clip(step * _CORNERS, *hexapod.extension)
    return bool(_clearance_after(hexapod, np.zeros_like(way), way).min() >= NEARLY_SINGULAR)


@lru_cache(maxsize=4096)
def braking_stays_clear(hexapod: Hexapod) -> bool:
    """Whether legs that brake in poses far from singular ones come to rest clear of them: by sampling.

    Poses lie on straight ways from neutral. From those where it falls most, all legs go on for their braking
    distance, each towards where the clearance falls, and there must be twice the clearance needed.
    """
    above = np.array(hexapod.upper_joints)
    radius = float(np.linalg.norm(above - above.mean(axis=0), axis=1).mean())
    span = 2.0 * max(-hexapod.extension[0], hexapod.extension[1])
    reach = np.append([span] * 3, [min(span / radius, _LARGEST_ANGLE)] * 3)
    poses = (_SHARES[:, None, None] * (_WAYS * reach)).reshape(-1, 6)
    extensions, jacobian, clearance = _clearances(hexapod, poses)
    within = (extensions >= hexapod.extension[0]) & (extensions <= hexapod.extension[1])
    chosen = within.all(axis=1) & (clearance >= FAR_FROM_SINGULAR)
    poses, jacobian, clearance = poses[chosen], jacobian[chosen], clearance[chosen]
    beside = poses[:, None, :] + _DIFFERENCE * np.eye(6)
    slope = (_clearances(hexapod, beside)[2] - clearance[:, None]) / _DIFFERENCE
    slope = np.asarray(
        np.linalg.solve(np.swapaxes(jacobian, -1, -2), slope[..., None])[..., 0], dtype=np.float64
    )
    # Whole time steps may take half a step longer than the parabola of braking.
    stop = 0.5 * hexapod.velocity * (hexapod.velocity / hexapod.acceleration + _STEP)
    worst = np.argsort(clearance - stop * np.abs(slope).sum(axis=1))[:_WORST]
    after = _clearance_after(hexapod, poses[worst], -stop * np.sign(slope[worst]))
    return bool(after.min() >= 2.0 * NEARLY_SINGULAR)


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
    poses = np.where(_AXES[:, None] == np.arange(6), (_SIGNS * distances)[..., None], 0.0)
    arms, legs = leg_vectors(hexapod, poses)
    extensions = np.linalg.norm(legs, axis=-1) - hexapod.neutral_lengths
    # Lengths at neutral are not always their own to the last bit; no travel may be without neutral.
    lowest, highest = hexapod.extension[0] - _ROUNDING, hexapod.extension[1] + _ROUNDING
    in_travel = np.all((extensions >= lowest) & (extensions <= highest), axis=-1)
    clearance = np.linalg.det(leg_jacobian(arms, legs)) / np.linalg.det(neutral_jacobian(hexapod))
    return np.asarray(in_travel & (clearance >= NEARLY_SINGULAR))
