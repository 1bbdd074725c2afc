"""How a device sits in a car: its attitude, and axes that are reversed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..cues import Floats


@dataclass(frozen=True)
class Mounting:
    """Attitude of a device in the car, and the signs of its axes.

    With R = Rz(yaw) Ry(pitch) Rx(roll), which turns device axes into car axes, and
    S = diag(1, lateral_sign, 1):

        f_car = S R f_device                  (f: specific force)
        w_car = rate_sign S R w_device        (w: angular velocity)

    Attributes:
        roll: Right side down positive, rad.
        pitch: Nose up positive, rad.
        yaw: To the right positive, rad.
        lateral_sign: -1 if the force axes are left-handed.
        rate_sign: -1 if the rates count the other way round than the right-hand rule
            about the force axes says.
    """

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    lateral_sign: int = 1
    rate_sign: int = 1

    @property
    def matrix(self) -> Floats:
        """(3, 3) S R, from device axes to car axes."""
        rotation = Rotation.from_euler("ZYX", [self.yaw, self.pitch, self.roll]).as_matrix()
        return np.asarray(np.diag([1.0, self.lateral_sign, 1.0]) @ rotation)

    def force_in_car(self, force: ArrayLike) -> Floats:
        """Specific force (..., 3) from device axes to car axes."""
        return np.asarray(np.asarray(force) @ self.matrix.T)

    def rate_in_car(self, rate: ArrayLike) -> Floats:
        """Angular velocity (..., 3) from device axes to car axes."""
        return np.asarray(self.rate_sign * (np.asarray(rate) @ self.matrix.T))


def level(rest: ArrayLike) -> tuple[float, float]:
    """Roll and pitch, rad, of a device that measures the specific force ``rest`` (3,) in a level car at rest.

    From rest = R^T [0, 0, -g].
    """
    x, y, z = np.asarray(rest, dtype=np.float64)
    return float(np.arctan2(-y, -z)), float(np.arctan2(x, np.hypot(y, z)))
