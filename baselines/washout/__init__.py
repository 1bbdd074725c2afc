"""Washouts: filters that reproduce onsets, tilt for sustained force, and return to neutral."""

from .classical import (
    ClassicalWashout,
    HighPass,
    LowPass,
    PerManeuverWashout,
    ScheduledWashout,
    TiltCoordination,
    WashoutParameters,
    load_washout,
    washout_presets,
)
from .families import FAMILIES, Coordinate, Family, load_parameters, register_family
from .policy import WashoutPolicy, make_washout

__all__ = [
    "FAMILIES",
    "ClassicalWashout",
    "Coordinate",
    "Family",
    "HighPass",
    "LowPass",
    "PerManeuverWashout",
    "ScheduledWashout",
    "TiltCoordination",
    "WashoutParameters",
    "WashoutPolicy",
    "load_parameters",
    "load_washout",
    "make_washout",
    "register_family",
    "washout_presets",
]
