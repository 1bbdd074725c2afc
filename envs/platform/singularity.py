"""Singular poses, in which the legs do not hold the platform: it is kept from coming to rest near one."""

from __future__ import annotations

import warp as wp

from ..precision import real, vec3, vec6
from .hexapod import NEWTON_TOLERANCE, Jacobian, determinant, forward_kinematics, leg_extensions, leg_jacobian
from .state import Machine, Motion

NEARLY_SINGULAR = wp.constant(real(0.15))
"""Clearance (share of neutral's det(J)) below which the platform is not let come to rest."""

FAR_FROM_SINGULAR = wp.constant(real(0.75))
"""Clearance from which braking is taken not to lead to a singular pose."""

NEIGHBOURHOOD = wp.constant(real(0.35))
"""Largest change of an Euler angle while the legs brake, rad; more means a singular pose between."""


@wp.func
def clearance(m: Machine, displacement: vec3, beta: vec3) -> real:
    """det(J) of a pose over that of neutral: 0 in a singular pose, negative behind it."""
    return determinant(leg_jacobian(m.geometry, displacement, beta)) / m.neutral_determinant


@wp.func
def is_clear(m: Machine, pose: vec6, extensions: vec6, beta: vec3, least: real) -> bool:
    """Whether a pose has these legs, is a neighbour of the one with ``beta``, and not nearly singular.

    Behind a singular pose Newton's iteration finds no pose, or one far off. Comparisons with NaN are false.
    """
    displacement = vec3(pose[0], pose[1], pose[2])
    angles = vec3(pose[3], pose[4], pose[5])
    error = wp.max(wp.abs(leg_extensions(m.geometry, displacement, angles) - extensions))
    closes = error <= real(10.0) * NEWTON_TOLERANCE
    near = wp.max(wp.abs(angles - beta)) <= NEIGHBOURHOOD
    return closes and near and clearance(m, displacement, angles) >= least


@wp.func
def keeps_clear(
    m: Machine,
    start: Motion,
    jacobian: Jacobian,
    displacement: vec3,
    beta: vec3,
    extensions: vec6,
    rates: vec6,
) -> bool:
    """Whether the platform, braking from a pose with this Jacobian, comes to rest clear of singular poses.

    While each leg brakes, the extensions it comes to rest at stay the same, so what holds now holds until
    rest. In a nearly singular pose any motion that ends clearer than it began is allowed.
    """
    now = determinant(jacobian) / m.neutral_determinant
    if now >= FAR_FROM_SINGULAR:
        return True
    least = wp.min(NEARLY_SINGULAR, clearance(m, start.displacement, start.beta))
    if now < least:
        return False
    halfway = extensions
    resting = extensions
    for i in range(6):
        way = real(0.5) * rates[i] * wp.abs(rates[i]) / m.acceleration[i + 2]
        halfway[i] = extensions[i] + real(0.5) * way
        resting[i] = extensions[i] + way
    middle = forward_kinematics(m.geometry, halfway, displacement, beta)
    rest = forward_kinematics(
        m.geometry, resting, vec3(middle[0], middle[1], middle[2]), vec3(middle[3], middle[4], middle[5])
    )
    return is_clear(m, middle, halfway, beta, least) and is_clear(m, rest, resting, beta, least)
