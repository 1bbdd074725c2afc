"""Draws meshes: shaded by Lambert's law with a highlight, far faces first, what looks away left out."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .camera import NEAR, Camera, Floats, clip_near, clip_segments
from .mesh import Mesh, joined
from .theme import AMBIENT, BACKDROP, DIFFUSE, LIGHT, SHININESS, SKYLIGHT, Colour

_OPAQUE: Final = 0.999
"""Faces above it hide what is behind them."""
_INVISIBLE: Final = 0.82
"""Share of fog from which on a line is left out."""


class Painter:
    """Draws on a surface as seen by a camera.

    Args:
        pygame: The module.
        surface: What is drawn on.
        camera: Its pixels are those of the surface.
        fog: Distances at which things begin to fade, and are gone, m.
    """

    def __init__(self, pygame: ModuleType, surface: Any, camera: Camera, fog: tuple[float, float]) -> None:
        self._draw: Any = pygame.draw
        self._blend: Any = import_module("pygame.gfxdraw")
        self.surface, self.camera, self.fog = surface, camera, fog

    def meshes(self, *meshes: Mesh) -> None:
        """Draw the faces that look at the camera: one mesh over the other, in each the far faces first."""
        mesh = joined(*meshes)
        layer = np.repeat(np.arange(len(meshes)), [len(m.faces) for m in meshes])
        corners = mesh.vertices[mesh.faces]
        normals = _normals(corners)
        sight = self.camera.position - 0.25 * (corners[:, 0] + corners[:, 1] + corners[:, 2] + corners[:, 3])
        seen = np.flatnonzero(np.einsum("fk,fk->f", normals, sight) > 0.0)
        distance = _length(sight[seen])
        clear = self._fog(distance) < 1.0
        seen, distance = seen[clear], distance[clear]
        order = np.lexsort((-distance, layer[seen]))
        seen, distance = seen[order], distance[order]
        colours = shaded(mesh.chosen(seen), normals[seen], sight[seen] / distance[:, None])
        self._faces(self.camera.view(corners[seen]), self._faded(colours, distance), mesh.opacity[seen])

    def _faces(self, view: Floats, colours: Floats, opacity: Floats) -> None:
        near = np.asarray(view[..., 2] < NEAR)
        whole: NDArray[np.bool_] = ~np.any(near, axis=1)
        projected = self.camera.pixels(np.where(whole[:, None, None], view, 1.0))
        shown = np.flatnonzero(np.where(whole, self._on_picture(projected), ~np.all(near, axis=1))).tolist()
        pixels, rounded = projected.tolist(), np.clip(colours, 0.0, 255.0).astype(int).tolist()
        for i in shown:
            colour = rounded[i]
            points = pixels[i] if whole[i] else self.camera.pixels(clip_near(view[i])).tolist()
            if opacity[i] > _OPAQUE:
                self._draw.polygon(self.surface, colour, points)
            else:
                self._blend.filled_polygon(self.surface, points, (*colour, round(255 * opacity[i])))

    def lines(self, start: Floats, end: Floats, colour: Colour, width: float) -> None:
        """Draw segments (n, 3) of F_I, each faded by its distance; the width is in pixels."""
        a, b = clip_segments(self.camera.view(start), self.camera.view(end))
        distance = _length(0.5 * (a + b))
        shown = self._fog(distance) < _INVISIBLE
        a, b, distance = self.camera.pixels(a[shown]), self.camera.pixels(b[shown]), distance[shown]
        colours = self._faded(np.tile(np.array(colour, float), (len(a), 1)), distance)
        corners = strokes(a, b, width)
        inside = self._on_picture(corners)
        for corner, c in zip(corners[inside].tolist(), colours[inside].astype(int).tolist(), strict=True):
            self._draw.polygon(self.surface, c, corner)

    def arrow(self, start: Floats, tip: Floats, colour: Colour) -> None:
        """An arrow between two points (3,) of F_I in front of the camera; its width is that of the paper."""
        a, b = self.camera.project(np.stack([start, tip]))
        size = self.surface.get_height() / 720.0
        length = float(np.linalg.norm(b - a))
        if length < 1.0:
            return
        forward = (b - a) / length
        across = np.array([-forward[1], forward[0]])
        neck = b - min(13.0 * size, 0.6 * length) * forward
        shaft = strokes(a[None], neck[None], 3.4 * size)[0]
        self._draw.polygon(self.surface, colour, shaft.tolist())
        barb = 5.5 * size * across
        self._draw.polygon(self.surface, colour, [tuple(b), tuple(neck + barb), tuple(neck - barb)])

    def _on_picture(self, pixels: Floats) -> NDArray[np.bool_]:
        """(n,) Which polygons (n, k, 2) may show: pygame would scan the others row by row."""
        low, high = pixels.min(axis=1), pixels.max(axis=1)
        return np.asarray(np.all((high >= 0.0) & (low <= self.surface.get_size()), axis=1))

    def _fog(self, distance: Floats) -> Floats:
        near, far = self.fog
        return np.clip((distance - near) / (far - near), 0.0, 1.0)

    def _faded(self, colours: Floats, distance: Floats) -> Floats:
        weight = self._fog(distance)[:, None]
        return np.asarray(colours * (1.0 - weight) + np.array(BACKDROP) * weight)


def strokes(start: Floats, end: Floats, width: float) -> Floats:
    """(n, 4, 2) corners of lines of a width between pixels (n, 2)."""
    along = end - start
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    side = 0.5 * width / length * np.stack([-along[:, 1], along[:, 0]], axis=1)
    return np.stack([start + side, end + side, end - side, start - side], axis=1)


def _normals(corners: Floats) -> Floats:
    """(f, 3) outward unit normals of faces (f, 4, 3)."""
    p, q = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    # np.cross spends most of its time on checks at this size.
    normal = p[:, [1, 2, 0]] * q[:, [2, 0, 1]] - p[:, [2, 0, 1]] * q[:, [1, 2, 0]]
    return np.asarray(normal / np.maximum(_length(normal), 1e-12)[:, None])


def _length(vectors: Floats) -> Floats:
    """(n,) lengths of vectors (n, 3)."""
    return np.asarray(np.sqrt(np.einsum("nk,nk->n", vectors, vectors)))


def shaded(mesh: Mesh, normals: Floats, sight: Floats) -> NDArray[np.float64]:
    """(f, 3) Colours of the faces under the lamp.

    Args:
        mesh: Its own colours and gloss.
        normals: (f, 3) outward unit normals in F_I.
        sight: (f, 3) unit vectors towards the camera.
    """
    lamp = np.clip(normals @ LIGHT, 0.0, 1.0)
    up = np.clip(-normals[:, 2], 0.0, 1.0)
    halfway = sight + LIGHT
    halfway = halfway / _length(halfway)[:, None]
    highlight = mesh.gloss * np.clip(np.einsum("fk,fk->f", normals, halfway), 0.0, 1.0) ** SHININESS
    light = AMBIENT + SKYLIGHT * up + DIFFUSE * lamp
    return np.asarray(mesh.colours * light[:, None] + 255.0 * highlight[:, None])
