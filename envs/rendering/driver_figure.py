"""The driver, drawn around the point where the machine's parameters put the head."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh, cylinder, joined, sphere
from .theme import DARK_STEEL, SHIRT, SKIN

HEAD_RADIUS: Final = 0.115
"""m."""


def driver_figure(head: NDArray[np.float64]) -> Mesh:
    """A sitting driver in the cab's frame.

    Args:
        head: (3,) middle of the head, m.
    """
    neck, hips = head + np.array([-0.02, 0.0, 0.12]), head + np.array([-0.10, 0.0, 0.62])
    return joined(
        cylinder(hips, neck + np.array([-0.03, 0.0, 0.06]), 0.17, SHIRT, sides=12),
        *(_leg(hips, side) for side in (-1.0, 1.0)),
        *(_arm(head, side) for side in (-1.0, 1.0)),
        cylinder(neck + np.array([0.0, 0.0, 0.04]), neck - np.array([0.0, 0.0, 0.06]), 0.055, SKIN, sides=8),
        sphere(HEAD_RADIUS, SKIN, sides=14, gloss=0.1).moved(head),
    )


def _leg(hips: NDArray[np.float64], side: float) -> Mesh:
    knee = hips + np.array([0.48, side * 0.13, -0.10])
    foot = hips + np.array([0.88, side * 0.12, 0.16])
    return joined(
        cylinder(hips + np.array([0.0, side * 0.09, 0.0]), knee, 0.08, DARK_STEEL, sides=8),
        cylinder(knee, foot, 0.06, DARK_STEEL, sides=8),
    )


def _arm(head: NDArray[np.float64], side: float) -> Mesh:
    shoulder, elbow = head + np.array([-0.05, side * 0.19, 0.24]), head + np.array([0.18, side * 0.26, 0.46])
    hand = head + np.array([0.50, side * 0.15, 0.34])
    return joined(
        cylinder(shoulder, elbow, 0.05, SHIRT, sides=8),
        cylinder(elbow, hand, 0.042, SHIRT, sides=8),
        sphere(0.05, SKIN, sides=8).moved(hand),
    )
