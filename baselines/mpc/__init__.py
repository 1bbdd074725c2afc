"""Model predictive control of the nine axes, linear or nonlinear, with or without preview of the drive.

The controllers need CasADi, and are imported when they are first used; their parameters need nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from .policy import PredictiveController, PreviewController, make_mpc

_CONTROLLERS = ("PredictiveController", "PreviewController", "make_mpc")

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


def __getattr__(name: str) -> Any:
    if name not in _CONTROLLERS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(".policy", __name__), name)
