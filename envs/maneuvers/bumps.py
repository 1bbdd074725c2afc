"""Single events of a road's surface: potholes, seams, humps, and the curbs of a circuit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ..car.plans import STEP, Floats
from ..car.simulation import SPACING, RoadRoughness
from .roads import Road

CALM: Final = 60.0
"""Way without events at the start, m."""


@dataclass(frozen=True)
class BumpKind:
    """A kind of event; ranges are drawn from uniformly (engineering choices).

    Args:
        height: Of its middle, m; negative for a hole.
        length: Along the road, m.
        tracks: 2 if both wheel tracks run over it, 1 if one does.
        weight: Relative frequency.
    """

    height: tuple[float, float]
    length: tuple[float, float]
    tracks: int
    weight: float


BUMPS: Final = (
    BumpKind((-0.07, -0.02), (0.5, 1.5), 1, 4.0),  # pothole
    BumpKind((-0.03, 0.03), (0.4, 1.0), 2, 4.0),  # seam, bridge joint, repair
    BumpKind((0.02, 0.05), (2.0, 5.0), 2, 2.0),  # hump
    BumpKind((-0.05, 0.05), (6.0, 20.0), 2, 2.0),  # settlement
)


def with_bumps(tracks: RoadRoughness, often: float, rng: np.random.Generator) -> RoadRoughness:
    """The same tracks with ``often`` events per kilometer, each a wave 1 - cos."""
    left, right = tracks.left.copy(), tracks.right.copy()
    length = SPACING * (len(left) - 1)
    weights = np.array([kind.weight for kind in BUMPS])
    for _ in range(int(rng.poisson(1e-3 * often * max(length - CALM, 0.0)))):
        kind = BUMPS[int(rng.choice(len(BUMPS), p=weights / weights.sum()))]
        start, height = rng.uniform(CALM, length), rng.uniform(*kind.height)
        shape = _hump(rng.uniform(*kind.length))
        both = (left, right) if kind.tracks == 2 else ((left, right)[int(rng.integers(2))],)
        for track in both:
            _add(track, start, height * shape)
    return replace(tracks, left=left, right=right)


RIB: Final = 1.2
"""Length of a rib of a curb, m."""


def with_kerbs(tracks: RoadRoughness, road: Road) -> RoadRoughness:
    """The same tracks where the inner wheels run over the curbs of a circuit, ribbed along their length."""
    if road.circuit is None:
        return tracks
    left, right = tracks.left.copy(), tracks.right.copy()
    for lap in road.laps:
        for first, last, side, height in road.circuit.kerbs:
            stations = SPACING * np.arange(round(STEP * (last - first) / SPACING))
            flat = np.clip(np.minimum(stations, stations[-1] - stations) / RIB, 0.0, 1.0)
            shape = flat * (0.7 + 0.3 * np.cos(2.0 * np.pi * stations / RIB))
            _add(right if side > 0 else left, STEP * (lap + first), height * shape)
    return replace(tracks, left=left, right=right)


def _hump(length: float) -> Floats:
    """A wave 1 - cos of unit height, every :data:`~..car.simulation.SPACING`."""
    points = max(round(length / SPACING), 2)
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(points + 1) / points)


def _add(track: Floats, start: float, shape: Floats) -> None:
    """Add a shape to a track from a station on, m, as far as the track goes."""
    first = round(start / SPACING)
    there = max(min(len(shape), len(track) - first), 0)
    track[first : first + there] += shape[:there]
