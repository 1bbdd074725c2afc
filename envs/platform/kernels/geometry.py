"""Geometry of the motion base: rotations, hexapod, points of the cab; Eqs. (2) to (15), (30) to (47).

The order of rotation is roll, pitch, then yaw, beta = [phi, theta, psi]: with a turntable on top of the
hexapod its angle simply adds to psi, Eq. (3). V_I = L_IB V_B. A pose is the displacement s of the platform
from neutral, in F_V (S = S_0 + s), and the Euler angles beta_H. The Jacobian is two 6 x 3 blocks, leg rates
= U Sdot + W omega_HI, so that its inverse needs 3 x 3 matrices only, by normal equations. Every function
also runs in plain Python, with Warp's vectors and matrices as arguments.
"""

from __future__ import annotations

import warp as wp

from ...arrays import mat33, mat63, real, vec3, vec6, vec7
from ...cues import GRAVITY


@wp.func
def rotation(beta: vec3) -> mat33:
    """Eq. (4): L_IB = Rx(phi) Ry(theta) Rz(psi), from frame F_B to the inertial frame."""
    sp = wp.sin(beta[0])
    cp = wp.cos(beta[0])
    st = wp.sin(beta[1])
    ct = wp.cos(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    return mat33(
        ct * cs, -ct * ss, st,
        cp * ss + sp * st * cs, cp * cs - sp * st * ss, -sp * ct,
        sp * ss - cp * st * cs, sp * cs + cp * st * ss, cp * ct,
    )  # fmt: skip


@wp.func
def turntable_rotation(psi_t: real) -> mat33:
    """Eq. (6), transposed: L_HS = Rz(psi_T), from the cab to the hexapod's platform."""
    s = wp.sin(psi_t)
    c = wp.cos(psi_t)
    zero = real(0.0)
    return mat33(c, -s, zero, s, c, zero, zero, zero, real(1.0))


@wp.func
def rate_matrix(beta: vec3) -> mat33:
    """Eq. (9): R_B, with omega_BB = R_B betadot (Eq. (7))."""
    st = wp.sin(beta[1])
    ct = wp.cos(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    zero = real(0.0)
    return mat33(ct * cs, ss, zero, -ct * ss, cs, zero, st, zero, real(1.0))


@wp.func
def rate_matrix_inverse(beta: vec3) -> mat33:
    """Eq. (10): T_B = R_B^-1, with betadot = T_B omega_BB (Eq. (8)); singular at theta = +-90 deg."""
    ct = wp.cos(beta[1])
    tt = wp.tan(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    zero = real(0.0)
    return mat33(cs / ct, -ss / ct, zero, ss, cs, zero, -tt * cs, tt * ss, real(1.0))


@wp.func
def rate_matrix_derivative(beta: vec3, beta_rate: vec3) -> mat33:
    """Time derivative of R_B of Eq. (9)."""
    st = wp.sin(beta[1])
    ct = wp.cos(beta[1])
    ss = wp.sin(beta[2])
    cs = wp.cos(beta[2])
    dt = beta_rate[1]
    ds = beta_rate[2]
    zero = real(0.0)
    return mat33(
        -st * cs * dt - ct * ss * ds, cs * ds, zero,
        st * ss * dt - ct * cs * ds, -ss * ds, zero,
        ct * dt, zero, zero,
    )  # fmt: skip


@wp.func
def angular_velocity(beta: vec3, beta_rate: vec3) -> vec3:
    """Eqs. (7) and (28): omega_BB = R_B betadot."""
    return rate_matrix(beta) * beta_rate


@wp.func
def angular_acceleration(beta: vec3, beta_rate: vec3, beta_acceleration: vec3) -> vec3:
    """Time derivative of Eq. (28): omegadot_BB = R_B betaddot + Rdot_B betadot."""
    return rate_matrix(beta) * beta_acceleration + rate_matrix_derivative(beta, beta_rate) * beta_rate


# Hexapod: leg vectors, lengths, rates and forward kinematics, Eqs. (11) to (13).


NEWTON_ITERATIONS = wp.constant(20)
"""More than Newton ever needs from a neighboring pose (3 to 5)."""

NEWTON_TOLERANCE = wp.constant(real(1e-13 if real is wp.float64 else 1e-6))
"""Largest leg error at which the iteration stops, m."""


@wp.struct
class HexapodGeometry:
    """Constants of a hexapod, in meters."""

    upper: mat63  # A_i in F_H, one row a leg
    lower: mat63  # B_i in F_V
    neutral: vec3  # S_0, origin of F_H at neutral, in F_V
    neutral_lengths: vec6  # L_i


@wp.struct
class Jacobian:
    """Leg rates for the platform's velocity (U) and inertial angular velocity (W)."""

    u: mat63
    w: mat63


@wp.func
def leg_vector(g: HexapodGeometry, i: int, displacement: vec3, l_ih: mat33) -> vec3:
    """Eq. (12): l_iI = L_IH A_i - B_i + S."""
    upper = vec3(g.upper[i, 0], g.upper[i, 1], g.upper[i, 2])
    lower = vec3(g.lower[i, 0], g.lower[i, 1], g.lower[i, 2])
    return l_ih * upper - lower + g.neutral + displacement


@wp.func
def leg_extensions(g: HexapodGeometry, displacement: vec3, beta: vec3) -> vec6:
    """Eq. (13): l_i = |l_iI| - L_i."""
    l_ih = rotation(beta)
    extensions = vec6()
    for i in range(6):
        extensions[i] = wp.length(leg_vector(g, i, displacement, l_ih)) - g.neutral_lengths[i]
    return extensions


@wp.func
def leg_jacobian(g: HexapodGeometry, displacement: vec3, beta: vec3) -> Jacobian:
    """Rows u_i = l_i / |l_i| and w_i = (L_IH A_i) x u_i: the time derivative of Eq. (13)."""
    l_ih = rotation(beta)
    u = mat63()
    w = mat63()
    for i in range(6):
        upper = vec3(g.upper[i, 0], g.upper[i, 1], g.upper[i, 2])
        direction = wp.normalize(leg_vector(g, i, displacement, l_ih))
        moment = wp.cross(l_ih * upper, direction)
        for j in range(3):
            u[i, j] = direction[j]
            w[i, j] = moment[j]
    jacobian = Jacobian()
    jacobian.u = u
    jacobian.w = w
    return jacobian


@wp.func
def leg_rates(jacobian: Jacobian, velocity: vec3, beta: vec3, beta_rate: vec3) -> vec6:
    """Time derivative of Eq. (13) for the platform's velocity and Euler rates."""
    omega = rotation(beta) * (rate_matrix(beta) * beta_rate)
    return jacobian.u * velocity + jacobian.w * omega


@wp.func
def rotational_block(jacobian: Jacobian) -> mat33:
    """Schur complement of the normal matrix [U W]^T [U W] after the translations."""
    p = wp.transpose(jacobian.u) * jacobian.u
    q = wp.transpose(jacobian.u) * jacobian.w
    return wp.transpose(jacobian.w) * jacobian.w - wp.transpose(q) * (wp.inverse(p) * q)


@wp.func
def three_rows(m: mat63, first: int) -> mat33:
    """Rows ``first`` to ``first`` + 2."""
    i = first
    return mat33(
        m[i, 0], m[i, 1], m[i, 2],
        m[i + 1, 0], m[i + 1, 1], m[i + 1, 2],
        m[i + 2, 0], m[i + 2, 1], m[i + 2, 2],
    )  # fmt: skip


@wp.func
def determinant(jacobian: Jacobian) -> real:
    """det(J) of the whole Jacobian: 0 in a singular pose, where its sign changes."""
    u_1 = three_rows(jacobian.u, 0)
    schur = three_rows(jacobian.w, 3) - three_rows(jacobian.u, 3) * (
        wp.inverse(u_1) * three_rows(jacobian.w, 0)
    )
    return wp.determinant(u_1) * wp.determinant(schur)


@wp.func
def normal_solve(jacobian: Jacobian, translation: vec3, rotation_part: vec3) -> vec6:
    """Solves J^T J x = b for b given by its two halves."""
    p_inverse = wp.inverse(wp.transpose(jacobian.u) * jacobian.u)
    q = wp.transpose(jacobian.u) * jacobian.w
    omega = wp.inverse(rotational_block(jacobian)) * (
        rotation_part - wp.transpose(q) * (p_inverse * translation)
    )
    velocity = p_inverse * (translation - q * omega)
    return vec6(velocity[0], velocity[1], velocity[2], omega[0], omega[1], omega[2])


@wp.func
def platform_rates(jacobian: Jacobian, beta: vec3, rates: vec6) -> vec6:
    """Platform velocity and Euler rates, [sdot, betadot], of given leg rates: J^-1."""
    twist = normal_solve(jacobian, wp.transpose(jacobian.u) * rates, wp.transpose(jacobian.w) * rates)
    omega = vec3(twist[3], twist[4], twist[5])
    beta_rate = rate_matrix_inverse(beta) * (wp.transpose(rotation(beta)) * omega)
    return vec6(twist[0], twist[1], twist[2], beta_rate[0], beta_rate[1], beta_rate[2])


@wp.func
def forward_kinematics(g: HexapodGeometry, extensions: vec6, displacement: vec3, beta: vec3) -> vec7:
    """Pose [s, beta] with these leg extensions, by Newton iteration from a neighboring pose.

    Its last entry is the largest leg error left, m: the pose is one with these legs only where that is small.
    """
    s = displacement
    b = beta
    error = extensions - leg_extensions(g, s, b)
    count = int(0)
    while wp.max(wp.abs(error)) > NEWTON_TOLERANCE and count < NEWTON_ITERATIONS:
        step = platform_rates(leg_jacobian(g, s, b), b, error)
        s = s + vec3(step[0], step[1], step[2])
        b = b + vec3(step[3], step[4], step[5])
        error = extensions - leg_extensions(g, s, b)
        count = count + 1
    return vec7(s[0], s[1], s[2], b[0], b[1], b[2], wp.max(wp.abs(error)))


@wp.func_grad(forward_kinematics)
def adjoint_forward_kinematics(
    g: HexapodGeometry, extensions: vec6, displacement: vec3, beta: vec3, adjoint: vec7
) -> None:
    """Implicit function theorem: d pose / d extensions = J^-1; the first guess and the error have no part."""
    pose = forward_kinematics(g, extensions, displacement, beta)
    s = vec3(pose[0], pose[1], pose[2])
    b = vec3(pose[3], pose[4], pose[5])
    jacobian = leg_jacobian(g, s, b)
    to_rates = rate_matrix_inverse(b) * wp.transpose(rotation(b))
    moment = wp.transpose(to_rates) * vec3(adjoint[3], adjoint[4], adjoint[5])
    force = vec3(adjoint[0], adjoint[1], adjoint[2])
    x = normal_solve(jacobian, force, moment)
    wp.adjoint[extensions] += jacobian.u * vec3(x[0], x[1], x[2]) + jacobian.w * vec3(x[3], x[4], x[5])


# Points fixed to the cab on the turntable, Eqs. (14), (15), (30) to (40).


@wp.func
def gravity() -> vec3:
    """g_I: gravity in the inertial frame, m/s^2 (z down)."""
    return vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))


@wp.func
def point_on_platform(cab_offset: vec3, psi_t: real) -> vec3:
    """Eqs. (15), (32), (33): OP_HH of a point at ``cab_offset`` = D_o + OP_SS from the turntable's axis."""
    return turntable_rotation(psi_t) * cab_offset


@wp.func
def point_velocity(op: vec3, omega_t: real) -> vec3:
    """Eq. (34): time derivative of OP_HH as the turntable turns."""
    return vec3(-op[1] * omega_t, op[0] * omega_t, real(0.0))


@wp.func
def point_acceleration(op: vec3, omega_t: real, omega_t_dot: real) -> vec3:
    """Eq. (35): second time derivative of OP_HH, third component 0."""
    return vec3(
        -op[1] * omega_t_dot - op[0] * omega_t * omega_t,
        op[0] * omega_t_dot - op[1] * omega_t * omega_t,
        real(0.0),
    )


@wp.func
def relative_acceleration(
    op: vec3, omega_h: vec3, omega_h_dot: vec3, omega_t: real, omega_t_dot: real
) -> vec3:
    """Eq. (37): aa_H, the acceleration of a point of the cab relative to the origin of F_H, in F_H."""
    return (
        point_acceleration(op, omega_t, omega_t_dot)
        + real(2.0) * wp.cross(omega_h, point_velocity(op, omega_t))
        + wp.cross(omega_h, wp.cross(omega_h, op))
        + wp.cross(omega_h_dot, op)
    )


@wp.func
def centripetal_part(op: vec3, omega_t: real) -> vec3:
    """Eq. (47): aa1_H, the low-frequency part of aa_H."""
    return vec3(-op[0] * omega_t * omega_t, -op[1] * omega_t * omega_t, real(0.0))


@wp.func
def cab_angular_velocity(beta: vec3, beta_rate: vec3, psi_t: real, omega_t: real) -> vec3:
    """omega_SS = L_SH omega_HH + [0, 0, omega_T], which is R_S betadot_S by Eqs. (3) and (7)."""
    omega_h = angular_velocity(beta, beta_rate)
    return wp.transpose(turntable_rotation(psi_t)) * omega_h + vec3(real(0.0), real(0.0), omega_t)


@wp.func
def cab_to_inertial(beta: vec3, psi_t: real) -> mat33:
    """L_IS = L_IH L_HS."""
    return rotation(beta) * turntable_rotation(psi_t)


@wp.func
def specific_force(
    cab_offset: vec3,
    beta: vec3,
    beta_rate: vec3,
    beta_acceleration: vec3,
    psi_t: real,
    omega_t: real,
    omega_t_dot: real,
    origin_acceleration: vec3,
) -> vec3:
    """Eqs. (1), (36), (40): f_SS at a point fixed to the cab.

    ``origin_acceleration`` is a_HI: of the origin of F_H, carriage and hexapod together, in F_I.
    """
    op = point_on_platform(cab_offset, psi_t)
    omega_h = angular_velocity(beta, beta_rate)
    omega_h_dot = angular_acceleration(beta, beta_rate, beta_acceleration)
    aa_h = relative_acceleration(op, omega_h, omega_h_dot, omega_t, omega_t_dot)
    acceleration = origin_acceleration + rotation(beta) * aa_h
    return wp.transpose(cab_to_inertial(beta, psi_t)) * (acceleration - gravity())
