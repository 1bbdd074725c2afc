"""Kernel parameters of a configured motion base."""

from __future__ import annotations

from itertools import product
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.linalg import expm

from ..arrays import mat63, mat65, vec3, vec6, vec9
from .kernels.geometry import HexapodGeometry
from .kernels.step import Machine
from .kinematics import FAR_FROM_SINGULAR, braking_stays_clear, check_geometry, neutral_jacobian
from .machines import ActuatorDynamics, Hexapod, Platform, limits_of


def geometry_of(hexapod: Hexapod) -> Any:
    """The kernel's constants of a hexapod."""
    geometry: Any = HexapodGeometry()
    geometry.upper = mat63(*np.ravel(hexapod.upper_joints))
    geometry.lower = mat63(*np.ravel(hexapod.lower_joints))
    geometry.neutral = vec3(*hexapod.neutral)
    geometry.neutral_lengths = vec6(*hexapod.neutral_lengths)
    return geometry


def lag_transition(dynamics: ActuatorDynamics, dt: float) -> NDArray[np.float64]:
    """(2, 5) matrix from [y, ydot, u, udot, uddot] to [y, ydot] one step later, u being the set-point.

    Zero where there is no lag; such a subsystem is not filtered.
    """
    omega = dynamics.natural_frequency
    if omega is None:
        return np.zeros((2, 5))
    system = np.zeros((5, 5))
    system[0, 1] = 1.0
    system[1, :3] = [-(omega**2), -2.0 * dynamics.damping * omega, omega**2]
    system[2, 3] = system[3, 4] = 1.0
    return np.asarray(expm(system * dt)[:2])


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


_CORNERS: Final = np.array(list(product((-1.0, 1.0), repeat=6)))
"""Every combination of the ways that six legs go."""

_SHORTEST_ARM: Final = 0.1
"""Of the head about the turntable's axis, m: a turntable right below it may not turn with any jerk."""


def braking_jerk(platform: Platform) -> NDArray[np.float64]:
    """(9,) jerk of each actuator with which limits brake, m/s^3 and rad/s^3; 0 for any.

    With all actuators of a subsystem at it, in the worst combination of signs, the force at the cab's
    reference point and at the head changes at no more than the felt jerk of the platform's ``braking``. This
    is reckoned at neutral.
    """
    felt = platform.braking.jerk
    if felt is None:
        return np.zeros(9)
    cab = np.array(platform.cab.reference_point)
    points = [cab, cab + np.array(platform.cab.head)]
    of_legs = np.linalg.inv(neutral_jacobian(platform.hexapod))
    legs = max(
        np.linalg.norm(
            _CORNERS @ (of_legs[:3] - np.cross(point, of_legs[3:], axisb=0, axisc=0)).T, axis=1
        ).max()
        for point in points
    )
    arm = max(_SHORTEST_ARM, *(float(np.hypot(*point[:2])) for point in points))
    return felt / np.array([np.sqrt(2.0)] * 2 + [legs] * 6 + [arm])


def machine_parameters(platform: Platform, dt: float) -> Any:
    """The kernel's :class:`~.state.Machine` of a platform at a time step, s.

    Raises:
        GeometryError: the hexapod is singular at neutral.
    """
    check_geometry(platform.hexapod)
    machine: Any = Machine()
    machine.geometry = geometry_of(platform.hexapod)
    machine.neutral_determinant = float(np.linalg.det(neutral_jacobian(platform.hexapod)))
    machine.far_from_singular = FAR_FROM_SINGULAR if braking_stays_clear(platform.hexapod) else np.inf
    for name, values in limits_of(platform).items():
        setattr(machine, name, vec9(*values))
    machine.jerk = vec9(*braking_jerk(platform))
    machine.felt_jerk = platform.braking.jerk or 0.0
    cab = np.array(platform.cab.reference_point)
    machine.cab = vec3(*cab)
    machine.head = vec3(*(cab + np.array(platform.cab.head)))
    dynamics = _dynamics(platform)
    machine.lag = mat65(*np.concatenate([lag_transition(d, dt) for d in dynamics]).ravel())
    lags = [int(d.natural_frequency is not None) for d in dynamics]
    machine.lags, machine.dead_steps = wp.vec3i(*lags), wp.vec3i(*dead_steps(platform, dt))
    machine.has_dynamics = int(any(lags) or any(dead_steps(platform, dt)))
    return machine
