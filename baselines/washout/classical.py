"""The classical washout's parameters as its kernels hold them."""

from __future__ import annotations

from typing import Any, Final

from ...envs.platform.machines import Cab
from ...envs.precision import vec3
from .family import Family, make_family
from .filters import HighPassParameters
from .following import initial_memory
from .parameters import HighPass, LowPass, TiltCoordination, WashoutParameters
from .step import washout
from .structs import Memory, Parameters


def _high_pass(block: HighPass) -> Any:
    values: Any = HighPassParameters()
    values.order, values.frequency, values.damping = block.order, block.frequency, block.damping
    return values


def kernel_parameters(p: WashoutParameters, cab: Cab) -> Any:
    """The kernels' form of a parameter set for a cab."""
    k: Any = Parameters()
    for name in ("force_scale", "force_limit", "rate_scale", "rate_limit"):
        setattr(k, name, vec3(*getattr(p, name)))
    blocks = {"hpr_roll": p.hpr[0], "hpr_pitch": p.hpr[1], "hpr_yaw": p.hpr[2], "hps_x": p.hps[0]}
    blocks |= {"hps_y": p.hps[1], "hpi_x": p.hpi[0], "hpi_y": p.hpi[1], "hpi_z": p.hpi[2]}
    for name, block in blocks.items():
        setattr(k, name, _high_pass(block))
    tilt = p.tilt or TiltCoordination()
    k.tilt_gain = 1.0 if p.tilt else 0.0
    k.tilt_frequency, k.tilt_damping = tilt.low_pass.frequency, tilt.low_pass.damping
    k.tilt_rate, k.tilt_acceleration, k.tilt_approach = tilt.rate, tilt.acceleration, tilt.approach
    lpc = p.lpc or LowPass(1.0)
    k.carriage_share = 1.0 if p.lpc else 0.0
    k.lpc_frequency, k.lpc_damping = lpc.frequency, lpc.damping
    for name in (
        "rate_bandwidth",
        "turntable_share",
        "turntable_gain",
        "follow_frequency",
        "return_frequency",
    ):
        setattr(k, name, getattr(p, name))
    k.cab = vec3(*cab.reference_point)
    return k


def _values(p: WashoutParameters, cab: Cab, dt: float) -> Any:
    return kernel_parameters(p, cab)


CLASSICAL: Final[Family] = make_family(Parameters, Memory, initial_memory, washout, _values)
"""The paper's algorithm."""
