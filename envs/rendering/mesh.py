"""Meshes of quadrilaterals, and the solids a machine is made of. z points down, so "top" is the least z."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .theme import Colour

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Flat faces of four corners; a triangle repeats its last one.

    Corners run counter-clockwise seen from outside: (c - a) x (d - b) points outwards.

    Args:
        vertices: (v, 3) m.
        faces: (f, 4) indices of vertices.
        colours: (f, 3) 0 to 255.
        gloss: (f,) strength of the highlight, 0 to 1.
        opacity: (f,) 1 for all but glass.
    """

    vertices: Floats
    faces: Ints
    colours: Floats
    gloss: Floats
    opacity: Floats

    def moved(self, offset: ArrayLike) -> Mesh:
        """The mesh elsewhere, m."""
        return replace(self, vertices=self.vertices + np.asarray(offset))

    def flipped(self, colour: Colour) -> Mesh:
        """The same surface seen from inside, in a dull colour of its own."""
        return mesh(self.vertices, self.faces[:, ::-1], colour)

    def chosen(self, faces: NDArray[Any]) -> Mesh:
        """Some of the faces, by index or mask."""
        return Mesh(
            self.vertices, self.faces[faces], self.colours[faces], self.gloss[faces], self.opacity[faces]
        )


def mesh(vertices: Floats, faces: Ints, colour: Colour, gloss: float = 0.0) -> Mesh:
    """A mesh of one colour."""
    n = len(faces)
    return Mesh(vertices, faces, np.tile(np.array(colour, float), (n, 1)), np.full(n, gloss), np.ones(n))


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes[:-1])])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=True)]),
        np.concatenate([m.colours for m in meshes]),
        np.concatenate([m.gloss for m in meshes]),
        np.concatenate([m.opacity for m in meshes]),
    )


def ring_walls(n: int, rings: int) -> Ints:
    """Faces between consecutive rings of ``n`` vertices each; rings turn from x to y as they descend."""
    i, k = np.meshgrid(np.arange(n), np.arange(rings - 1))
    a, b = k * n + i, k * n + (i + 1) % n
    return np.stack([a, b, b + n, a + n], axis=-1).reshape(-1, 4)


def cap(n: int, first: int, top: bool) -> Ints:
    """A convex polygon of ``n`` vertices from ``first`` on, as strips of quadrilaterals."""
    low, high = np.arange((n - 1) // 2), n - 1 - np.arange((n - 1) // 2)
    strip = np.stack([low, low + 1, np.maximum(high - 1, low + 1), high], axis=1) + first
    return strip[:, ::-1] if top else strip


def prism(outline: Floats, top: float, bottom: float, colour: Colour, gloss: float = 0.0) -> Mesh:
    """A vertical prism.

    Args:
        outline: (n, 2) convex, turning from x to y.
        top: z of its upper face, m.
        bottom: z of its lower face, m.
        colour: Of all faces.
        gloss: Of all faces.
    """
    n = len(outline)
    rings = [np.column_stack([outline, np.full(n, z)]) for z in (top, bottom)]
    faces = np.concatenate([ring_walls(n, 2), cap(n, 0, True), cap(n, n, False)])
    return mesh(np.concatenate(rings), faces, colour, gloss)


def circle(radius: float, sides: int) -> Floats:
    """(sides, 2) A regular polygon, turning from x to y."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def box(low: ArrayLike, high: ArrayLike, colour: Colour, gloss: float = 0.0) -> Mesh:
    """A box between two corners, m."""
    (x0, y0, z0), (x1, y1, z1) = np.asarray(low, float), np.asarray(high, float)
    return prism(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), z0, z1, colour, gloss)


def sphere(radius: float, colour: Colour, sides: int = 12, gloss: float = 0.0) -> Mesh:
    """A sphere around the origin."""
    polar = np.linspace(0.06, np.pi - 0.06, sides // 2 + 1)
    rings = [
        np.column_stack([circle(radius * np.sin(a), sides), np.full(sides, -radius * np.cos(a))])
        for a in polar
    ]
    last = sides * (len(rings) - 1)
    faces = np.concatenate([ring_walls(sides, len(rings)), cap(sides, 0, True), cap(sides, last, False)])
    return mesh(np.concatenate(rings), faces, colour, gloss)


def cylinder(
    start: ArrayLike, end: ArrayLike, radius: float, colour: Colour, gloss: float = 0.0, sides: int = 14
) -> Mesh:
    """A cylinder from one point to another, m."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    solid = prism(circle(radius, sides), 0.0, float(np.linalg.norm(end - start)), colour, gloss)
    return replace(solid, vertices=solid.vertices @ along(end - start).T + start)


def along(direction: Floats) -> Floats:
    """Rotations (..., 3, 3) that take z to directions (..., 3)."""
    z = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    # The second factor starts from the axis least along z, so that the product with it is never near zero.
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=-1)], z)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)
