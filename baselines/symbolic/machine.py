"""A motion base in CasADi's symbols: the twin of the kernels in ``envs``, for controllers that optimise.

Kernels step a machine fast; an optimiser needs the same equations as expressions it can differentiate.
Nothing is simplified: both agree to round-off. Positions, rates and accelerations are columns of nine in
the order of ``AXES``: carriage x, y; hexapod x, y, z, roll, pitch, yaw; turntable; m and rad from neutral.
"""

from __future__ import annotations

from typing import Final

from ...envs.cues import GRAVITY
from ...envs.platform import Platform, actuator_limits
from ...envs.simulator import N_AXES
from .frames import angular_acceleration, angular_velocity, rotation, turntable_rotation
from .hexapod import Legs, Pose, clearance, leg_motion
from .library import Expression, cs

_ARGUMENTS: Final = ("position", "rate", "acceleration")


class SymbolicMachine:
    """Functions of one machine; each takes numbers or symbols, one column (9,) or many (9, n).

    Args:
        platform: The machine. A missing subsystem is not left out: whoever optimises holds it still.

    Attributes:
        platform: The machine.
        cues: (position, rate, acceleration) to specific force f_SS (3,), m/s^2, and angular velocity
            omega_SS (3,), rad/s, at the cab's reference point, Eqs. (1), (7), (36) to (40).
        head_cues: The same at the driver's head.
        legs: (position) to leg extensions (6,), Eqs. (12) and (13), m.
        leg_rates: (position, rate) to (6,), m/s.
        leg_accelerations: (position, rate, acceleration) to (6,), m/s^2.
        clearance: (position) to det J over its value at neutral.
        limits: position_min, position_max, velocity, acceleration, each (9,) in the order of
            ``ACTUATORS``; infinite where there is none, 0 to 0 the travel of a missing subsystem.
    """

    def __init__(self, platform: Platform) -> None:
        self.platform = platform
        self.limits = actuator_limits(platform)
        q, v, a = (cs.SX.sym(name, N_AXES) for name in _ARGUMENTS)
        legs = leg_motion(platform.hexapod, _pose(q, v, a))
        cab = cs.DM(platform.cab.reference_point)
        head = cab + cs.DM(platform.cab.head)
        clear = clearance(platform.hexapod, q[2:5], q[5:8])
        self.cues = cs.Function("cues", [q, v, a], list(cues(cab, q, v, a)))
        self.head_cues = cs.Function("head_cues", [q, v, a], list(cues(head, q, v, a)))
        self.legs = cs.Function("legs", [q], [legs.extension])
        self.leg_rates = cs.Function("leg_rates", [q, v], [legs.rate])
        self.leg_accelerations = cs.Function("leg_accelerations", [q, v, a], [legs.acceleration])
        self.clearance = cs.Function("clearance", [q], [clear])

    def leg_motion(self, q: Expression, v: Expression, a: Expression) -> Legs:
        """Extensions, rates and accelerations of the legs as expressions, (6,) each.

        Args:
            q: (9,) positions, m and rad.
            v: (9,) rates.
            a: (9,) accelerations.
        """
        return leg_motion(self.platform.hexapod, _pose(q, v, a))


def cues(point: Expression, q: Expression, v: Expression, a: Expression) -> tuple[Expression, Expression]:
    """Specific force and angular velocity in F_S at a point fixed to the cab, as expressions.

    Args:
        point: (3,) the point from the turntable's axis with the turntable at 0, Eq. (14), m.
        q: (9,) positions, m and rad.
        v: (9,) rates.
        a: (9,) accelerations.
    """
    beta, beta_rate, omega_t, omega_t_dot = q[5:8], v[5:8], v[8], a[8]
    l_hs = turntable_rotation(q[8])
    op = l_hs @ point  # Eq. (33)
    op_dot = cs.vertcat(-op[1] * omega_t, op[0] * omega_t, 0.0)  # Eq. (34)
    op_ddot = cs.vertcat(  # Eq. (35)
        -op[1] * omega_t_dot - op[0] * omega_t**2, op[0] * omega_t_dot - op[1] * omega_t**2, 0.0
    )
    omega = angular_velocity(beta, beta_rate)
    omega_dot = angular_acceleration(beta, beta_rate, a[5:8])
    turning = cs.cross(omega, cs.cross(omega, op)) + cs.cross(omega_dot, op)
    aa_h = op_ddot + 2.0 * cs.cross(omega, op_dot) + turning  # Eq. (37)
    origin = cs.vertcat(a[0] + a[2], a[1] + a[3], a[4] - GRAVITY)  # a_HI - g_I
    force = l_hs.T @ (rotation(beta).T @ origin + aa_h)  # Eqs. (1), (40)
    rate = l_hs.T @ omega + cs.vertcat(0.0, 0.0, omega_t)
    return force, rate


def _pose(q: Expression, v: Expression, a: Expression) -> Pose:
    return Pose(q[2:5], q[5:8], v[2:5], v[5:8], a[2:5], a[5:8])
