"""The paper's classical washout, an oracle of it with one set a maneuver, and its gain-scheduled form."""

from .family import (
    ClassicalWashout,
    HighPass,
    LowPass,
    TiltCoordination,
    WashoutParameters,
    load_washout,
    washout_presets,
)
from .policies import (
    PerManeuverParameters,
    PerManeuverWashout,
    ScheduledWashout,
    load_per_maneuver,
    tuned_maneuvers,
)

__all__ = [
    "ClassicalWashout",
    "HighPass",
    "LowPass",
    "PerManeuverParameters",
    "PerManeuverWashout",
    "ScheduledWashout",
    "TiltCoordination",
    "WashoutParameters",
    "load_per_maneuver",
    "load_washout",
    "tuned_maneuvers",
    "washout_presets",
]
