"""The floor of the hall: a grid, the border of the carriage's travel, and the machine's shadow."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from . import theme
from .camera import Camera

Floats = NDArray[np.float64]

_GRID_SPACING: Final = 2.0
_SEGMENT: Final = 3
"""Squares a piece of a line passes; each piece has one colour."""
_GRID_REACH: Final = 26.0
"""Beyond it everything has faded, m."""
_DASH: Final = 0.8
"""Length of a dash and its gap, m."""
_DRAWN: Final = 0.62
"""Share of it that is drawn."""
_SHADOW_RADIUS: Final = 2.1
"""Of the dark of the shadow, for the paper's machine, m."""
_SHADOW_DARKNESS: Final = 0.75


def grid_lines(floor: float) -> tuple[Floats, Floats]:
    """Starts and ends (n, 3) of a square grid's segments at z = ``floor``, m."""
    ticks = np.arange(-_GRID_REACH, _GRID_REACH + 1e-9, _GRID_SPACING)
    across, begin = (a.ravel() for a in np.meshgrid(ticks, ticks[:-1:_SEGMENT], indexing="ij"))
    height = np.full_like(begin, floor)
    end = np.minimum(begin + _SEGMENT * _GRID_SPACING, _GRID_REACH)
    start = [np.column_stack([begin, across, height]), np.column_stack([across, begin, height])]
    stop = [np.column_stack([end, across, height]), np.column_stack([across, end, height])]
    return np.concatenate(start), np.concatenate(stop)


def travel_lines(x: tuple[float, float], y: tuple[float, float], floor: float) -> tuple[Floats, Floats]:
    """Starts and ends (n, 3) of dashes along the border of the carriage's travel, m."""
    corners = np.array([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]), (x[0], y[0])])
    starts: list[Floats] = []
    ends: list[Floats] = []
    for a, b in pairwise(corners):
        n = max(1, round(float(np.linalg.norm(b - a)) / _DASH))
        at = np.arange(n)[:, None] / n
        starts.append(a + at * (b - a))
        ends.append(a + (at + _DRAWN / n) * (b - a))
    start, end = np.concatenate(starts), np.concatenate(ends)
    height = np.full((len(start), 1), floor)
    return np.hstack([start, height]), np.hstack([end, height])


@dataclass(frozen=True, eq=False)
class Shadow:
    """A soft shadow to lay over the floor.

    Args:
        picture: With opacity, cut to where there is any.
        corner: (2,) its upper left pixel.
        size: Of the whole picture it belongs to, pixels.
    """

    picture: Any
    corner: Floats
    size: tuple[int, int]


def shadow(pygame: ModuleType, camera: Camera, size: tuple[int, int], scale: float, floor: float) -> Shadow:
    """A soft round shadow on the floor below the camera's target.

    Args:
        pygame: The module.
        camera: Whose pixels those of the picture are.
        size: Of the picture, pixels.
        scale: 1 for the paper's machine.
        floor: z of the floor, m.
    """
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5, indexing="ij")
    sight = np.stack([x - camera.centre[0], y - camera.centre[1], np.full_like(x, camera.focal)], axis=-1)
    rays = sight @ camera.axes
    way = (floor - camera.position[2]) / np.maximum(rays[..., 2:], 1e-6)
    hit = camera.position + rays * way
    distance = np.linalg.norm(hit[..., :2] - camera.target[:2], axis=-1) / (_SHADOW_RADIUS * scale)
    darkness = np.where(rays[..., 2] > 0.0, _SHADOW_DARKNESS * np.exp(-0.6 * distance**4), 0.0)
    picture = pygame.Surface(size, pygame.SRCALPHA, 32)
    picture.fill((*theme.BACKDROP, 0))
    pygame.surfarray.pixels_alpha(picture)[...] = np.round(255.0 * darkness).astype(np.uint8)
    used = picture.get_bounding_rect()
    return Shadow(picture.subsurface(used).copy(), np.array(used.topleft, float), size)
