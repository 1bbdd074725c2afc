"""Model predictive control of the nine axes."""

from .parameters import (
    AxisWeights,
    Forecast,
    Margins,
    MpcParameters,
    TiltRate,
    Weights,
    load_mpc,
    mpc_presets,
)
from .policy import make_mpc

__all__ = [
    "AxisWeights",
    "Forecast",
    "Margins",
    "MpcParameters",
    "TiltRate",
    "Weights",
    "load_mpc",
    "make_mpc",
    "mpc_presets",
]
