"""The machine in CasADi's symbols: the kernels' equations, for controllers that optimize.

Kernels step a machine fast; an optimizer needs the same equations as expressions that it can differentiate.
Nothing is simplified: both agree to round-off. The order of rotation is roll, pitch, yaw,
beta = [phi, theta, psi], and V_I = L_IB V_B. Positions, rates and accelerations are columns of nine in
the order of ``AXES``: carriage x, y; hexapod x, y, z, roll, pitch, yaw; turntable; m and rad from neutral.

A leg's vector is d = L_IH A - B + S, Eqs. (12) and (13). With v = ddot and a = dddot,

    l = |d| - L,    ldot = d.v / |d|,    lddot = (v.v + d.a - ldot^2) / |d|.

Where there is a C compiler, functions become machine code with the same numbers (:func:`compiled`). Libraries
lie in the cache folder under a hash of source and command, so nothing stale is loaded.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..envs.cues import GRAVITY
from ..envs.errors import ConfigurationError
from ..envs.platform import Hexapod, Platform, actuator_limits
from ..envs.simulator.simulator import N_AXES
from ..envs.storage import cache_folder, is_private, private_folder, write_bytes, write_text

try:
    import casadi
except ImportError:
    raise ConfigurationError(
        "this controller needs CasADi, which is not installed: pip install 'motion-cueing-gym[optimal]'"
    ) from None

cs: Any = casadi
"""The module ``casadi``."""

Expression = Any
"""A symbolic column vector or matrix: ``SX``, ``MX`` or ``DM``."""


def rotation(beta: Expression) -> Expression:
    """Eq. (4): (3, 3) L_IB = Rx(phi) Ry(theta) Rz(psi)."""
    sp, cp = cs.sin(beta[0]), cs.cos(beta[0])
    st, ct = cs.sin(beta[1]), cs.cos(beta[1])
    ss, c = cs.sin(beta[2]), cs.cos(beta[2])
    rows = (
        (ct * c, -ct * ss, st),
        (cp * ss + sp * st * c, cp * c - sp * st * ss, -sp * ct),
        (sp * ss - cp * st * c, sp * c + cp * st * ss, cp * ct),
    )
    return _matrix(rows)


def turntable_rotation(psi_t: Expression) -> Expression:
    """Eq. (6), transposed: (3, 3) L_HS = Rz(psi_T), from the cab to the hexapod's platform."""
    s, c = cs.sin(psi_t), cs.cos(psi_t)
    return _matrix(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def rate_matrix(beta: Expression) -> Expression:
    """Eq. (9): (3, 3) R_B, with omega_BB = R_B betadot."""
    st, ct = cs.sin(beta[1]), cs.cos(beta[1])
    ss, c = cs.sin(beta[2]), cs.cos(beta[2])
    return _matrix(((ct * c, ss, 0.0), (-ct * ss, c, 0.0), (st, 0.0, 1.0)))


def rate_matrix_derivative(beta: Expression, beta_rate: Expression) -> Expression:
    """(3, 3) time derivative of R_B of Eq. (9)."""
    st, ct = cs.sin(beta[1]), cs.cos(beta[1])
    ss, c = cs.sin(beta[2]), cs.cos(beta[2])
    dt, ds = beta_rate[1], beta_rate[2]
    rows = (
        (-st * c * dt - ct * ss * ds, c * ds, 0.0),
        (st * ss * dt - ct * c * ds, -ss * ds, 0.0),
        (ct * dt, 0.0, 0.0),
    )
    return _matrix(rows)


def angular_velocity(beta: Expression, beta_rate: Expression) -> Expression:
    """Eqs. (7) and (28): (3,) omega_BB = R_B betadot."""
    return rate_matrix(beta) @ beta_rate


def angular_acceleration(
    beta: Expression, beta_rate: Expression, beta_acceleration: Expression
) -> Expression:
    """(3,) omegadot_BB = R_B betaddot + Rdot_B betadot."""
    return rate_matrix(beta) @ beta_acceleration + rate_matrix_derivative(beta, beta_rate) @ beta_rate


def _matrix(rows: tuple[tuple[Expression, ...], ...]) -> Expression:
    return cs.vertcat(*(cs.horzcat(*row) for row in rows))


class Pose(NamedTuple):
    """Motion of the platform: each (3,), displacement in F_V, Euler angles; SI units, radians."""

    displacement: Expression
    beta: Expression
    velocity: Expression
    beta_rate: Expression
    acceleration: Expression
    beta_acceleration: Expression


class Legs(NamedTuple):
    """Extensions, rates and accelerations of the six legs, each (6,), m, m/s, m/s^2."""

    extension: Expression
    rate: Expression
    acceleration: Expression


def leg_motion(hexapod: Hexapod, pose: Pose) -> Legs:
    """The legs of a moving platform."""
    l_ih = rotation(pose.beta)
    omega = angular_velocity(pose.beta, pose.beta_rate)
    omega_dot = angular_acceleration(pose.beta, pose.beta_rate, pose.beta_acceleration)
    extensions, rates, accelerations = [], [], []
    for upper, offset, neutral_length in _joints(hexapod):
        d = l_ih @ upper + offset + pose.displacement
        turning = cs.cross(omega, upper)
        v = pose.velocity + l_ih @ turning
        a = pose.acceleration + l_ih @ (cs.cross(omega_dot, upper) + cs.cross(omega, turning))
        length = cs.norm_2(d)
        rate = cs.dot(d, v) / length
        extensions.append(length - neutral_length)
        rates.append(rate)
        accelerations.append((cs.dot(v, v) + cs.dot(d, a) - rate**2) / length)
    return Legs(cs.vertcat(*extensions), cs.vertcat(*rates), cs.vertcat(*accelerations))


def clearance(hexapod: Hexapod, displacement: Expression, beta: Expression) -> Expression:
    """Determinant of J over its value at neutral: 1 there, 0 in a singular pose."""
    jacobian = _jacobian(hexapod, displacement, beta)
    neutral = _jacobian(hexapod, cs.DM.zeros(3), cs.DM.zeros(3))
    return _determinant(jacobian) / float(cs.det(neutral))


def _determinant(matrix: Expression) -> Expression:
    """Of a 6 x 6 matrix, by Laplace's expansion along its first three columns: 20 products of 3 x 3 minors.

    Half the operations of an expansion row by row, also in its derivatives.
    """
    left, right = matrix[:, :3], matrix[:, 3:]
    total: Expression = 0.0
    for rows in combinations(range(6), 3):
        others = [row for row in range(6) if row not in rows]
        sign = (-1.0) ** (sum(rows) - sum(range(3)))
        total += sign * cs.det(left[list(rows), :]) * cs.det(right[others, :])
    return total


def _jacobian(hexapod: Hexapod, displacement: Expression, beta: Expression) -> Expression:
    """(6, 6) leg rates for [Sdot, omega_HI]: rows [u, (L_IH A) x u], u along the leg."""
    l_ih = rotation(beta)
    rows = []
    for upper, offset, _ in _joints(hexapod):
        arm = l_ih @ upper
        d = arm + offset + displacement
        u = d / cs.norm_2(d)
        rows.append(cs.horzcat(u.T, cs.cross(arm, u).T))
    return cs.vertcat(*rows)


def _joints(hexapod: Hexapod) -> list[tuple[Expression, Expression, float]]:
    """A_i, S_0 - B_i and L_i of every leg."""
    neutral: NDArray[np.float64] = np.array(hexapod.neutral)
    parts = zip(hexapod.upper_joints, hexapod.lower_joints, hexapod.neutral_lengths, strict=True)
    return [(cs.DM(upper), cs.DM(neutral - np.array(lower)), float(length)) for upper, lower, length in parts]


_ARGUMENTS: Final = ("position", "rate", "acceleration")


class SymbolicMachine:
    """Functions of one machine; each takes numbers or symbols, one column (9,) or many (9, n).

    Args:
        platform: The machine. A missing subsystem stays among the axes; its limits hold it still.

    Attributes:
        platform: The machine.
        cues: (position, rate, acceleration) to specific force f_SS (3,), m/s^2, and angular velocity
            omega_SS (3,), rad/s, at the cab's reference point, Eqs. (1), (7), (36) to (40).
        legs: (position) to leg extensions (6,), Eqs. (12) and (13), m.
        leg_rates: (position, rate) to (6,), m/s.
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
        clear = clearance(platform.hexapod, q[2:5], q[5:8])
        self.cues = cs.Function("cues", [q, v, a], list(cues(cab, q, v, a)))
        self.legs = cs.Function("legs", [q], [legs.extension])
        self.leg_rates = cs.Function("leg_rates", [q, v], [legs.rate])
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


_FLAGS: Final = ("-O2", "-ffp-contract=off", "-fPIC", "-shared")
"""No flag that would change arithmetic: results are those of the function not compiled, to the bit.

Compilers contract a * b + c to one rounding where the processor can, unless told not to.
"""

_COMPILERS: Final = ("cc", "gcc", "clang")

_COMPILER_TIMEOUT: Final = 300.0
"""Longest time of a compilation, s."""


def find_compiler() -> str | None:
    """A C compiler: ``CC`` of the environment, else one on the path; None without one."""
    names = [os.environ["CC"]] if os.environ.get("CC") else list(_COMPILERS)
    return next((path for name in names if (path := shutil.which(name))), None)


def compiled(function: Any) -> Any:
    """The function as machine code; the function itself where it cannot be compiled.

    Args:
        function: A CasADi function.
    """
    compiler = find_compiler()
    if compiler is None:
        return function
    generator = cs.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    source = generator.dump()
    key = hashlib.sha256("\n".join((*_FLAGS, compiler, platform.platform(), source)).encode()).hexdigest()
    try:
        library = _code_folder() / f"{function.name()}-{key}.so"
        if not _is_intact(library):
            code = _compile(compiler, source)
            write_bytes(library, code)
            write_text(_seal(library), hashlib.sha256(code).hexdigest())
        return cs.external(function.name(), str(library))
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return function


def _code_folder() -> Path:
    """The cache where the user alone can write it, else a private folder: code from there is executed."""
    folder = cache_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder if is_private(folder) else private_folder()


def _seal(library: Path) -> Path:
    """The file with the library's own hash."""
    return library.with_suffix(".sha256")


def _is_intact(library: Path) -> bool:
    """Whether a library of the user exists undamaged: loading a damaged one would end the process."""
    if not (is_private(library) and is_private(_seal(library))):
        return False
    return hashlib.sha256(library.read_bytes()).hexdigest() == _seal(library).read_text(encoding="utf-8")


def _compile(compiler: str, source: str) -> bytes:
    """The shared library of a C source."""
    with tempfile.TemporaryDirectory() as folder:
        code, library = Path(folder) / "function.c", Path(folder) / "function.so"
        code.write_text(source, encoding="utf-8")
        command = [compiler, *_FLAGS, "-o", str(library), str(code), "-lm"]
        subprocess.run(command, check=True, capture_output=True, timeout=_COMPILER_TIMEOUT)
        return library.read_bytes()
