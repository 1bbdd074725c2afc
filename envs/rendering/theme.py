"""Colors and light of the pictures."""

from __future__ import annotations

from typing import Final

import numpy as np

Color = tuple[int, int, int]

BACKDROP: Final[Color] = (17, 21, 28)
"""Far away everything fades into it."""
GLOW: Final[Color] = (45, 54, 67)
"""The floor in the middle of the light."""
GRID: Final[Color] = (58, 69, 85)
TRAVEL: Final[Color] = (205, 96, 80)
"""Limits of the carriage's travel."""

STEEL: Final[Color] = (96, 108, 124)
DARK_STEEL: Final[Color] = (62, 71, 84)
RAIL: Final[Color] = (122, 135, 152)
CARRIAGE: Final[Color] = (78, 92, 110)
PLATFORM: Final[Color] = (92, 105, 123)
TURNTABLE: Final[Color] = (52, 60, 72)
ROD: Final[Color] = (214, 221, 229)
BODY: Final[Color] = (182, 189, 199)
GLASS: Final[Color] = (70, 104, 130)
TYRE: Final[Color] = (30, 33, 38)
RIM: Final[Color] = (150, 158, 168)
INTERIOR: Final[Color] = (38, 43, 51)
SKIN: Final[Color] = (232, 178, 140)
SHIRT: Final[Color] = (62, 118, 168)
HEADLIGHT: Final[Color] = (255, 246, 214)
TAIL_LIGHT: Final[Color] = (206, 52, 46)

REFERENCE: Final[Color] = (242, 244, 247)
SIMULATOR: Final[Color] = (86, 180, 233)
"""Okabe and Ito's sky blue: everyone can distinguish it from white and from the colors of use."""

PANEL: Final[Color] = (22, 27, 35)
CARD: Final[Color] = (29, 35, 45)
LINE: Final[Color] = (58, 68, 82)
TEXT: Final[Color] = (226, 231, 238)
FAINT_TEXT: Final[Color] = (142, 154, 170)

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


def color_of_use(use: float) -> Color:
    """Color of an actuator at a share of its travel: green at ease, amber from 0.8, red at the end."""
    at = min(abs(use), 1.0)
    r, g, b = (round(float(np.interp(at, _USE_AT, _USE[:, k]))) for k in range(3))
    return (r, g, b)


def blend(a: Color, b: Color, weight: float) -> Color:
    """``a`` with a share ``weight`` of ``b``."""
    r, g, h = (round((1.0 - weight) * p + weight * q) for p, q in zip(a, b, strict=True))
    return (r, g, h)
