"""Inverse and forward kinematics of a configured hexapod, for people: NumPy in, NumPy out."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..arrays import FLOAT, vec3, vec6
from ..errors import DataError, GeometryError
from .kernels.geometry import HexapodGeometry, forward_kinematics, leg_extensions
from .machines import Hexapod
from .parameters import geometry_of

_CLOSED = 1e-9 if FLOAT is np.float64 else 1e-5
"""Largest leg error of a pose that closes, m."""


@wp.kernel(enable_backward=False, module="unique")
def _inverse(g: HexapodGeometry, pose: wp.array(dtype=vec6), extensions: wp.array(dtype=vec6)) -> None:
    i = wp.tid()
    p = pose[i]
    extensions[i] = leg_extensions(g, vec3(p[0], p[1], p[2]), vec3(p[3], p[4], p[5]))


@wp.kernel(enable_backward=False, module="unique")
def _forward(
    g: HexapodGeometry,
    extensions: wp.array(dtype=vec6),
    guess: wp.array(dtype=vec6),
    pose: wp.array(dtype=vec6),
) -> None:
    i = wp.tid()
    p = guess[i]
    pose[i] = forward_kinematics(g, extensions[i], vec3(p[0], p[1], p[2]), vec3(p[3], p[4], p[5]))


def _sixes(label: str, values: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim not in (1, 2) or array.shape[-1] != 6:
        raise DataError(f"{label} must be 6 numbers, or (n, 6); found shape {array.shape}")
    if not np.isfinite(array).all():
        raise DataError(f"{label} is not finite: {array[~np.isfinite(array)][0]} among its values")
    return array


def _launch(kernel: Any, hexapod: Hexapod, *inputs: NDArray[np.float64]) -> NDArray[np.float64]:
    n = inputs[0].reshape(-1, 6).shape[0]
    arrays = [wp.array(np.broadcast_to(x, (n, 6)), dtype=vec6, device="cpu") for x in inputs]
    result = wp.zeros(n, dtype=vec6, device="cpu")
    wp.launch(kernel, n, inputs=[geometry_of(hexapod), *arrays], outputs=[result], device="cpu")
    return np.asarray(result.numpy(), dtype=np.float64).reshape(inputs[0].shape)


def legs_of_pose(hexapod: Hexapod, pose: ArrayLike) -> NDArray[np.float64]:
    """Eqs. (12), (13): extensions (..., 6), m, of poses [x, y, z, roll, pitch, yaw], m and rad."""
    return _launch(_inverse, hexapod, _sixes("pose", pose))


def pose_of_legs(
    hexapod: Hexapod, extensions: ArrayLike, guess: ArrayLike = (0.0,) * 6
) -> NDArray[np.float64]:
    """Poses (..., 6) with these leg extensions, m: forward kinematics by Newton iteration from ``guess``.

    Raises:
        GeometryError: no pose near ``guess`` has these legs.
    """
    target = _sixes("extensions", extensions)
    pose = _launch(_forward, hexapod, target, _sixes("guess", guess))
    if not np.isfinite(pose).all() or np.abs(legs_of_pose(hexapod, pose) - target).max() > _CLOSED:
        raise GeometryError(
            "no pose near the first guess has these leg extensions: the legs cannot close, "
            "or the way there passes a singular pose"
        )
    return pose
