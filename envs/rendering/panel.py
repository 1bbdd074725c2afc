"""The panel beside the machine: what is driven, J so far, the cues, and the use of the machine."""

from __future__ import annotations

from typing import Final

from ..platform.machines import Platform
from . import theme
from .canvas import DESIGN_HEIGHT, Canvas
from .cue_history import CueHistory
from .gauges import draw_gauges
from .motion_view import MotionView
from .strip_chart import CHANNELS, Box, draw_chart

PANEL_WIDTH: Final = 400.0
"""In units of the canvas."""
_MARGIN: Final = 14.0
_HEADER: Final = 92.0
_GAP: Final = 8.0
_GAUGES: Final = 164.0
_LONGEST: Final = 26
"""Characters of a name before it is cut."""


def draw_panel(canvas: Canvas, platform: Platform, motion: MotionView, cues: CueHistory) -> None:
    """Draw the panel at the right edge."""
    left = canvas.width - PANEL_WIDTH
    canvas.rectangle(left, 0.0, PANEL_WIDTH, DESIGN_HEIGHT, theme.PANEL)
    inner = Box(left + _MARGIN, _MARGIN, PANEL_WIDTH - 2.0 * _MARGIN, DESIGN_HEIGHT - 2.0 * _MARGIN)
    _header(canvas, inner, cues)
    charts = inner.height - _HEADER - _GAUGES
    each = charts / len(CHANNELS)
    for k, channel in enumerate(CHANNELS):
        place = Box(inner.x, inner.y + _HEADER + k * each, inner.width, each - _GAP)
        draw_chart(canvas, place, channel, cues)
    bottom = Box(inner.x, inner.y + inner.height - _GAUGES, inner.width, _GAUGES)
    draw_gauges(canvas, bottom, platform, motion)


def _header(canvas: Canvas, place: Box, cues: CueHistory) -> None:
    right = place.x + place.width
    canvas.text(place.x + 2.0, place.y + 12.0, shortened(cues.maneuver), 18.0, bold=True)
    canvas.text(place.x + 2.0, place.y + 37.0, shortened(cues.policy), 13.0, theme.FAINT_TEXT)
    canvas.text(right - 2.0, place.y + 12.0, f"{cues.time:.1f} s", 18.0, anchor="right")
    canvas.text(
        right - 2.0, place.y + 37.0, f"J so far  {cues.cue_error:.2f}", 13.0, anchor="right", bold=True
    )
    x = place.x + 2.0
    for words, colour in (("wanted", theme.WANTED), ("felt", theme.FELT)):
        canvas.line((x, place.y + 67.0), (x + 20.0, place.y + 67.0), colour, 2.6)
        canvas.text(x + 27.0, place.y + 67.0, words, 12.0)
        x += 27.0 + canvas.text_width(words, 12.0) + 22.0
    canvas.text(right - 2.0, place.y + 67.0, f"last {cues.window:.0f} s", 12.0, theme.FAINT_TEXT, "right")


def shortened(name: str) -> str:
    """A name that fits the header."""
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
