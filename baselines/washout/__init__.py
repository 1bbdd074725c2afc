"""The paper's classical washout."""

from .parameters import HighPass, LowPass, TiltCoordination, WashoutParameters, load_washout, washout_presets
from .policy import ClassicalWashout

__all__ = [
    "ClassicalWashout",
    "HighPass",
    "LowPass",
    "TiltCoordination",
    "WashoutParameters",
    "load_washout",
    "washout_presets",
]
