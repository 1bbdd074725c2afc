"""Pose of a motion base at a moment, and the points and frames of its parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from ..platform.kinematics import rotation
from ..platform.machines import Platform

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MotionView:
    """Pose of a machine, as it is drawn.

    Args:
        carriage: (2,) position x, y in F_I, m.
        hexapod: (6,) x, y, z, roll, pitch, yaw of the platform from neutral, m and rad.
        turntable: Angle psi_T, positive to the right, rad.
        legs: (6,) extensions from neutral, m.

    Raises:
        DataError: a shape is wrong or a value is not finite.
    """

    carriage: Floats
    hexapod: Floats
    turntable: float
    legs: Floats

    def __post_init__(self) -> None:
        for name, size in (("carriage", 2), ("hexapod", 6), ("legs", 6)):
            object.__setattr__(self, name, _finite(name, getattr(self, name), (size,)))
        object.__setattr__(self, "turntable", float(_finite("turntable", self.turntable, ())))


@dataclass(frozen=True, eq=False)
class Frame:
    """A rigid body's place: p_I = rotation p + origin.

    Args:
        rotation: (3, 3) from the body to F_I.
        origin: (3,) in F_I, m.
    """

    rotation: Floats
    origin: Floats

    def __call__(self, points: Floats) -> Floats:
        """Points (..., 3) of the body, in F_I."""
        return np.asarray(points @ self.rotation.T + self.origin)


def neutral_view() -> MotionView:
    """A machine at rest in the middle."""
    return MotionView(np.zeros(2), np.zeros(6), 0.0, np.zeros(6))


def carriage_frame(motion: MotionView) -> Frame:
    """F_V: level, in the plane of the lower joints."""
    return Frame(np.eye(3), np.array([*motion.carriage, 0.0]))


def platform_frame(platform: Platform, motion: MotionView) -> Frame:
    """F_H: the payload platform."""
    origin = carriage_frame(motion).origin + np.array(platform.hexapod.neutral) + motion.hexapod[:3]
    return Frame(rotation(motion.hexapod[3:]), origin)


def turntable_frame(platform: Platform, motion: MotionView) -> Frame:
    """The turntable: F_H turned by psi_T about its z."""
    base = platform_frame(platform, motion)
    return Frame(base.rotation @ rotation(np.array([0.0, 0.0, motion.turntable])), base.origin)


def joints(platform: Platform, motion: MotionView) -> tuple[Floats, Floats]:
    """Lower and upper joints of the legs, each (6, 3), in F_I, m."""
    lower = carriage_frame(motion)(np.array(platform.hexapod.lower_joints))
    upper = platform_frame(platform, motion)(np.array(platform.hexapod.upper_joints))
    return lower, upper


def head(platform: Platform, motion: MotionView) -> Floats:
    """(3,) The driver's head F_P in F_I, m: Eqs. (14) and (30)."""
    cab = np.array(platform.cab.reference_point) + np.array(platform.cab.head)
    return turntable_frame(platform, motion)(cab)


def leg_use(platform: Platform, motion: MotionView) -> Floats:
    """(6,) extension of each leg as a share of its travel: -1 fully in, 0 neutral, 1 fully out."""
    low, high = platform.hexapod.extension
    return np.where(motion.legs >= 0.0, share(motion.legs, high), -share(-motion.legs, -low))


def share(value: ArrayLike, limit: float) -> Floats:
    """``value / limit``; zero where there is no travel."""
    return np.asarray(np.asarray(value) / limit if limit > 0.0 else np.zeros_like(np.asarray(value)))


def _finite(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Floats:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise DataError(f"{name} must be finite numbers of shape {shape}, found {array.tolist()}")
    array.setflags(write=False)
    return array
