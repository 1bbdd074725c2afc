"""Model predictive control of the nine axes, linear and nonlinear."""

from .parameters import (
    AxisWeights,
    Forecast,
    Margins,
    MpcParameters,
    NmpcParameters,
    TiltRate,
    Weights,
    load_mpc,
    mpc_presets,
)
from .policy import make_mpc, make_nmpc

__all__ = [
    "AxisWeights",
    "Forecast",
    "Margins",
    "MpcParameters",
    "NmpcParameters",
    "TiltRate",
    "Weights",
    "load_mpc",
    "make_mpc",
    "make_nmpc",
    "mpc_presets",
]
