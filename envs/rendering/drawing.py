"""Drawing with pygame: camera, meshes, shading, and a flat surface for shapes and text; z points down."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MotionCueingError
from .theme import AMBIENT, BACKDROP, DIFFUSE, LIGHT, SHININESS, SKYLIGHT, TEXT, Color

Floats = NDArray[np.float64]


class RenderingUnavailableError(MotionCueingError, ImportError):
    """A package that draws or writes pictures is not installed."""


def load_pygame() -> ModuleType:
    """Pygame, without its greeting.

    Raises:
        RenderingUnavailableError: it is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    return load("pygame", "pygame-ce")


def load(module: str, package: str) -> ModuleType:
    """A module of the extra ``render``, of a package.

    Raises:
        RenderingUnavailableError: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        raise RenderingUnavailableError(
            f"rendering needs {package}: pip install 'motion-cueing-gym[render]'"
        ) from None


NEAR: Final = 2.0
"""Distance of the near plane, m: nothing closer is drawn."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera that looks from ``position`` at ``target`` with the sky up.

    Args:
        position: (3,) m, in F_I.
        target: (3,) m, in F_I; appears at ``center``.
        focal: Focal length, pixels.
        center: Pixel (x, y) of the target; x to the right, y down.
    """

    position: Floats
    target: Floats
    focal: float
    center: tuple[float, float]

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
        return np.asarray(view[..., :2] * (self.focal / view[..., 2:]) + self.center)

    def project(self, points: Floats) -> Floats:
        """Pixels (..., 2) of points (..., 3) of F_I in front of the camera."""
        return self.pixels(self.view(points))


def orbit(
    target: Floats,
    distance: float,
    azimuth: float,
    elevation: float,
    focal: float,
    center: tuple[float, float],
) -> Camera:
    """A camera on a sphere around its target.

    Args:
        target: (3,) m.
        distance: m.
        azimuth: Where the camera stands, from x towards y, rad.
        elevation: Above the horizontal, rad.
        focal: Focal length, pixels.
        center: Pixel of the target.
    """
    level = np.cos(elevation)
    offset = np.array([level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(elevation)])
    return Camera(target + distance * offset, target, focal, center)


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


Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Flat faces of four corners; a triangle repeats its last one.

    Corners run counter-clockwise seen from outside: (c - a) x (d - b) points outwards.

    Args:
        vertices: (v, 3) m.
        faces: (f, 4) indices of vertices.
        colors: (f, 3) 0 to 255.
        gloss: (f,) strength of the highlight, 0 to 1.
        opacity: (f,) 1 for all but glass.
    """

    vertices: Floats
    faces: Ints
    colors: Floats
    gloss: Floats
    opacity: Floats

    def moved(self, offset: ArrayLike) -> Mesh:
        """The mesh elsewhere, m."""
        return replace(self, vertices=self.vertices + np.asarray(offset))

    def flipped(self, color: Color) -> Mesh:
        """The same surface seen from inside, in a dull color of its own."""
        return mesh(self.vertices, self.faces[:, ::-1], color)

    def chosen(self, faces: NDArray[Any]) -> Mesh:
        """Some of the faces, by index or mask."""
        return Mesh(
            self.vertices, self.faces[faces], self.colors[faces], self.gloss[faces], self.opacity[faces]
        )


def mesh(vertices: Floats, faces: Ints, color: Color, gloss: float = 0.0) -> Mesh:
    """A mesh of one color."""
    n = len(faces)
    return Mesh(vertices, faces, np.tile(np.array(color, float), (n, 1)), np.full(n, gloss), np.ones(n))


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes[:-1])])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=True)]),
        np.concatenate([m.colors for m in meshes]),
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


def prism(outline: Floats, top: float, bottom: float, color: Color, gloss: float = 0.0) -> Mesh:
    """A vertical prism between z = ``top`` and ``bottom``, m; the outline (n, 2) is convex, from x to y."""
    n = len(outline)
    rings = [np.column_stack([outline, np.full(n, z)]) for z in (top, bottom)]
    faces = np.concatenate([ring_walls(n, 2), cap(n, 0, True), cap(n, n, False)])
    return mesh(np.concatenate(rings), faces, color, gloss)


def circle(radius: float, sides: int) -> Floats:
    """(sides, 2) A regular polygon, turning from x to y."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def box(low: ArrayLike, high: ArrayLike, color: Color, gloss: float = 0.0) -> Mesh:
    """A box between two corners, m."""
    (x0, y0, z0), (x1, y1, z1) = np.asarray(low, float), np.asarray(high, float)
    return prism(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), z0, z1, color, gloss)


def sphere(radius: float, color: Color, sides: int = 12, gloss: float = 0.0) -> Mesh:
    """A sphere around the origin."""
    polar = np.linspace(0.06, np.pi - 0.06, sides // 2 + 1)
    rings = [
        np.column_stack([circle(radius * np.sin(a), sides), np.full(sides, -radius * np.cos(a))])
        for a in polar
    ]
    last = sides * (len(rings) - 1)
    faces = np.concatenate([ring_walls(sides, len(rings)), cap(sides, 0, True), cap(sides, last, False)])
    return mesh(np.concatenate(rings), faces, color, gloss)


def cylinder(
    start: ArrayLike, end: ArrayLike, radius: float, color: Color, gloss: float = 0.0, sides: int = 14
) -> Mesh:
    """A cylinder from one point to another, m."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    solid = prism(circle(radius, sides), 0.0, float(np.linalg.norm(end - start)), color, gloss)
    return replace(solid, vertices=solid.vertices @ along(end - start).T + start)


def along(direction: Floats) -> Floats:
    """Rotations (..., 3, 3) that take z to directions (..., 3)."""
    z = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    # The second factor starts from the axis least along z, so that the product with it is never near zero.
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=-1)], z)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


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
        colors = shaded(mesh.chosen(seen), normals[seen], sight[seen] / distance[:, None])
        self._faces(self.camera.view(corners[seen]), self._faded(colors, distance), mesh.opacity[seen])

    def _faces(self, view: Floats, colors: Floats, opacity: Floats) -> None:
        near = np.asarray(view[..., 2] < NEAR)
        whole: NDArray[np.bool_] = ~np.any(near, axis=1)
        projected = self.camera.pixels(np.where(whole[:, None, None], view, 1.0))
        shown = np.flatnonzero(np.where(whole, self._on_picture(projected), ~np.all(near, axis=1))).tolist()
        pixels, rounded = projected.tolist(), np.clip(colors, 0.0, 255.0).astype(int).tolist()
        for i in shown:
            color = rounded[i]
            points = pixels[i] if whole[i] else self.camera.pixels(clip_near(view[i])).tolist()
            if opacity[i] > _OPAQUE:
                self._draw.polygon(self.surface, color, points)
            else:
                self._blend.filled_polygon(self.surface, points, (*color, round(255 * opacity[i])))

    def lines(self, start: Floats, end: Floats, color: Color, width: float) -> None:
        """Draw segments (n, 3) of F_I, each faded by its distance; the width is in pixels."""
        a, b = clip_segments(self.camera.view(start), self.camera.view(end))
        distance = _length(0.5 * (a + b))
        shown = self._fog(distance) < _INVISIBLE
        a, b, distance = self.camera.pixels(a[shown]), self.camera.pixels(b[shown]), distance[shown]
        colors = self._faded(np.tile(np.array(color, float), (len(a), 1)), distance)
        corners = strokes(a, b, width)
        inside = self._on_picture(corners)
        for corner, c in zip(corners[inside].tolist(), colors[inside].astype(int).tolist(), strict=True):
            self._draw.polygon(self.surface, c, corner)

    def arrow(self, start: Floats, tip: Floats, color: Color) -> None:
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
        self._draw.polygon(self.surface, color, shaft.tolist())
        barb = 5.5 * size * across
        self._draw.polygon(self.surface, color, [tuple(b), tuple(neck + barb), tuple(neck - barb)])

    def _on_picture(self, pixels: Floats) -> NDArray[np.bool_]:
        """(n,) Which polygons (n, k, 2) may show: pygame would scan the others row by row."""
        low, high = pixels.min(axis=1), pixels.max(axis=1)
        return np.asarray(np.all((high >= 0.0) & (low <= self.surface.get_size()), axis=1))

    def _fog(self, distance: Floats) -> Floats:
        near, far = self.fog
        return np.clip((distance - near) / (far - near), 0.0, 1.0)

    def _faded(self, colors: Floats, distance: Floats) -> Floats:
        weight = self._fog(distance)[:, None]
        return np.asarray(colors * (1.0 - weight) + np.array(BACKDROP) * weight)


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
    """(f, 3) Colors of the faces under the lamp.

    Args:
        mesh: Its own colors and gloss.
        normals: (f, 3) outward unit normals in F_I.
        sight: (f, 3) unit vectors towards the camera.
    """
    lamp = np.clip(normals @ LIGHT, 0.0, 1.0)
    up = np.clip(-normals[:, 2], 0.0, 1.0)
    halfway = sight + LIGHT
    halfway = halfway / _length(halfway)[:, None]
    highlight = mesh.gloss * np.clip(np.einsum("fk,fk->f", normals, halfway), 0.0, 1.0) ** SHININESS
    light = AMBIENT + SKYLIGHT * up + DIFFUSE * lamp
    return np.asarray(mesh.colors * light[:, None] + 255.0 * highlight[:, None])


SUPERSAMPLING: Final = 2
"""Pixels drawn for one that is shown, in each direction."""
DESIGN_HEIGHT: Final = 720
"""Height of the picture in which lengths of the panel are given."""

_FONTS: Final = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
_ANCHORS: Final = {"left": 0.0, "center": 0.5, "right": 1.0}


class Canvas:
    """Draws in units of a picture 720 high, whatever its true size (width and height, pixels)."""

    def __init__(self, pygame: ModuleType, size: tuple[int, int]) -> None:
        self._pygame: Any = pygame
        pygame.font.init()
        self.size = size
        self.unit = size[1] / DESIGN_HEIGHT
        self._scale = self.unit * SUPERSAMPLING
        self.surface = pygame.Surface((size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING), depth=32)
        self._texts: list[tuple[Any, tuple[float, float]]] = []
        self._rendered = lru_cache(maxsize=512)(self._render)
        self._font = lru_cache(maxsize=32)(self._load_font)

    @property
    def width(self) -> float:
        """Width in units."""
        return self.size[0] / self.unit

    def rectangle(
        self, x: float, y: float, width: float, height: float, color: Color, radius: float = 0.0
    ) -> None:
        """A filled rectangle with round corners."""
        s = self._scale
        box = (round(x * s), round(y * s), round(width * s), round(height * s))
        self._pygame.draw.rect(self.surface, color, box, border_radius=round(radius * s))

    def circle(self, x: float, y: float, radius: float, color: Color, width: float = 0.0) -> None:
        """A circle; filled if it has no width."""
        s = self._scale
        thick = max(1, round(width * s)) if width else 0
        self._pygame.draw.circle(self.surface, color, (x * s, y * s), radius * s, thick)

    def line(self, a: Sequence[float], b: Sequence[float], color: Color, width: float) -> None:
        """A straight line."""
        s = self._scale
        dx, dy = b[0] - a[0], b[1] - a[1]
        half = 0.5 * width / max(math.hypot(dx, dy), 1e-9)
        nx, ny = -dy * half, dx * half
        corners = ((a, 1.0), (b, 1.0), (b, -1.0), (a, -1.0))
        self._pygame.draw.polygon(
            self.surface, color, [((p[0] + k * nx) * s, (p[1] + k * ny) * s) for p, k in corners]
        )

    def polyline(self, points: Floats, color: Color, width: float) -> None:
        """A line through points (n, 2), drawn as one ribbon."""
        ribbon = ribbon_of(points * self._scale, width * self._scale)
        self._pygame.draw.polygon(self.surface, color, ribbon.tolist())

    def polygon(self, points: Floats, color: Color) -> None:
        """A filled polygon (n, 2)."""
        self._pygame.draw.polygon(self.surface, color, (points * self._scale).tolist())

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: float,
        color: Color = TEXT,
        anchor: str = "left",
        bold: bool = False,
    ) -> None:
        """A line of text, its middle at ``y``, its ``anchor`` ("left", "center", "right") at ``x``."""
        image = self._rendered(words, size, color, bold)
        wide, high = image.get_size()
        corner = (x * self.unit - _ANCHORS[anchor] * wide, y * self.unit - 0.5 * high)
        self._texts.append((image, corner))

    def text_width(self, words: str, size: float, bold: bool = False) -> float:
        """Width of a line of text."""
        return float(self._font(size, bold).size(words)[0]) / self.unit

    def finish(self) -> Any:
        """The picture at its true size; the canvas is ready for the next one."""
        picture = self._pygame.transform.smoothscale(self.surface, self.size)
        picture.blits([(image, (round(x), round(y))) for image, (x, y) in self._texts])
        self._texts.clear()
        return picture

    def _render(self, words: str, size: float, color: Color, bold: bool) -> Any:
        return self._font(size, bold).render(words, True, color)

    def _load_font(self, size: float, bold: bool) -> Any:
        return self._pygame.font.Font(_font_file(bold), max(6, round(size * self.unit)))


def _font_file(bold: bool) -> str | None:
    """The type of this project's figures, which matplotlib brings; None for pygame's own."""
    matplotlib = find_spec("matplotlib")
    if matplotlib is None or matplotlib.origin is None:
        return None
    file = Path(matplotlib.origin).parent / "mpl-data" / "fonts" / "ttf" / _FONTS[bold]
    return str(file) if file.exists() else None


def ribbon_of(points: Floats, width: float) -> Floats:
    """(2 n, 2) outline of a line of a width through points (n, 2), there and back."""
    along = np.gradient(points, axis=0)
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    side = 0.5 * width * np.column_stack([-along[:, 1], along[:, 0]]) / length
    return np.concatenate([points + side, (points - side)[::-1]])
