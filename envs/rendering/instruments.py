"""The panel beside the machine: cues of the last seconds, J so far, and the use of travel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ConfigurationError, DataError
from ..platform.machines import Platform
from ..simulator.kernels.step import CueCost
from . import theme
from .drawing import DESIGN_HEIGHT, Canvas, Floats
from .machine_model import MotionView, leg_use

WINDOW: Final = 8.0
"""Seconds a chart shows."""


class CueHistory:
    """Reference and simulator cues at the cab: [f_x, f_y, f_z, w_x, w_y, w_z], m/s^2 and rad/s.

    Only the last :attr:`window` seconds are kept; J and the largest values are of the whole drive.

    Args:
        maneuver: Name to show.
        policy: Name to show.
        dt: Time between two samples, s.
        window: Seconds kept.
        cost: The indifference zone of J.

    Raises:
        ConfigurationError: ``dt`` or ``window`` is not positive.
    """

    def __init__(
        self, maneuver: str, policy: str, dt: float, window: float = WINDOW, cost: CueCost | None = None
    ) -> None:
        if not (dt > 0.0 and window > dt):
            raise ConfigurationError(f"dt must be positive and below window, found {dt} and {window}")
        self.maneuver, self.policy, self.dt, self.window = maneuver, policy, dt, window
        cost = cost or CueCost()
        self._scales = np.array([cost.force] * 3 + [cost.rate] * 3)
        self._capacity = int(np.ceil(window / dt)) + 1
        # Every row stands twice, so that the last ones are always in one piece.
        self._ring = np.zeros((2 * self._capacity, 13))
        self.clear()

    def clear(self) -> None:
        """Forget everything: a new drive begins."""
        self._count = 0
        self._cost_sum = 0.0
        self.peak = np.zeros(6)
        """(6,) Largest magnitude of each cue, reference or simulated."""

    def __len__(self) -> int:
        return min(self._count, self._capacity)

    def append(self, time: float, reference: ArrayLike, simulated: ArrayLike) -> None:
        """Add a sample: a time, s, later than the last one, and the reference and simulator cues (6,).

        Raises:
            DataError: a shape is wrong, a value is not finite, or time does not increase.
        """
        row = np.concatenate([[time], np.ravel(reference), np.ravel(simulated)]).astype(np.float64)
        if row.shape != (13,) or not np.isfinite(row).all():
            raise DataError("reference and simulated must each be 6 finite numbers at a finite time")
        if self._count and time <= self.time:
            raise DataError(f"time must increase, found {time} after {self.time}; clear() begins a new drive")
        k = self._count % self._capacity
        self._ring[k] = self._ring[k + self._capacity] = row
        self._count += 1
        self._cost_sum += float(np.sum(((row[7:] - row[1:7]) / self._scales) ** 2))
        self.peak = np.maximum(self.peak, np.abs(row[1:].reshape(2, 6)).max(axis=0))

    @property
    def time(self) -> float:
        """Time of the last sample, s; 0 before the first."""
        return float(self._ring[(self._count - 1) % self._capacity, 0]) if self._count else 0.0

    @property
    def cue_error(self) -> float:
        """J of the drive so far; 0 before the first sample."""
        return self._cost_sum / self._count if self._count else 0.0

    @property
    def times(self) -> Floats:
        """(m,) Times kept, s, oldest first."""
        return self._rows()[:, 0]

    @property
    def reference_cue(self) -> Floats:
        """(m, 6) Cues of the car."""
        return self._rows()[:, 1:7]

    @property
    def simulator_cue(self) -> Floats:
        """(m, 6) Cues of the simulator."""
        return self._rows()[:, 7:]

    def _rows(self) -> Floats:
        begin = self._count % self._capacity if self._count > self._capacity else 0
        rows = self._ring[begin : begin + len(self)]
        rows.setflags(write=False)
        return rows


_RANGES: Final = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0, 100.0, 200.0, 500.0)
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
    return next((step for step in _RANGES if step >= needed), needed)


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

    reference, simulated = curve(cues.reference_cue), curve(cues.simulator_cue)
    canvas.polygon(
        np.concatenate([reference, simulated[::-1]]), theme.blend(theme.CARD, theme.SIMULATOR, 0.2)
    )
    canvas.polyline(reference, theme.REFERENCE, 1.6)
    canvas.polyline(simulated, theme.SIMULATOR, 2.0)
    canvas.circle(reference[-1, 0], reference[-1, 1], 2.4, theme.REFERENCE)
    canvas.circle(simulated[-1, 0], simulated[-1, 1], 3.0, theme.SIMULATOR)


def _axes(canvas: Canvas, plot: Box, limit: float, begin: float, window: float) -> None:
    for share in (-1.0, 0.0, 1.0):
        y = plot.y + 0.5 * plot.height * (1.0 - share)
        color = theme.LINE if share else theme.blend(theme.LINE, theme.FAINT_TEXT, 0.35)
        canvas.line((plot.x, y), (plot.x + plot.width, y), color, 0.8)
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


_LABEL: Final = 11.0


def draw_gauges(canvas: Canvas, place: Box, platform: Platform, motion: MotionView) -> None:
    """Draw what the machine has, from left to right."""
    canvas.rectangle(place.x, place.y, place.width, place.height, theme.CARD, 6.0)
    third = place.width / 3.0
    square = min(third - 24.0, place.height - 56.0)
    middle = place.y + 30.0 + 0.5 * square
    cells = [place.x + third * (k + 0.5) for k in range(3)]
    for x, label in zip(cells, ("Carriage", "Turntable", "Legs"), strict=True):
        canvas.text(x, place.y + 15.0, label, 12.0, anchor="center")
    below = place.y + place.height - 13.0
    _carriage(canvas, cells[0], middle, square, below, platform, motion)
    _turntable(canvas, cells[1], middle, 0.5 * square, below, platform, motion)
    _legs(
        canvas, Box(cells[2] - 0.5 * square, middle - 0.5 * square, square, square), below, platform, motion
    )


def _carriage(
    canvas: Canvas, x: float, y: float, square: float, below: float, platform: Platform, motion: MotionView
) -> None:
    """Travel in plan: ahead is up, right is right."""
    carriage = platform.carriage
    if carriage is None:
        canvas.text(x, y, "none", _LABEL, theme.FAINT_TEXT, "center")
        return
    low = np.array([carriage.travel_x[0], carriage.travel_y[0]])
    high = np.array([carriage.travel_x[1], carriage.travel_y[1]])
    scale = (square - 4.0) / float(max(*(high - low), 1e-9))
    center = 0.5 * (low + high)
    tall, wide = scale * (high - low)
    edge = Box(x - 0.5 * wide, y - 0.5 * tall, wide, tall)
    canvas.rectangle(edge.x - 2.0, edge.y - 2.0, wide + 4.0, tall + 4.0, theme.TRAVEL, 3.0)
    canvas.rectangle(edge.x - 1.0, edge.y - 1.0, wide + 2.0, tall + 2.0, theme.PANEL, 2.0)
    canvas.line((x, edge.y), (x, edge.y + tall), theme.LINE, 0.8)
    canvas.line((edge.x, y), (edge.x + wide, y), theme.LINE, 0.8)
    ahead, right = scale * (motion.carriage - center)
    limit = np.where(motion.carriage >= 0.0, high, low)
    use = float(np.max(np.divide(motion.carriage, limit, out=np.zeros(2), where=limit != 0.0)))
    canvas.circle(x + right, y - ahead, 5.0, theme.color_of_use(use))
    words = f"x {signed(motion.carriage[0], 1)}  y {signed(motion.carriage[1], 1)} m"
    canvas.text(x, below, words, _LABEL, theme.FAINT_TEXT, "center")


def _turntable(
    canvas: Canvas, x: float, y: float, radius: float, below: float, platform: Platform, motion: MotionView
) -> None:
    """The heading in plan: ahead is up, positive to the right."""
    turntable = platform.turntable
    if turntable is None:
        canvas.text(x, y, "none", _LABEL, theme.FAINT_TEXT, "center")
        return
    canvas.circle(x, y, radius, theme.LINE)
    canvas.circle(x, y, radius - 1.4, theme.PANEL)

    def ray(angle: float, inner: float, outer: float, color: theme.Color, width: float) -> None:
        s, c = np.sin(angle), -np.cos(angle)
        canvas.line((x + inner * s, y + inner * c), (x + outer * s, y + outer * c), color, width)

    for angle in np.arange(0.0, 2.0 * np.pi, np.pi / 6.0):
        ray(angle, radius - 6.0, radius - 2.0, theme.LINE, 1.0)
    stops = turntable.travel or (-np.inf, np.inf)
    for stop in (stop for stop in stops if abs(stop) < np.pi):
        ray(stop, 0.6 * radius, radius, theme.TRAVEL, 2.0)
    s, c = np.sin(motion.turntable), np.cos(motion.turntable)
    needle = radius * np.array([[0.0, -0.82], [0.17, 0.30], [0.0, 0.16], [-0.17, 0.30]])
    use = motion.turntable / (stops[1] if motion.turntable > 0.0 else stops[0])
    canvas.polygon((x, y) + needle @ np.array([[c, s], [-s, c]]), theme.color_of_use(use))
    canvas.text(x, below, f"{signed(np.degrees(motion.turntable), 0)}°", _LABEL, theme.FAINT_TEXT, "center")


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
        canvas.rectangle(x, middle - (length if u > 0.0 else 0.0), wide, length, theme.color_of_use(float(u)))
    canvas.line((place.x, middle), (place.x + place.width, middle), theme.FAINT_TEXT, 0.8)
    most = motion.legs[int(np.argmax(np.abs(motion.legs)))]
    canvas.text(
        place.x + 0.5 * place.width, below, f"{signed(most, 2)} m", _LABEL, theme.FAINT_TEXT, "center"
    )


def signed(value: float, digits: int) -> str:
    """A number with its sign; what rounds to zero never flickers between +0 and −0."""
    return f"{round(float(value), digits) + 0.0:+.{digits}f}".replace("-", "−")


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
    for words, color in (("car", theme.REFERENCE), ("simulator", theme.SIMULATOR)):
        canvas.line((x, place.y + 67.0), (x + 20.0, place.y + 67.0), color, 2.6)
        canvas.text(x + 27.0, place.y + 67.0, words, 12.0)
        x += 27.0 + canvas.text_width(words, 12.0) + 22.0
    canvas.text(right - 2.0, place.y + 67.0, f"last {cues.window:.0f} s", 12.0, theme.FAINT_TEXT, "right")


def shortened(name: str) -> str:
    """A name that fits the header."""
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
