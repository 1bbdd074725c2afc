"""Racing circuits: closed laps of straights and bends, drawn at random."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..car.plans import STEP, Floats, bend

CORNERS: Final = (7, 14)
"""Of a circuit."""

SIZE: Final = (180.0, 420.0)
"""Mean distance of the corners from the middle, m."""

SLIGHTEST: Final = 0.08
"""Smallest change of direction in a corner, rad."""

SHARPEST: Final = 2.4
"""Largest change of direction in a corner, rad."""

RADII: Final = (14.0, 140.0)
"""Of corners before they are fitted between their neighbors, m."""

TRANSITION: Final = 12.0
"""Length of the clothoids, m; shorter where a corner has no room."""

KERB: Final = (0.02, 0.05)
"""Height of the curbs, m."""


@dataclass(frozen=True, eq=False)
class Circuit:
    """One lap, a point every :data:`~..car.plans.STEP` meters.

    Args:
        curvature: (n,) 1/m.
        bank: (n,) rad, right side down positive: to the inside of bends.
        kerbs: First and last point of each curb that the inner wheels run over, its side (1: right) and its
            height, m.
    """

    curvature: Floats
    bank: Floats
    kerbs: tuple[tuple[int, int, int, float], ...]


def random_circuit(rng: np.random.Generator, bank: float) -> Circuit:
    """A closed circuit: a polygon about a middle, whose corners are rounded.

    Args:
        rng: Source of chance.
        bank: Largest cross slope of a corner, rad.
    """
    while True:
        edges, turns = _polygon(rng)
        if np.abs(turns).min() > SLIGHTEST and np.abs(turns).max() < SHARPEST:
            corners = _fitted(rng, edges, turns)
            if corners is not None:
                return _lap(rng, edges, corners, bank)


def _polygon(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Lengths of the edges after each corner, m, and changes of direction at the corners, rad."""
    n = int(rng.integers(CORNERS[0], CORNERS[1] + 1))
    angles = 2.0 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    radius = rng.uniform(*SIZE) * rng.uniform(0.55, 1.35, n)
    x, y = radius * np.cos(angles), radius * np.sin(angles)
    if rng.random() < 0.5:
        x, y = x[::-1], y[::-1]
    dx, dy = np.diff(x, append=x[0]), np.diff(y, append=y[0])
    heading = np.arctan2(dy, dx)
    turns = heading - np.roll(heading, 1)
    return np.hypot(dx, dy), (turns + np.pi) % (2.0 * np.pi) - np.pi


def _fitted(rng: np.random.Generator, edges: Floats, turns: Floats) -> list[tuple[Floats, float]] | None:
    """Curvature of each corner and its tangent's length, m; None where one has no room."""
    corners = []
    for k, turn in enumerate(turns):
        room = 0.46 * min(edges[k - 1], edges[k])
        radius, transition = float(np.exp(rng.uniform(*np.log(RADII)))), TRANSITION
        while True:
            curvature = bend(float(np.sign(turn)) / radius, turn, min(transition, radius * abs(turn)))
            tangent = tangent_of(curvature)
            if tangent <= room:
                break
            radius, transition = 0.85 * radius, max(0.9 * transition, 5.0)
            if radius < 8.0:
                return None
        corners.append((curvature, tangent))
    return corners


def tangent_of(curvature: Floats) -> float:
    """From the beginning of a symmetric bend to where its tangents meet, m."""
    heading = np.concatenate(([0.0], np.cumsum(STEP * curvature)))
    middle = 0.5 * (heading[1:] + heading[:-1])
    return float(STEP * np.abs(np.sin(middle).sum() / np.sin(heading[-1])))


def _lap(
    rng: np.random.Generator, edges: Floats, corners: list[tuple[Floats, float]], bank: float
) -> Circuit:
    """Straight and corner in turn, from the end of the last corner."""
    pieces, leaning, kerbs, points, owed = [], [], [], 0, 0.0
    for k, (curvature, tangent) in enumerate(corners):
        # Rounding to whole steps is made up for on the next straight.
        exact = (edges[k - 1] - corners[k - 1][1] - tangent) / STEP + owed
        straight = max(round(exact), 1)
        owed = exact - straight
        top = np.abs(curvature).max()
        for piece, cross in (
            (np.zeros(straight), np.zeros(straight)),
            (curvature, rng.uniform(0.0, bank) * curvature / top),
        ):
            pieces.append(piece)
            leaning.append(cross)
        points += straight
        if rng.random() < 0.7:
            length = round(min(rng.uniform(4.0, 14.0) / STEP, 0.6 * len(curvature)))
            first = points + (len(curvature) - length) // 2
            side = int(np.sign(curvature[len(curvature) // 2]))
            kerbs.append((first, first + length, side, float(rng.uniform(*KERB))))
        points += len(curvature)
    smooth = uniform_filter1d(uniform_filter1d(np.concatenate(leaning), 31, mode="wrap"), 31, mode="wrap")
    return Circuit(np.concatenate(pieces), np.asarray(smooth), tuple(kerbs))
