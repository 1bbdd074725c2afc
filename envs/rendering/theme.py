"""Colours and light: a calm dark studio, in which what moves and what is felt stand out."""

from __future__ import annotations

from typing import Final

import numpy as np

Colour = tuple[int, int, int]

BACKDROP: Final[Colour] = (17, 21, 28)
"""Far away everything fades into it."""
GLOW: Final[Colour] = (45, 54, 67)
"""The floor in the middle of the light."""
GRID: Final[Colour] = (58, 69, 85)
TRAVEL: Final[Colour] = (205, 96, 80)
"""Limits of the carriage's travel."""

STEEL: Final[Colour] = (96, 108, 124)
DARK_STEEL: Final[Colour] = (62, 71, 84)
RAIL: Final[Colour] = (122, 135, 152)
CARRIAGE: Final[Colour] = (78, 92, 110)
PLATFORM: Final[Colour] = (92, 105, 123)
TURNTABLE: Final[Colour] = (52, 60, 72)
ROD: Final[Colour] = (214, 221, 229)
BODY: Final[Colour] = (182, 189, 199)
GLASS: Final[Colour] = (70, 104, 130)
TYRE: Final[Colour] = (30, 33, 38)
RIM: Final[Colour] = (150, 158, 168)
INTERIOR: Final[Colour] = (38, 43, 51)
SKIN: Final[Colour] = (232, 178, 140)
SHIRT: Final[Colour] = (62, 118, 168)
HEADLIGHT: Final[Colour] = (255, 246, 214)
TAIL_LIGHT: Final[Colour] = (206, 52, 46)

WANTED: Final[Colour] = (242, 244, 247)
FELT: Final[Colour] = (86, 180, 233)
"""Okabe and Ito's sky blue: told apart from white and from the colours of use by everyone."""

PANEL: Final[Colour] = (22, 27, 35)
CARD: Final[Colour] = (29, 35, 45)
LINE: Final[Colour] = (58, 68, 82)
TEXT: Final[Colour] = (226, 231, 238)
FAINT_TEXT: Final[Colour] = (142, 154, 170)

_USE: Final = np.array([[64, 176, 160], [64, 176, 160], [240, 180, 60], [226, 72, 60]], dtype=np.float64)
_USE_AT: Final = (0.0, 0.45, 0.8, 1.0)

LIGHT: Final = np.array([0.35, -0.55, -0.95]) / np.linalg.norm([0.35, -0.55, -0.95])
"""Direction towards the lamp, in F_I: above, ahead, to the left."""
AMBIENT: Final = 0.42
SKYLIGHT: Final = 0.16
"""Additional light on faces that look up."""
DIFFUSE: Final = 0.62
SHININESS: Final = 28.0
"""Exponent of the highlight (Blinn and Phong)."""


def colour_of_use(use: float) -> Colour:
    """Colour of an actuator at a share of its travel: green at ease, amber from 0.8, red at the end."""
    at = min(abs(use), 1.0)
    r, g, b = (round(float(np.interp(at, _USE_AT, _USE[:, k]))) for k in range(3))
    return (r, g, b)


def blend(a: Colour, b: Colour, weight: float) -> Colour:
    """``a`` with a share ``weight`` of ``b``."""
    r, g, h = (round((1.0 - weight) * p + weight * q) for p, q in zip(a, b, strict=True))
    return (r, g, h)
