"""The six legs: a barrel below, coloured by the use of the stroke, and a rod to the upper joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..platform.machines import Hexapod
from . import theme
from .mesh import Mesh, along, circle, joined, ring_walls, sphere

Floats = NDArray[np.float64]

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
        colours = np.array([theme.colour_of_use(float(u)) for u in use], dtype=np.float64)
        rods = np.tile(np.array(theme.ROD, dtype=np.float64), (len(use), 1))
        ball = sphere(self.scale * _BALL_RADIUS, theme.STEEL, sides=6, gloss=0.4)
        return joined(
            tubes(lower, split, self.scale * _BARREL_RADIUS, colours, 0.25),
            tubes(split, upper, self.scale * _ROD_RADIUS, rods, 0.6),
            *(ball.moved(joint) for joint in upper),
        )


def tubes(start: Floats, end: Floats, radius: float, colours: Floats, gloss: float) -> Mesh:
    """Open tubes from points (n, 3) to others, in colours (n, 3)."""
    n, length = len(start), np.linalg.norm(end - start, axis=1)
    local = np.tile(_UNIT_TUBE * (radius, radius, 1.0), (n, 1, 1))
    local[..., 2] *= length[:, None]
    vertices = np.einsum("nij,nvj->nvi", along(end - start), local) + start[:, None]
    faces = np.concatenate([_WALLS + k * len(_UNIT_TUBE) for k in range(n)])
    each = len(_WALLS)
    return Mesh(
        vertices.reshape(-1, 3),
        faces,
        np.repeat(colours, each, axis=0),
        np.full(n * each, gloss),
        np.ones(n * each),
    )


def _unit_tube() -> Floats:
    outline = circle(1.0, _SIDES)
    heights = np.linspace(0.0, 1.0, _RINGS)
    return np.concatenate([np.column_stack([outline, np.full(_SIDES, h)]) for h in heights])


_UNIT_TUBE: Final = _unit_tube()
_WALLS: Final = ring_walls(_SIDES, _RINGS)
