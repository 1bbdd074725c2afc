"""What stands around and on the machine: the cab, its driver, and the floor of the hall.

The cab is a small car's body, lofted over cross-sections. It stands on the plane z = 0 of its own frame, x
forward, the middle of its length near the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from . import theme
from .drawing import Camera, Floats, Mesh, box, cap, circle, cylinder, joined, mesh, ring_walls, sphere


@dataclass(frozen=True)
class Section:
    """A cross-section of the body at ``x``; heights above the ground, m.

    Args:
        x: Station, m.
        half_width: At its widest.
        bottom: Of the sill.
        belt: Below the windows.
        top: Roof, bonnet or glass.
        top_half_width: Of the roof.
    """

    x: float
    half_width: float
    bottom: float
    belt: float
    top: float
    top_half_width: float


_SECTIONS: Final = (
    Section(-1.68, 0.60, 0.36, 0.70, 0.74, 0.52),
    Section(-1.62, 0.72, 0.26, 0.82, 0.88, 0.62),
    Section(-1.50, 0.78, 0.21, 0.89, 0.98, 0.66),
    Section(-1.16, 0.82, 0.18, 0.94, 1.42, 0.58),
    Section(-1.06, 0.83, 0.18, 0.94, 1.45, 0.59),
    Section(-0.78, 0.84, 0.18, 0.94, 1.49, 0.60),
    Section(-0.69, 0.84, 0.18, 0.94, 1.50, 0.61),
    Section(-0.20, 0.84, 0.18, 0.94, 1.51, 0.61),
    Section(0.26, 0.84, 0.18, 0.93, 1.47, 0.60),
    Section(0.33, 0.84, 0.18, 0.93, 1.44, 0.60),
    Section(0.92, 0.83, 0.18, 0.92, 1.00, 0.70),
    Section(1.02, 0.82, 0.18, 0.91, 0.96, 0.70),
    Section(1.40, 0.79, 0.20, 0.81, 0.86, 0.66),
    Section(1.60, 0.71, 0.26, 0.68, 0.73, 0.58),
    Section(1.72, 0.54, 0.36, 0.54, 0.58, 0.44),
)
"""From rear to front."""

_REAR_WINDOW: Final = (2,)
_WINDSCREEN: Final = (9,)
_SIDE_WINDOWS: Final = (4, 6, 7, 9)
"""Intervals between sections that hold glass; the others at that height are pillars."""

_ROOF_FACES: Final = (0, 12)
_WINDOW_FACES: Final = (2, 10)
_UPPER_SIDES: Final = (3, 9)

_GLASS_OPACITY: Final = 0.42
_WHEEL_RADIUS: Final = 0.29
_RIM_RADII: Final = (0.165, 0.190)
_RIM_SIDES: Final = 18
_AXLES: Final = (-1.02, 1.06)
LENGTH: Final = _SECTIONS[-1].x - _SECTIONS[0].x
"""Length of the body, m."""


def shell() -> Mesh:
    """The body with its windows, in glass of partial opacity."""
    rings = [_ring(section) for section in _SECTIONS]
    n, last = len(rings[0]), len(rings[0]) * (len(rings) - 1)
    faces = np.concatenate([ring_walls(n, len(rings)), cap(n, 0, True), cap(n, last, False)])
    body = mesh(np.concatenate(rings), faces, theme.BODY, gloss=0.35)
    body.vertices[:, 2] *= -1.0
    interval, segment = np.divmod(np.arange(n * (len(rings) - 1)), n)
    glass = np.isin(interval, (*_REAR_WINDOW, *_WINDSCREEN)) & np.isin(segment, _ROOF_FACES)
    glass |= np.isin(interval, _SIDE_WINDOWS) & np.isin(segment, _WINDOW_FACES)
    _paint(body, glass, theme.GLASS, gloss=0.9, opacity=_GLASS_OPACITY)
    _paint(body, np.isin(interval, (0, 1)) & np.isin(segment, _UPPER_SIDES), theme.TAIL_LIGHT, gloss=0.2)
    _paint(body, np.isin(interval, (12, 13)) & np.isin(segment, _UPPER_SIDES), theme.HEADLIGHT, gloss=0.8)
    return body


def _ring(section: Section) -> NDArray[np.float64]:
    """Cross-section (13, 3), height positive, from the middle of the roof over the right side and back."""
    s, rise = section, min(0.06, 0.3 * (section.top - section.belt))
    shoulder = 0.55 * s.belt + 0.45 * s.bottom
    half = [
        (0.0, s.top + 0.25 * rise),
        (0.80 * s.top_half_width, s.top),
        (s.top_half_width, s.top - rise),
        (0.985 * s.half_width, s.belt),
        (s.half_width, shoulder),
        (0.97 * s.half_width, s.bottom + 0.06),
        (0.85 * s.half_width, s.bottom),
    ]
    right = np.array([(s.x, y, height) for y, height in half])
    return np.concatenate([right, (right * [1.0, -1.0, 1.0])[:0:-1]])


def _paint(
    body: Mesh, chosen: NDArray[np.bool_], color: theme.Color, gloss: float, opacity: float = 1.0
) -> None:
    faces = np.flatnonzero(chosen)
    body.colors[faces], body.gloss[faces], body.opacity[faces] = color, gloss, opacity


def wheels(side: float) -> tuple[Mesh, Mesh]:
    """Tires and rims of the left (-1) or the right (1) side."""
    tires: list[Mesh] = []
    rims: list[Mesh] = []
    for x in _AXLES:
        inner, outer, cover = (np.array([x, side * y, -_WHEEL_RADIUS]) for y in (0.74, 0.86, 0.864))
        tires.append(cylinder(inner, outer, _WHEEL_RADIUS, theme.TYRE, sides=24))
        rims.append(cylinder(outer, cover, 0.62 * _WHEEL_RADIUS, theme.RIM, gloss=0.3, sides=20))
    return joined(*tires), joined(*rims)


def dashboard(driver: NDArray[np.float64]) -> Mesh:
    """The dashboard before a driver whose head is at ``driver`` (3,), from door to door."""
    x, _, z = driver
    return box((x + 0.72, -0.74, z + 0.36), (x + 0.98, 0.74, z + 0.62), theme.INTERIOR)


def seat(driver: NDArray[np.float64], ground: float) -> Mesh:
    """The seat's cushion under a driver whose head is at ``driver`` (3,), down to z = ``ground``."""
    x, y, z = driver
    return box((x - 0.22, y - 0.24, z + 0.64), (x + 0.32, y + 0.24, ground), theme.DARK_STEEL)


def seat_back(driver: NDArray[np.float64]) -> Mesh:
    """The seat's back behind a driver whose head is at ``driver`` (3,)."""
    x, y, z = driver
    return box((x - 0.34, y - 0.23, z + 0.02), (x - 0.24, y + 0.23, z + 0.72), theme.DARK_STEEL)


def steering_wheel(driver: NDArray[np.float64]) -> Mesh:
    """The rim of the steering wheel before a driver whose head is at ``driver`` (3,); it has two faces."""
    tilt = np.radians(65.0)
    upright = np.array([-np.cos(tilt), 0.0, -np.sin(tilt)])
    plane = np.stack([upright, np.array([0.0, 1.0, 0.0])])
    outlines = [circle(radius, _RIM_SIDES) @ plane for radius in _RIM_RADII]
    walls = ring_walls(_RIM_SIDES, 2)
    rim = mesh(np.concatenate(outlines), np.concatenate([walls, walls[:, ::-1]]), theme.ROD)
    return rim.moved(driver + np.array([0.55, 0.0, 0.38]))


HEAD_RADIUS: Final = 0.115
"""m."""


def driver_figure(head: NDArray[np.float64]) -> Mesh:
    """A sitting driver in the cab's frame, with the middle of the head at (3,), m."""
    neck, hips = head + np.array([-0.02, 0.0, 0.12]), head + np.array([-0.10, 0.0, 0.62])
    return joined(
        cylinder(hips, neck + np.array([-0.03, 0.0, 0.06]), 0.17, theme.SHIRT, sides=12),
        *(_leg(hips, side) for side in (-1.0, 1.0)),
        *(_arm(head, side) for side in (-1.0, 1.0)),
        cylinder(
            neck + np.array([0.0, 0.0, 0.04]), neck - np.array([0.0, 0.0, 0.06]), 0.055, theme.SKIN, sides=8
        ),
        sphere(HEAD_RADIUS, theme.SKIN, sides=14, gloss=0.1).moved(head),
    )


def _leg(hips: NDArray[np.float64], side: float) -> Mesh:
    knee = hips + np.array([0.48, side * 0.13, -0.10])
    foot = hips + np.array([0.88, side * 0.12, 0.16])
    return joined(
        cylinder(hips + np.array([0.0, side * 0.09, 0.0]), knee, 0.08, theme.DARK_STEEL, sides=8),
        cylinder(knee, foot, 0.06, theme.DARK_STEEL, sides=8),
    )


def _arm(head: NDArray[np.float64], side: float) -> Mesh:
    shoulder, elbow = head + np.array([-0.05, side * 0.19, 0.24]), head + np.array([0.18, side * 0.26, 0.46])
    hand = head + np.array([0.50, side * 0.15, 0.34])
    return joined(
        cylinder(shoulder, elbow, 0.05, theme.SHIRT, sides=8),
        cylinder(elbow, hand, 0.042, theme.SHIRT, sides=8),
        sphere(0.05, theme.SKIN, sides=8).moved(hand),
    )


_GRID_SPACING: Final = 2.0
_SEGMENT: Final = 3
"""Squares a piece of a line passes; each piece has one color."""
_GRID_REACH: Final = 26.0
"""Beyond it everything has faded, m."""
_DASH: Final = 0.8
"""Length of a dash and its gap, m."""
_DRAWN: Final = 0.62
"""Share of it that is drawn."""
_SHADOW_RADIUS: Final = 2.1
"""Of the dark of the shadow, for the paper's machine, m."""
_SHADOW_DARKNESS: Final = 0.75
_SHADOW_REACH: Final = 1.8
"""Where 8 bits can no longer show it, as a share of the radius."""


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
    """A soft round shadow on the floor (z, m) below the camera's target; scale 1: the paper's machine."""
    rim = np.full((64, 3), floor)
    rim[:, :2] = camera.target[:2] + circle(_SHADOW_REACH * _SHADOW_RADIUS * scale, len(rim))
    edge = camera.project(rim)
    low, high = (np.clip(ends, 0, size).astype(int) for ends in (edge.min(axis=0), edge.max(axis=0) + 1.0))
    x, y = np.meshgrid(*(np.arange(a, b) + 0.5 for a, b in zip(low, high, strict=True)), indexing="ij")
    sight = np.stack([x - camera.center[0], y - camera.center[1], np.full_like(x, camera.focal)], axis=-1)
    rays = sight @ camera.axes
    way = (floor - camera.position[2]) / np.maximum(rays[..., 2:], 1e-6)
    hit = camera.position + rays * way
    distance = np.linalg.norm(hit[..., :2] - camera.target[:2], axis=-1) / (_SHADOW_RADIUS * scale)
    darkness = np.where(rays[..., 2] > 0.0, _SHADOW_DARKNESS * np.exp(-0.6 * distance**4), 0.0)
    picture = pygame.Surface(x.shape, pygame.SRCALPHA, 32)
    picture.fill((*theme.BACKDROP, 0))
    pygame.surfarray.pixels_alpha(picture)[...] = np.round(255.0 * darkness).astype(np.uint8)
    used = picture.get_bounding_rect()
    return Shadow(picture.subsurface(used).copy(), low + np.array(used.topleft, float), size)
