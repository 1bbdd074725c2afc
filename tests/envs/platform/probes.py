"""The kernels' small functions, opened to NumPy: rows in, rows out."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from motion_cueing.baselines.washout.kernels import blocks as tilt
from motion_cueing.envs.arrays import mat33, mat63, real, vec2, vec3, vec6
from motion_cueing.envs.platform import Hexapod, parameters
from motion_cueing.envs.platform.kernels import geometry as cab
from motion_cueing.envs.platform.kernels import geometry as frames
from motion_cueing.envs.platform.kernels import geometry as hexapod

wp.set_module_options({"enable_backward": False})


@wp.struct
class FrameRows:
    rotation: wp.array(dtype=mat33)
    table: wp.array(dtype=mat33)
    rate_matrix: wp.array(dtype=mat33)
    inverse: wp.array(dtype=mat33)
    derivative: wp.array(dtype=mat33)
    omega: wp.array(dtype=vec3)
    omega_dot: wp.array(dtype=vec3)


@wp.kernel
def frame_kernel(
    beta: wp.array(dtype=vec3), rate: wp.array(dtype=vec3), acceleration: wp.array(dtype=vec3), out: FrameRows
) -> None:
    i = wp.tid()
    out.rotation[i] = frames.rotation(beta[i])
    out.table[i] = frames.turntable_rotation(beta[i][2])
    out.rate_matrix[i] = frames.rate_matrix(beta[i])
    out.inverse[i] = frames.rate_matrix_inverse(beta[i])
    out.derivative[i] = frames.rate_matrix_derivative(beta[i], rate[i])
    out.omega[i] = frames.angular_velocity(beta[i], rate[i])
    out.omega_dot[i] = frames.angular_acceleration(beta[i], rate[i], acceleration[i])


@wp.struct
class CabRows:
    op: wp.array(dtype=vec3)
    velocity: wp.array(dtype=vec3)
    acceleration: wp.array(dtype=vec3)
    centripetal: wp.array(dtype=vec3)
    omega: wp.array(dtype=vec3)
    force: wp.array(dtype=vec3)


@wp.kernel
def cab_kernel(
    offset: wp.array(dtype=vec3),
    beta: wp.array(dtype=vec3),
    rate: wp.array(dtype=vec3),
    acceleration: wp.array(dtype=vec3),
    table: wp.array(dtype=vec3),
    origin: wp.array(dtype=vec3),
    out: CabRows,
) -> None:
    i = wp.tid()
    psi = table[i][0]
    omega = table[i][1]
    omega_dot = table[i][2]
    op = cab.point_on_platform(offset[i], psi)
    out.op[i] = op
    out.velocity[i] = cab.point_velocity(op, omega)
    out.acceleration[i] = cab.point_acceleration(op, omega, omega_dot)
    out.centripetal[i] = cab.centripetal_part(op, omega)
    out.omega[i] = cab.cab_angular_velocity(beta[i], rate[i], psi, omega)
    out.force[i] = cab.specific_force(
        offset[i], beta[i], rate[i], acceleration[i], psi, omega, omega_dot, origin[i]
    )


@wp.struct
class LegRows:
    extensions: wp.array(dtype=vec6)
    pose: wp.array(dtype=vec6)
    error: wp.array(dtype=real)
    rates: wp.array(dtype=vec6)
    back: wp.array(dtype=vec6)
    u: wp.array(dtype=mat63)
    w: wp.array(dtype=mat63)
    determinant: wp.array(dtype=real)


@wp.kernel
def leg_kernel(
    g: hexapod.HexapodGeometry, pose: wp.array(dtype=vec6), direction: wp.array(dtype=vec6), out: LegRows
) -> None:
    i = wp.tid()
    p = pose[i]
    d = direction[i]
    beta = vec3(p[3], p[4], p[5])
    jacobian = hexapod.leg_jacobian(g, vec3(p[0], p[1], p[2]), beta)
    rates = hexapod.leg_rates(jacobian, vec3(d[0], d[1], d[2]), beta, vec3(d[3], d[4], d[5]))
    extensions = hexapod.leg_extensions(g, vec3(p[0], p[1], p[2]), beta)
    out.extensions[i] = extensions
    found = hexapod.forward_kinematics(g, extensions, vec3(), vec3())
    out.pose[i] = vec6(found[0], found[1], found[2], found[3], found[4], found[5])
    out.error[i] = found[6]
    out.rates[i] = rates
    out.back[i] = hexapod.platform_rates(jacobian, beta, rates)
    out.u[i] = jacobian.u
    out.w[i] = jacobian.w
    out.determinant[i] = hexapod.determinant(jacobian)


@wp.struct
class TiltRows:
    angles: wp.array(dtype=vec2)
    rates: wp.array(dtype=vec2)


@wp.kernel
def tilt_kernel(
    force: wp.array(dtype=vec2), rate: wp.array(dtype=vec2), psi: wp.array(dtype=vec2), out: TiltRows
) -> None:
    i = wp.tid()
    out.angles[i] = tilt.tilt_angles(force[i], psi[i][0])
    out.rates[i] = tilt.tilt_angle_rates(force[i], rate[i], psi[i][0], psi[i][1])


def _run(
    kernel: Any, rows: Any, inputs: list[tuple[np.ndarray, Any]], *constants: Any
) -> dict[str, np.ndarray]:
    n = max(len(values) for values, _ in inputs)
    arrays = [
        wp.array(np.broadcast_to(values, (n, *values.shape[1:])), dtype=kind, device="cpu")
        for values, kind in inputs
    ]
    out = rows()
    names = list(rows.vars)
    for name in names:
        setattr(out, name, wp.zeros(n, dtype=rows.vars[name].type.dtype, device="cpu"))
    wp.launch(kernel, n, inputs=[*constants, *arrays, out], device="cpu")
    return {name: getattr(out, name).numpy() for name in names}


def frame_rows(
    beta: np.ndarray, rate: np.ndarray | None = None, acceleration: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """frames.py for Euler angles (n, 3), their rates and accelerations; the table is at yaw's angle."""
    zero = np.zeros((1, 3))
    rate, acceleration = (zero if x is None else x for x in (rate, acceleration))
    return _run(frame_kernel, FrameRows, [(x, vec3) for x in (beta, rate, acceleration)])


def cab_rows(
    offset: np.ndarray,
    beta: np.ndarray,
    rate: np.ndarray,
    acceleration: np.ndarray,
    table: np.ndarray,
    origin: np.ndarray,
) -> dict[str, np.ndarray]:
    """cab.py for (n, 3) rows; ``table`` holds angle, rate and acceleration of the turntable."""
    rows = (offset, beta, rate, acceleration, table, origin)
    return _run(cab_kernel, CabRows, [(x, vec3) for x in rows])


def leg_rows(legs: Hexapod, pose: np.ndarray, direction: np.ndarray) -> dict[str, np.ndarray]:
    """hexapod.py for poses (n, 6) and their rates (n, 6)."""
    return _run(leg_kernel, LegRows, [(pose, vec6), (direction, vec6)], parameters.geometry_of(legs))


def tilt_rows(force: np.ndarray, rate: np.ndarray, psi: np.ndarray) -> dict[str, np.ndarray]:
    """tilt.py for forces, their rates, and [psi_S, its rate], (n, 2) each."""
    return _run(tilt_kernel, TiltRows, [(x, vec2) for x in (force, rate, psi)])
