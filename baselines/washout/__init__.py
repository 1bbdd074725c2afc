"""Washouts: the paper's classical washout, and what all washouts share."""

from .parameters import HighPass, LowPass, TiltCoordination, WashoutParameters, load_washout, washout_presets
from .policy import ClassicalWashout
from .scheduled import ScheduledWashout

__all__ = [
    "ClassicalWashout",
    "HighPass",
    "LowPass",
    "ScheduledWashout",
    "TiltCoordination",
    "WashoutParameters",
    "load_washout",
    "washout_presets",
]
