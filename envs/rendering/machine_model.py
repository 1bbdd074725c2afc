"""The motion base to draw: its pose and frames, and the meshes of its parts; sizes follow the hexapod's."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from ..errors import DataError
from ..platform.kinematics import rotation
from ..platform.machines import Carriage, Hexapod, Platform
from . import theme
from .drawing import Floats, Mesh, along, box, circle, joined, mesh, prism, ring_walls, sphere
from .surroundings import LENGTH, dashboard, driver_figure, seat, seat_back, shell, steering_wheel, wheels


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


_REFERENCE_RADIUS: Final = 1.6
"""Radius of the upper joints for which the thicknesses below are drawn, m; others scale with it."""
_SLAB: Final = (-0.13, -0.02)
"""z of the platform's upper and lower face, in F_H, m."""
_DECK: Final = -0.26
"""z of the turntable's upper face, in F_H, m."""
_BASE: Final = (0.12, 0.34)
"""z of the carriage's upper and lower face, in F_V, m."""
_BRIDGE_HEIGHT: Final = 0.30
_RAIL_HEIGHT: Final = 0.28
_BRIDGE_HALF_GAUGE: Final = 1.15
_PIECE: Final = 2.0
"""Long beams are drawn in pieces of this length, so that they fade gradually, m."""
_HEAD_ABOVE_GROUND: Final = 1.19
"""Of the driver in the car's body, m."""
_HEAD_IN_BODY: Final = np.array([-0.10, -0.35, -_HEAD_ABOVE_GROUND])
_ABOVE: Final = 0.002
"""Height of the marks over the deck, m."""
_OVERHANG: Final = 1.15
"""Of turntable and platform beyond the upper joints."""


@dataclass(frozen=True, eq=False)
class MachineParts:
    """Meshes of a machine; None where it lacks the part.

    Args:
        floor: z of the floor in F_I, m.
        scale: Of the thicknesses, 1 for the paper's machine.
        rails: In F_I.
        bridge: In F_I at x = 0; moves with the carriage along x.
        carriage: In F_V.
        platform: In F_H.
        turntable: In the turntable's frame.
        marks: The scale on the deck with its heading mark, in the turntable's frame.
        cab: What carries the driver, in the turntable's frame.
    """

    floor: float
    scale: float
    rails: Mesh | None
    bridge: Mesh | None
    carriage: Mesh
    platform: Mesh
    turntable: Mesh | None
    marks: Mesh | None
    cab: CabParts


@dataclass(frozen=True, eq=False)
class CabParts:
    """The cab in the turntable's frame.

    Args:
        inside: Inner walls of the body, or foot and plate of an open cockpit: behind all else.
        furniture: From the front to the back: dashboard, steering wheel, driver on the seat, the seat's back.
        driver: (3,) the driver's head, m.
        shell: The body with its windows; None for an open cockpit.
        wheels: Of the left and of the right side, tires before rims; none for an open cockpit.
    """

    inside: tuple[Mesh, ...]
    furniture: tuple[Mesh, ...]
    driver: Floats
    shell: Mesh | None
    wheels: tuple[tuple[Mesh, ...], ...]


def machine_parts(platform: Platform) -> MachineParts:
    """The parts of a machine."""
    hexapod, carriage = platform.hexapod, platform.carriage
    radius = float(np.mean(np.linalg.norm(hexapod.upper_joints, axis=1)))
    scale = radius / _REFERENCE_RADIUS
    moves = carriage is not None
    floor = scale * (_BASE[1] + (_BRIDGE_HEIGHT + _RAIL_HEIGHT if moves else 0.0))
    turntable = platform.turntable is not None
    deck = scale * (_DECK if turntable else _SLAB[0])
    disc = prism(circle(_OVERHANG * radius, 56), deck, scale * _SLAB[0], theme.TURNTABLE, gloss=0.15)
    return MachineParts(
        floor=floor,
        scale=scale,
        rails=_rails(carriage, floor, scale) if carriage else None,
        bridge=_bridge(carriage, floor, scale) if carriage else None,
        carriage=_base(hexapod, scale),
        platform=_slab(hexapod, scale),
        turntable=disc if turntable else None,
        marks=_scale_marks(_OVERHANG * radius, deck) if turntable else None,
        cab=_cab(platform, deck, _OVERHANG * radius),
    )


def hull(points: Floats, margin: float) -> Floats:
    """(n, 2) Joints in plan, ordered from x towards y and moved outwards by a margin, m."""
    plan = points[:, :2]
    plan = plan[np.argsort(np.arctan2(plan[:, 1], plan[:, 0]))]
    length = np.linalg.norm(plan, axis=1, keepdims=True)
    return np.asarray(plan * (1.0 + margin / length))


def _slab(hexapod: Hexapod, scale: float) -> Mesh:
    outline = hull(np.array(hexapod.upper_joints), 0.20 * scale)
    return prism(outline, scale * _SLAB[0], scale * _SLAB[1], theme.PLATFORM, gloss=0.15)


def _base(hexapod: Hexapod, scale: float) -> Mesh:
    """The plate that carries the lower joints, and their pedestals."""
    lower = np.array(hexapod.lower_joints)
    top, bottom = scale * _BASE[0], scale * _BASE[1]
    plate = prism(hull(lower, 0.28 * scale), top, bottom, theme.CARRIAGE, gloss=0.1)
    feet = [
        prism(circle(0.13 * scale, 10) + joint[:2], joint[2] + 0.03 * scale, top, theme.DARK_STEEL)
        for joint in lower
    ]
    balls = [sphere(0.09 * scale, theme.STEEL, sides=6, gloss=0.4).moved(joint) for joint in lower]
    return joined(plate, *feet, *balls)


def rail_gauge(carriage: Carriage, scale: float) -> tuple[float, float]:
    """Y of the two rails, beyond the carriage at either end of its travel, m."""
    beyond = 2.3 * scale
    return carriage.travel_y[0] - beyond, carriage.travel_y[1] + beyond


def _rails(carriage: Carriage, floor: float, scale: float) -> Mesh:
    """Two rails along x, on the floor."""
    ends = (carriage.travel_x[0] - 2.3 * scale, carriage.travel_x[1] + 2.3 * scale)
    top, half = floor - scale * _RAIL_HEIGHT, 0.16 * scale
    cuts = _cuts(*ends)
    pieces = [
        box((a, y - half, top), (b, y + half, floor), theme.RAIL, gloss=0.15)
        for y in rail_gauge(carriage, scale)
        for a, b in pairwise(cuts)
    ]
    return joined(*pieces)


def _bridge(carriage: Carriage, floor: float, scale: float) -> Mesh:
    """Two beams along y from rail to rail, with a truck at each end."""
    low, high = rail_gauge(carriage, scale)
    bottom = floor - scale * _RAIL_HEIGHT
    top, half, gauge = bottom - scale * _BRIDGE_HEIGHT, 0.15 * scale, _BRIDGE_HALF_GAUGE * scale
    cuts = _cuts(low, high)
    beams = [
        box((x - half, a, top), (x + half, b, bottom), theme.STEEL, gloss=0.15)
        for x in (-gauge, gauge)
        for a, b in pairwise(cuts)
    ]
    trucks = [
        box((-1.5 * gauge, y - 2.0 * half, top), (1.5 * gauge, y + 2.0 * half, bottom), theme.DARK_STEEL)
        for y in (low, high)
    ]
    return joined(*beams, *trucks)


def _cuts(low: float, high: float) -> Floats:
    return np.linspace(low, high, max(2, round((high - low) / _PIECE) + 1))


def _scale_marks(radius: float, deck: float) -> Mesh:
    """Ticks along the deck's edge, every 15 degrees, and an arrow head at the front."""
    tick = radius * np.array([[0.90, 0.012], [0.98, 0.012], [0.98, -0.012], [0.90, -0.012]])
    pointer = radius * np.array([[0.985, 0.0], [0.85, -0.085], [0.85, -0.085], [0.85, 0.085]])
    turns = [rotation(np.array([0.0, 0.0, a]))[:2, :2] for a in np.radians(np.arange(15.0, 360.0, 15.0))]
    corners = np.concatenate([pointer, *(tick @ turn.T for turn in turns)])
    height = np.full(len(corners), deck - _ABOVE)
    faces = np.arange(len(corners)).reshape(-1, 4)
    marks = mesh(np.column_stack([corners, height]), faces, theme.STEEL)
    marks.colors[0] = theme.SIMULATOR
    return marks


def _cab(platform: Platform, deck: float, radius: float) -> CabParts:
    driver = np.array(platform.cab.reference_point) + np.array(platform.cab.head)
    if 2.0 * radius < LENGTH:
        return _cockpit(driver, deck)
    offset = driver - _HEAD_IN_BODY
    body = np.array([offset[0], offset[1], min(offset[2], deck)])
    outer = shell().moved(body)
    return CabParts(
        inside=(outer.chosen(outer.opacity == 1.0).flipped(theme.INTERIOR),),
        furniture=(
            dashboard(_HEAD_IN_BODY).moved(offset),
            steering_wheel(driver),
            joined(seat(driver, driver[2] + 0.78), driver_figure(driver)),
            seat_back(driver),
        ),
        driver=driver,
        shell=outer,
        wheels=tuple(tuple(part.moved(body) for part in wheels(side)) for side in (-1.0, 1.0)),
    )


def _cockpit(driver: Floats, deck: float) -> CabParts:
    """Seat and wheel on a plate, for machines too small to carry a car's body."""
    x, y, z = driver
    plate = z + 0.92
    floor = box((x - 0.40, y - 0.42, plate), (x + 1.05, y + 0.42, plate + 0.06), theme.BODY, gloss=0.3)
    column = box((x + 0.66, y - 0.06, z + 0.40), (x + 0.74, y + 0.06, plate), theme.DARK_STEEL)
    foot = box((-0.18, -0.18, plate + 0.06), (0.18, 0.18, max(deck, plate + 0.07)), theme.DARK_STEEL)
    occupant = joined(seat(driver, plate), driver_figure(driver))
    return CabParts(
        inside=(foot, floor),
        furniture=(column, steering_wheel(driver), occupant, seat_back(driver)),
        driver=driver,
        shell=None,
        wheels=((), ()),
    )


_BARREL_SHARE: Final = 0.92
"""Of the barrel's length in that of the shortest leg."""
_BARREL_RADIUS: Final = 0.095
_ROD_RADIUS: Final = 0.055
_BALL_RADIUS: Final = 0.085
_SIDES: Final = 12
_RINGS: Final = 4
"""Rings along a tube, so that its faces sort well against those of other legs."""


@dataclass(frozen=True, eq=False)
class Legs:
    """Draws legs of a hexapod.

    Args:
        barrel: Length of the barrels, m.
        scale: Of the thicknesses.
    """

    barrel: float
    scale: float

    @classmethod
    def of(cls, hexapod: Hexapod, scale: float) -> Legs:
        """Barrels as long as the shortest leg lets them be."""
        shortest = float(np.min(hexapod.neutral_lengths)) + hexapod.extension[0]
        return cls(_BARREL_SHARE * shortest, scale)

    def mesh(self, lower: Floats, upper: Floats, use: Floats) -> Mesh:
        """Barrels, rods and upper joints in F_I.

        Args:
            lower: (6, 3) lower joints, m.
            upper: (6, 3) upper joints, m.
            use: (6,) share of the stroke in use, -1 to 1.
        """
        split = lower + (upper - lower) * (self.barrel / np.linalg.norm(upper - lower, axis=1))[:, None]
        colors = np.array([theme.color_of_use(float(u)) for u in use], dtype=np.float64)
        rods = np.tile(np.array(theme.ROD, dtype=np.float64), (len(use), 1))
        ball = sphere(self.scale * _BALL_RADIUS, theme.STEEL, sides=6, gloss=0.4)
        return joined(
            tubes(lower, split, self.scale * _BARREL_RADIUS, colors, 0.25),
            tubes(split, upper, self.scale * _ROD_RADIUS, rods, 0.6),
            *(ball.moved(joint) for joint in upper),
        )


def tubes(start: Floats, end: Floats, radius: float, colors: Floats, gloss: float) -> Mesh:
    """Open tubes from points (n, 3) to others, in colors (n, 3)."""
    n, length = len(start), np.linalg.norm(end - start, axis=1)
    local = np.tile(_UNIT_TUBE * (radius, radius, 1.0), (n, 1, 1))
    local[..., 2] *= length[:, None]
    vertices = np.einsum("nij,nvj->nvi", along(end - start), local) + start[:, None]
    faces = np.concatenate([_WALLS + k * len(_UNIT_TUBE) for k in range(n)])
    each = len(_WALLS)
    return Mesh(
        vertices.reshape(-1, 3),
        faces,
        np.repeat(colors, each, axis=0),
        np.full(n * each, gloss),
        np.ones(n * each),
    )


def _unit_tube() -> Floats:
    outline = circle(1.0, _SIDES)
    heights = np.linspace(0.0, 1.0, _RINGS)
    return np.concatenate([np.column_stack([outline, np.full(_SIDES, h)]) for h in heights])


_UNIT_TUBE: Final = _unit_tube()
_WALLS: Final = ring_walls(_SIDES, _RINGS)
