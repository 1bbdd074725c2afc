"""Washouts: filters that reproduce onsets, tilt for sustained force, and return to neutral."""

from ..registry import register_presets
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
from .families import FAMILIES, Coordinate, Family, load_parameters
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


def register_family(name: str, family: Family, description: str = "") -> None:
    """Add a washout family; its presets become policies by name.

    Args:
        name: ``Family.name``.
        family: The family.
        description: One line for lists.
    """
    FAMILIES.register(name, family, description)
    register_presets(family.presets)
