"""Use of the travel: the carriage in plan, the heading of the turntable, six bars for the legs."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..platform.machines import Platform
from . import theme
from .canvas import Canvas
from .motion_view import MotionView, leg_use
from .strip_chart import Box

_LABEL: Final = 11.0


def draw_gauges(canvas: Canvas, place: Box, platform: Platform, motion: MotionView) -> None:
    """Draw what the machine has, from left to right."""
    canvas.rectangle(place.x, place.y, place.width, place.height, theme.CARD, 6.0)
    third = place.width / 3.0
    square = min(third - 24.0, place.height - 56.0)
    middle = place.y + 30.0 + 0.5 * square
    cells = [place.x + third * (k + 0.5) for k in range(3)]
    for x, label in zip(cells, ("Carriage", "Turntable", "Legs"), strict=True):
        canvas.text(x, place.y + 15.0, label, 12.0, anchor="centre")
    below = place.y + place.height - 13.0
    _carriage(canvas, cells[0], middle, square, below, platform, motion)
    _turntable(canvas, cells[1], middle, 0.5 * square, below, platform, motion)
    _legs(
        canvas, Box(cells[2] - 0.5 * square, middle - 0.5 * square, square, square), below, platform, motion
    )


def _carriage(
    canvas: Canvas,
    x: float,
    y: float,
    square: float,
    below: float,
    platform: Platform,
    motion: MotionView,
) -> None:
    """Travel in plan: ahead is up, right is right."""
    carriage = platform.carriage
    if carriage is None:
        canvas.text(x, y, "none", _LABEL, theme.FAINT_TEXT, "centre")
        return
    low = np.array([carriage.travel_x[0], carriage.travel_y[0]])
    high = np.array([carriage.travel_x[1], carriage.travel_y[1]])
    scale = (square - 4.0) / float(max(*(high - low), 1e-9))
    centre = 0.5 * (low + high)
    tall, wide = scale * (high - low)
    edge = Box(x - 0.5 * wide, y - 0.5 * tall, wide, tall)
    canvas.rectangle(edge.x - 2.0, edge.y - 2.0, wide + 4.0, tall + 4.0, theme.TRAVEL, 3.0)
    canvas.rectangle(edge.x - 1.0, edge.y - 1.0, wide + 2.0, tall + 2.0, theme.PANEL, 2.0)
    canvas.line((x, edge.y), (x, edge.y + tall), theme.LINE, 0.8)
    canvas.line((edge.x, y), (edge.x + wide, y), theme.LINE, 0.8)
    ahead, right = scale * (motion.carriage - centre)
    limit = np.where(motion.carriage >= 0.0, high, low)
    use = float(np.max(np.divide(motion.carriage, limit, out=np.zeros(2), where=limit != 0.0)))
    canvas.circle(x + right, y - ahead, 5.0, theme.colour_of_use(use))
    words = f"x {signed(motion.carriage[0], 1)}  y {signed(motion.carriage[1], 1)} m"
    canvas.text(x, below, words, _LABEL, theme.FAINT_TEXT, "centre")


def _turntable(
    canvas: Canvas,
    x: float,
    y: float,
    radius: float,
    below: float,
    platform: Platform,
    motion: MotionView,
) -> None:
    """The heading in plan: ahead is up, positive to the right."""
    turntable = platform.turntable
    if turntable is None:
        canvas.text(x, y, "none", _LABEL, theme.FAINT_TEXT, "centre")
        return
    canvas.circle(x, y, radius, theme.LINE)
    canvas.circle(x, y, radius - 1.4, theme.PANEL)

    def ray(angle: float, inner: float, outer: float, colour: theme.Colour, width: float) -> None:
        s, c = np.sin(angle), -np.cos(angle)
        canvas.line((x + inner * s, y + inner * c), (x + outer * s, y + outer * c), colour, width)

    for angle in np.arange(0.0, 2.0 * np.pi, np.pi / 6.0):
        ray(angle, radius - 6.0, radius - 2.0, theme.LINE, 1.0)
    stops = turntable.travel or (-np.inf, np.inf)
    for stop in (stop for stop in stops if abs(stop) < np.pi):
        ray(stop, 0.6 * radius, radius, theme.TRAVEL, 2.0)
    s, c = np.sin(motion.turntable), np.cos(motion.turntable)
    needle = radius * np.array([[0.0, -0.82], [0.17, 0.30], [0.0, 0.16], [-0.17, 0.30]])
    use = motion.turntable / (stops[1] if motion.turntable > 0.0 else stops[0])
    canvas.polygon((x, y) + needle @ np.array([[c, s], [-s, c]]), theme.colour_of_use(use))
    canvas.text(x, below, f"{signed(np.degrees(motion.turntable), 0)}°", _LABEL, theme.FAINT_TEXT, "centre")


def _legs(canvas: Canvas, place: Box, below: float, platform: Platform, motion: MotionView) -> None:
    """Extension of each leg: up is out, the middle is neutral."""
    use = leg_use(platform, motion)
    pitch = place.width / len(use)
    half = 0.5 * place.height
    middle = place.y + half
    for i, u in enumerate(use):
        x, wide = place.x + (i + 0.18) * pitch, 0.64 * pitch
        canvas.rectangle(x, place.y, wide, place.height, theme.PANEL, 2.0)
        length = max(1.5, min(abs(float(u)), 1.0) * half)
        canvas.rectangle(
            x, middle - (length if u > 0.0 else 0.0), wide, length, theme.colour_of_use(float(u))
        )
    canvas.line((place.x, middle), (place.x + place.width, middle), theme.FAINT_TEXT, 0.8)
    most = motion.legs[int(np.argmax(np.abs(motion.legs)))]
    canvas.text(
        place.x + 0.5 * place.width,
        below,
        f"{signed(most, 2)} m",
        _LABEL,
        theme.FAINT_TEXT,
        "centre",
    )


def signed(value: float, digits: int) -> str:
    """A number with its sign; what rounds to zero never flickers between +0 and −0."""
    return f"{round(float(value), digits) + 0.0:+.{digits}f}".replace("-", "−")
