"""The adaptive washout as a policy."""

from __future__ import annotations

from typing import Any, Final

from ...envs.platform.machines import Cab
from ...envs.precision import vec3
from ..washout.classical import kernel_parameters
from ..washout.family import Family, make_family
from ..washout.policy import WashoutPolicy
from .parameters import AdaptiveParameters, load_adaptive
from .step import AdaptiveKernelParameters, AdaptiveMemory, adaptive_washout, initial_adaptive_memory


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
