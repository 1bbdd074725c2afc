"""A chart of the last seconds of one cue: wanted in white, felt in colour, the gap between them shaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from . import theme
from .camera import Floats
from .canvas import Canvas
from .cue_history import CueHistory

_LADDER: Final = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0, 100.0, 200.0, 500.0)
"""Ranges an axis may have, in its own unit."""
_HEADROOM: Final = 1.05
_MOST_POINTS: Final = 160
_TICK_SPACING: Final = 2.0
"""Between vertical grid lines, s."""


@dataclass(frozen=True)
class Channel:
    """What a chart shows.

    Args:
        title: Name of the cue.
        axis: Index in the cues of :class:`CueHistory`.
        unit: For people.
        scale: From SI to that unit.
        least_range: Smallest range of the axis, in that unit.
    """

    title: str
    axis: int
    unit: str
    scale: float
    least_range: float


CHANNELS: Final = (
    Channel("Specific force f_x, forward", 0, "m/s²", 1.0, 1.0),
    Channel("Specific force f_y, to the right", 1, "m/s²", 1.0, 1.0),
    Channel("Yaw rate, to the right", 5, "deg/s", float(np.degrees(1.0)), 5.0),
)


@dataclass(frozen=True)
class Box:
    """A rectangle of the picture, in units of the canvas."""

    x: float
    y: float
    width: float
    height: float


def axis_range(channel: Channel, peak: float) -> float:
    """Range of the axis that holds a peak, in SI; it only grows as a drive goes on."""
    needed = max(channel.least_range, _HEADROOM * peak * channel.scale)
    return next((step for step in _LADDER if step >= needed), needed)


def draw_chart(canvas: Canvas, place: Box, channel: Channel, cues: CueHistory) -> None:
    """Draw a channel of a history."""
    canvas.rectangle(place.x, place.y, place.width, place.height, theme.CARD, 6.0)
    canvas.text(place.x + 12.0, place.y + 15.0, channel.title, 12.0)
    canvas.text(place.x + place.width - 12.0, place.y + 15.0, channel.unit, 11.0, theme.FAINT_TEXT, "right")
    plot = Box(place.x + 36.0, place.y + 31.0, place.width - 48.0, place.height - 42.0)
    limit = axis_range(channel, float(cues.peak[channel.axis]))
    begin = max(0.0, cues.time - cues.window)
    _axes(canvas, plot, limit, begin, cues.window)
    rows = _every_nth(cues)
    if len(rows) < 2:
        return
    x = plot.x + plot.width * (cues.times[rows] - begin) / cues.window

    def curve(values: Floats) -> Floats:
        share = values[rows, channel.axis] * channel.scale / limit
        return np.column_stack([x, plot.y + 0.5 * plot.height * (1.0 - np.clip(share, -1.0, 1.0))])

    wanted, felt = curve(cues.wanted), curve(cues.felt)
    canvas.polygon(np.concatenate([wanted, felt[::-1]]), theme.blend(theme.CARD, theme.FELT, 0.2))
    canvas.polyline(wanted, theme.WANTED, 1.6)
    canvas.polyline(felt, theme.FELT, 2.0)
    canvas.circle(wanted[-1, 0], wanted[-1, 1], 2.4, theme.WANTED)
    canvas.circle(felt[-1, 0], felt[-1, 1], 3.0, theme.FELT)


def _axes(canvas: Canvas, plot: Box, limit: float, begin: float, window: float) -> None:
    for share in (-1.0, 0.0, 1.0):
        y = plot.y + 0.5 * plot.height * (1.0 - share)
        colour = theme.LINE if share else theme.blend(theme.LINE, theme.FAINT_TEXT, 0.35)
        canvas.line((plot.x, y), (plot.x + plot.width, y), colour, 0.8)
        label = f"{share * limit:+g}".replace("-", "−") if share else "0"
        canvas.text(plot.x - 6.0, y, label, 10.0, theme.FAINT_TEXT, "right")
    for tick in np.arange(np.ceil(begin / _TICK_SPACING) * _TICK_SPACING, begin + window, _TICK_SPACING):
        x = plot.x + plot.width * (float(tick) - begin) / window
        canvas.line((x, plot.y), (x, plot.y + plot.height), theme.blend(theme.CARD, theme.LINE, 0.6), 0.8)


def _every_nth(cues: CueHistory) -> np.ndarray:
    """Rows to draw: always the same samples of a drive, so that the curve does not shimmer, and the last."""
    count = len(cues)
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    step = max(1, round(cues.window / cues.dt / _MOST_POINTS))
    first = -round(float(cues.times[0]) / cues.dt) % step
    return np.unique(np.append(np.arange(first, count, step), count - 1))
