"""A flat drawing surface: shapes at twice the size, text on top at its true size, so that both are smooth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np

from .camera import Floats
from .theme import TEXT, Colour

SUPERSAMPLING: Final = 2
"""Pixels drawn for one that is shown, in each direction."""
DESIGN_HEIGHT: Final = 720
"""Height of the picture in which lengths of the panel are given."""

_FONTS: Final = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
_ANCHORS: Final = {"left": 0.0, "centre": 0.5, "right": 1.0}


class Canvas:
    """Draws in units of a picture 720 high, whatever its true size.

    Args:
        pygame: The module.
        size: Width and height of the picture, pixels.
    """

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
        self, x: float, y: float, width: float, height: float, colour: Colour, radius: float = 0.0
    ) -> None:
        """A filled rectangle with round corners."""
        s = self._scale
        box = (round(x * s), round(y * s), round(width * s), round(height * s))
        self._pygame.draw.rect(self.surface, colour, box, border_radius=round(radius * s))

    def circle(self, x: float, y: float, radius: float, colour: Colour, width: float = 0.0) -> None:
        """A circle; filled if it has no width."""
        s = self._scale
        thick = max(1, round(width * s)) if width else 0
        self._pygame.draw.circle(self.surface, colour, (x * s, y * s), radius * s, thick)

    def line(self, a: Sequence[float], b: Sequence[float], colour: Colour, width: float) -> None:
        """A straight line."""
        s = self._scale
        dx, dy = b[0] - a[0], b[1] - a[1]
        half = 0.5 * width / max(math.hypot(dx, dy), 1e-9)
        nx, ny = -dy * half, dx * half
        corners = ((a, 1.0), (b, 1.0), (b, -1.0), (a, -1.0))
        self._pygame.draw.polygon(
            self.surface, colour, [((p[0] + k * nx) * s, (p[1] + k * ny) * s) for p, k in corners]
        )

    def polyline(self, points: Floats, colour: Colour, width: float) -> None:
        """A line through points (n, 2), drawn as one ribbon."""
        ribbon = ribbon_of(points * self._scale, width * self._scale)
        self._pygame.draw.polygon(self.surface, colour, ribbon.tolist())

    def polygon(self, points: Floats, colour: Colour) -> None:
        """A filled polygon (n, 2)."""
        self._pygame.draw.polygon(self.surface, colour, (points * self._scale).tolist())

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: float,
        colour: Colour = TEXT,
        anchor: str = "left",
        bold: bool = False,
    ) -> None:
        """A line of text.

        Args:
            x: Of its anchor.
            y: Of its middle.
            words: What it says.
            size: Height of the type.
            colour: Of the type.
            anchor: "left", "centre" or "right": the end that lies at ``x``.
            bold: Heavy type.
        """
        image = self._rendered(words, size, colour, bold)
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

    def _render(self, words: str, size: float, colour: Colour, bold: bool) -> Any:
        return self._font(size, bold).render(words, True, colour)

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
