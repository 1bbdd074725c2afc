"""The adaptive washout: parameters, ranges of a search, and the family itself.

It is the classical washout with gains that a steepest descent adapts during the drive, see :mod:`.kernels`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final, Literal

from ....envs.arrays import vec3
from ....envs.errors import ConfigurationError
from ....envs.platform.machines import Cab
from ....envs.settings import NonNegative, Positive, Vector2, configuration
from ..classical.family import (
    CARRIAGE_SPEED,
    COORDINATES,
    HEAVE_TRAVEL,
    TRAVEL,
    WashoutParameters,
    kernel_parameters,
)
from ..families import Coordinate, Family, coordinates
from ..kernels.launch import make_kernels
from ..policy import WashoutPolicy
from .kernels import AdaptiveKernelParameters, AdaptiveMemory, adaptive_washout, initial_adaptive_memory

Speeds = tuple[NonNegative, NonNegative, NonNegative]
Scales = tuple[Positive, Positive, Positive]


@configuration
class Adaptation:
    """Cost and speed of the steepest descent that adapts the gains.

    Each term of the cost is the square of a quantity over the size at which it counts 1. A gain p moves with
    dp/dt = -speed dC/dp. C is half the sum of the terms that the gain has a part in.

    Args:
        force: Error of the translational acceleration, m/s^2; the default is J's indifference zone.
        rate: Error of the Euler rates, rad/s; the default is J's indifference zone.
        displacement: Displacement of the cab by the translations, horizontal and vertical, m.
        velocity: Its velocity, horizontal and vertical, m/s.
        angle: High-passed roll, pitch and yaw, rad.
        force_departure: Departure of a translational gain from 1.
        rate_departure: Departure of a rotational gain from 1.
        force_speed: Of the gains on forward, sideways and vertical acceleration, 1/s; 0 keeps a gain at 1.
        rate_speed: Of the gains on roll, pitch and yaw rate, 1/s.
        gain_limits: Least and greatest gain.
    """

    force: Positive = 0.6
    rate: Positive = math.radians(3.0)
    displacement: tuple[Positive, Positive] = (5.0, 0.2)
    velocity: tuple[Positive, Positive] = (3.0, 0.3)
    angle: Scales = (0.2, 0.2, 100.0)
    force_departure: Positive = 0.3
    rate_departure: Positive = 0.3
    force_speed: Speeds = (0.05, 0.05, 0.05)
    rate_speed: Speeds = (0.05, 0.05, 0.05)
    gain_limits: Vector2 = (0.0, 1.5)

    def __post_init__(self) -> None:
        low, high = self.gain_limits
        if not low <= 1.0 <= high:
            raise ConfigurationError(f"gain_limits must hold 1, where the gains begin, found {low} to {high}")


@configuration
class AdaptiveParameters(WashoutParameters):
    """The whole algorithm: every field of :class:`~..washout.WashoutParameters`, and two more.

    Args:
        algorithm: Family, as parameter files name it.
        adaptation: Adaptation of the gains on the output of HPS and on the Euler rates before HPR.
    """

    algorithm: Literal["adaptive"] = "adaptive"
    adaptation: Adaptation = Adaptation()


def _values(p: AdaptiveParameters, cab: Cab, dt: float) -> Any:
    """The kernels' form of a parameter set."""
    k: Any = AdaptiveKernelParameters()
    k.washout = kernel_parameters(p, cab)
    a = p.adaptation
    for name in ("force", "rate", "force_departure", "rate_departure"):
        setattr(k, name, getattr(a, name) ** -2)
    for name in ("displacement", "velocity"):
        horizontal, vertical = (scale**-2 for scale in getattr(a, name))
        setattr(k, name, vec3(horizontal, horizontal, vertical))
    k.angle = vec3(*(scale**-2 for scale in a.angle))
    k.force_speed, k.rate_speed = vec3(*a.force_speed), vec3(*a.rate_speed)
    k.gain_min, k.gain_max = a.gain_limits
    return k


_SPEED: Final = (0.001, 10.0)
"""1/s; from a gain that hardly moves in a drive to one that follows every cue."""
_DEPARTURE: Final = (0.003, 30.0)
_ANGLE: Final = (0.02, 100.0)
"""rad; the turntable has no end."""

_COORDINATES: Final = (
    *COORDINATES,
    *coordinates("adaptation.force_speed.{}", 3, _SPEED),
    *coordinates("adaptation.rate_speed.{}", 3, _SPEED),
    Coordinate("adaptation.force_departure", *_DEPARTURE),
    Coordinate("adaptation.rate_departure", *_DEPARTURE),
    Coordinate("adaptation.displacement.0", *TRAVEL),
    Coordinate("adaptation.displacement.1", *HEAVE_TRAVEL),
    Coordinate("adaptation.velocity.0", *CARRIAGE_SPEED),
    Coordinate("adaptation.velocity.1", *HEAVE_TRAVEL),
    *coordinates("adaptation.angle.{}", 3, _ANGLE),
)

FAMILY: Final = Family(
    name="adaptive",
    title="the adaptive washout",
    parameters=AdaptiveParameters,
    kernels=make_kernels(
        AdaptiveKernelParameters, AdaptiveMemory, initial_adaptive_memory, adaptive_washout, _values
    ),
    presets=Path(__file__).parent / "presets",
    start="adaptive",
    coordinates=_COORDINATES,
)


class AdaptiveWashout(WashoutPolicy[AdaptiveParameters]):
    """The adaptive washout as a policy; arguments as of :class:`~..policy.WashoutPolicy`."""

    algorithm = "adaptive"
