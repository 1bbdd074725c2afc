"""A pinhole camera in F_I (z down)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NEAR: Final = 2.0
"""Distance of the near plane, m: nothing closer is drawn."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera that looks from ``position`` at ``target`` with the sky up.

    Args:
        position: (3,) m, in F_I.
        target: (3,) m, in F_I; appears at ``centre``.
        focal: Focal length, pixels.
        centre: Pixel (x, y) of the target; x to the right, y down.
    """

    position: Floats
    target: Floats
    focal: float
    centre: tuple[float, float]

    @cached_property
    def axes(self) -> Floats:
        """(3, 3) rows: right, down and forward of the picture, in F_I."""
        forward = self.target - self.position
        forward = forward / np.linalg.norm(forward)
        right = np.cross([0.0, 0.0, 1.0], forward)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward])

    def view(self, points: Floats) -> Floats:
        """Points (..., 3) of F_I as right, down and depth from the camera, m."""
        return np.asarray((points - self.position) @ self.axes.T)

    def pixels(self, view: Floats) -> Floats:
        """Pixels (..., 2) of points (..., 3) in front of the camera, given by :meth:`view`."""
        return np.asarray(view[..., :2] * (self.focal / view[..., 2:]) + self.centre)

    def project(self, points: Floats) -> Floats:
        """Pixels (..., 2) of points (..., 3) of F_I in front of the camera."""
        return self.pixels(self.view(points))


def orbit(
    target: Floats,
    distance: float,
    azimuth: float,
    elevation: float,
    focal: float,
    centre: tuple[float, float],
) -> Camera:
    """A camera on a sphere around its target.

    Args:
        target: (3,) m.
        distance: m.
        azimuth: Where the camera stands, from x towards y, rad.
        elevation: Above the horizontal, rad.
        focal: Focal length, pixels.
        centre: Pixel of the target.
    """
    level = np.cos(elevation)
    offset = np.array([level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(elevation)])
    return Camera(target + distance * offset, target, focal, centre)


def clip_near(polygon: Floats) -> Floats:
    """The part (m, 3) of a polygon (n, 3), in view coordinates, beyond the near plane; m may be 0."""
    kept: list[Floats] = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        inside, next_inside = a[2] >= NEAR, b[2] >= NEAR
        if inside:
            kept.append(a)
        if inside != next_inside:
            kept.append(a + (NEAR - a[2]) / (b[2] - a[2]) * (b - a))
    return np.array(kept).reshape(-1, 3)


def clip_segments(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Segments (n, 3) cut at the near plane, in view coordinates; those wholly before it are dropped."""
    seen = (start[:, 2] >= NEAR) | (end[:, 2] >= NEAR)
    start, end = start[seen], end[seen]
    return _moved(start, end), _moved(end, start)


def _moved(point: Floats, other: Floats) -> Floats:
    """Points before the near plane moved onto it, towards the other end."""
    gap = other[:, 2] - point[:, 2]
    step = np.where(point[:, 2] < NEAR, (NEAR - point[:, 2]) / np.where(gap == 0.0, 1.0, gap), 0.0)
    return np.asarray(point + step[:, None] * (other - point))
