"""Road roughness: the cues that two rough wheel tracks add to those of the smooth road.

Each track is Gaussian with the spectrum of ISO 8608, G(n) = G(n0) (n / n0)^-2 with n0 = 0.1 1/m. The body
heaves, pitches and rolls on its springs by what is between the wheels; the motion is small, so that sums are
enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter, ss2tf

from ..cues import GRAVITY
from .vehicles import Car

Floats = NDArray[np.float64]

SPACING: Final = 0.1
"""Between the points of a track, m: what a tire levels out."""

_REFERENCE: Final = 0.1
"""n0, 1/m."""

_LONGEST: Final = 0.01
"""Spatial frequency below which a track is level on the whole, 1/m; slopes are the path's."""

_TRACK: Final = 0.85
"""Distance of the wheels of an axle over the car's width (engineering choice)."""

_HEAVE: Final = (2.0 * np.pi * 1.3, 0.3)
"""Natural frequency of heave, rad/s, and its damping ratio (engineering choice, of the usual size)."""


@dataclass(frozen=True, eq=False)
class RoadRoughness:
    """Heights of the road under the wheels, m, positive upwards, every :data:`SPACING` of the way.

    Args:
        left: (n,) of the left track.
        right: (n,) of the right one.
    """

    left: Floats
    right: Floats

    @classmethod
    def drawn(cls, roughness: float, length: float, rng: np.random.Generator) -> RoadRoughness:
        """Tracks of a roughness G(n0), m^3, over a length, m.

        Half of the spectrum is common to both, half is each track's own where waves are shorter than a car is
        wide, and less where they are longer: a road that leans a little, not a twisted one.
        """
        points = int(np.ceil(length / SPACING)) + 1
        common = _brownian(0.5 * roughness, _LONGEST, points, rng)
        own = _brownian(0.5 * roughness, _REFERENCE, points, rng)
        return cls(common + own, common - own)

    def under(self, distance: Floats) -> tuple[Floats, Floats]:
        """Heights of the left and the right track at distances (n,), m; beyond its ends as there."""
        stations = SPACING * np.arange(len(self.left))
        return np.interp(distance, stations, self.left), np.interp(distance, stations, self.right)


def _brownian(roughness: float, corner: float, points: int, rng: np.random.Generator) -> Floats:
    """Heights with the spectrum of ISO 8608 above a corner, 1/m, and a level one below it."""
    decay = np.exp(-2.0 * np.pi * corner * SPACING)
    variance = 0.5 * np.pi * roughness * _REFERENCE**2 / corner
    drive = np.sqrt(variance * (1.0 - decay**2)) * rng.normal(size=points)
    start = np.sqrt(variance) * rng.normal()
    return np.asarray(lfilter([1.0], [1.0, -decay], drive, zi=[decay * start])[0])


@dataclass(frozen=True, eq=False)
class Shaking:
    """The cues that a rough road adds, (n, 3) each, as :class:`~..cues.CueTrace` has them."""

    force: Floats
    rate: Floats
    rate_derivative: Floats


def shaking(car: Car, road: RoadRoughness, distance: Floats, dt: float) -> Shaking:
    """What a road adds where the c.g. is at distances (n,), m, one a time step ``dt``, s.

    x forward, y right, z down; positive pitch lifts the nose, positive roll lowers the right side.
    """
    front_left, front_right = road.under(distance + car.front_axle)
    rear_left, rear_right = road.under(distance - car.rear_axle)
    front, rear = 0.5 * (front_left + front_right), 0.5 * (rear_left + rear_right)
    left, right = 0.5 * (front_left + rear_left), 0.5 * (front_right + rear_right)
    heave, pitch, roll = (
        0.5 * (front + rear),
        (front - rear) / car.wheelbase,
        (left - right) / (_TRACK * car.width),
    )

    body = car.suspension
    weight = body.sprung_mass * GRAVITY * body.arm
    _, _, up = _sprung(heave, *_HEAVE, dt)
    phi, p, p_dot = _sprung(
        roll, *_mode(body.roll_stiffness - weight, body.roll_damping, body.roll_inertia), dt
    )
    theta, q, q_dot = _sprung(
        pitch, *_mode(body.pitch_stiffness - weight, body.pitch_damping, body.pitch_inertia), dt
    )
    zero = np.zeros_like(distance)
    rate_derivative = np.column_stack((p_dot, q_dot, zero))
    # The body turns about the point of the roll axis under the c.g.; f = a - g.
    point = np.array(car.reference_point) - np.array([0.0, 0.0, body.arm])
    force = np.cross(rate_derivative, point)
    force += np.column_stack((GRAVITY * theta, -GRAVITY * phi, -up))
    return Shaking(force, np.column_stack((p, q, zero)), rate_derivative)


def _mode(stiffness: float, damping: float, inertia: float) -> tuple[float, float]:
    """Natural frequency, rad/s, and damping ratio."""
    frequency = float(np.sqrt(stiffness / inertia))
    return frequency, damping / (2.0 * inertia * frequency)


def _sprung(base: Floats, frequency: float, ratio: float, dt: float) -> tuple[Floats, Floats, Floats]:
    """A body's motion, its rate and acceleration on a spring whose other end moves as ``base`` (n,).

    y'' = w^2 (u - y) - 2 z w y', from rest, exact for a base that moves evenly between samples. The damper's
    other end stands still: what it would pass on of waves shorter than a car, recordings do not hold either.
    """
    a = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * ratio * frequency]])
    b = np.array([[0.0], [frequency**2]])
    c = np.vstack((np.eye(2), a[1]))
    d = np.array([[0.0], [0.0], [frequency**2]])
    numerators, denominator = ss2tf(*cont2discrete((a, b, c, d), dt, method="foh")[:4])
    offset = base - base[0]
    y, rate, acceleration = (lfilter(n, denominator, offset) for n in numerators)
    return y, rate, acceleration
