"""Parameters of the adaptive washout: those of the classical one, and of what adapts its gains."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final, Literal

from ....envs.arrays import vec3
from ....envs.errors import ConfigurationError
from ....envs.platform.machines import Cab
from ....envs.settings import NonNegative, Positive, Vector2, configuration
from ...presets import load_preset, preset_names
from .. import WashoutParameters
from ..policy import Family, WashoutPolicy, kernel_parameters, make_family
from .kernels import AdaptiveKernelParameters, AdaptiveMemory, adaptive_washout, initial_adaptive_memory

Speeds = tuple[NonNegative, NonNegative, NonNegative]
Scales = tuple[Positive, Positive, Positive]


@configuration
class Adaptation:
    """The cost whose steepest descent moves the gains, and how fast it does.

    Each term of the cost is the square of a quantity over the size at which it counts 1. A gain p moves with
    dp/dt = -speed dC/dp, C being half the sum of the terms that it has a part in.

    Args:
        force: Error of what the translations must add, m/s^2; the default is J's indifference zone.
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
        algorithm: Tells files of the families apart.
        adaptation: Of the gains that multiply what HPS lets pass, and the Euler rates before HPR.
    """

    algorithm: Literal["adaptive"] = "adaptive"
    adaptation: Adaptation = Adaptation()


_PRESETS: Final = Path(__file__).parent / "presets"


def adaptive_presets() -> list[str]:
    """Names of the shipped parameter sets."""
    return preset_names(_PRESETS)


def load_adaptive(name: str | Path) -> AdaptiveParameters:
    """A parameter set by preset name, or from a YAML file.

    Raises:
        UnknownNameError: no preset has this name.
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    return load_preset(AdaptiveParameters, "adaptive washout preset", name, _PRESETS)


# The adaptive washout as a policy.


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


ADAPTIVE: Final[Family] = make_family(
    AdaptiveKernelParameters, AdaptiveMemory, initial_adaptive_memory, adaptive_washout, _values
)
"""The classical algorithm with adapted gains."""


class AdaptiveWashout(WashoutPolicy[AdaptiveParameters]):
    """The adaptive washout as a policy, gains and all; arguments as of :class:`WashoutPolicy`."""

    family = ADAPTIVE
    kind = AdaptiveParameters
    load = staticmethod(load_adaptive)
    by_hand = "adaptive"
