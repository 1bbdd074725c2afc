"""Model predictive control of the nine axes, linear or nonlinear, with or without preview of the drive."""

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
from .policy import PredictiveController, PreviewController, make_mpc

__all__ = [
    "AxisWeights",
    "Forecast",
    "Margins",
    "MpcParameters",
    "PredictiveController",
    "PreviewController",
    "TiltRate",
    "Weights",
    "load_mpc",
    "make_mpc",
    "mpc_presets",
]
