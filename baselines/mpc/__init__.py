"""Model predictive control of the nine axes."""

from .named import load_mpc, mpc_presets
from .parameters import AxisWeights, Forecast, Margins, MpcParameters, TiltRate, Weights
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
