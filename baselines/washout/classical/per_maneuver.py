"""An oracle: the classical washout with the best parameter set for each standard maneuver.

It is no controller for an unknown drive: it has to know which maneuver it drives, and was tuned on that one.
It shows how far the structure of the classical washout reaches.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from ....envs.cues import CueTrace
from ....envs.errors import UnknownNameError
from ....envs.platform.machines import Platform
from ....envs.settings import configuration
from ....envs.simulator.simulator import TIME_STEP
from ...policy import WHOLE_DRIVE, Policy
from ...presets import preset_names
from .family import ClassicalWashout, WashoutParameters, load_washout

PER_MANEUVER: Final = "classical-per-maneuver"
_SETS: Final = Path(__file__).parent / "presets" / "per-maneuver"


@configuration
class PerManeuverParameters:
    """Parameter sets by maneuver.

    Args:
        sets: Parameter set of each maneuver.
    """

    sets: dict[str, WashoutParameters]


def tuned_maneuvers() -> list[str]:
    """Names of the maneuvers that have a parameter set."""
    return preset_names(_SETS)


def load_per_maneuver(maneuver: str) -> WashoutParameters:
    """The best parameter set for a maneuver.

    Raises:
        UnknownNameError: there is none.
    """
    if maneuver not in tuned_maneuvers():
        raise UnknownNameError(f"maneuver of {PER_MANEUVER}", maneuver, tuned_maneuvers())
    return load_washout(_SETS / f"{maneuver}.yaml")


class PerManeuverWashout(Policy):
    """The classical washout with the best parameter set for the maneuver at hand.

    Without a turntable it yaws the cab with the hexapod (k_T = 0), as the paper's EST3: the sets are tuned on
    a machine with one.

    Args:
        platform: The machine.
        dt: Time step, s.
    """

    name = PER_MANEUVER
    information = WHOLE_DRIVE

    def __init__(self, platform: Platform, dt: float = TIME_STEP) -> None:
        self.platform: Platform = platform
        self.time_step: float = dt
        sets = {name: load_per_maneuver(name) for name in tuned_maneuvers()}
        if platform.turntable is None:
            sets = {name: replace(tuned, turntable_share=0.0) for name, tuned in sets.items()}
        self.parameters: PerManeuverParameters = PerManeuverParameters(sets)

    def for_drive(self, cues: CueTrace) -> Policy:
        """The washout for a maneuver, by the name of its cues.

        Raises:
            UnknownNameError: no set has been tuned for it.
        """
        sets = self.parameters.sets
        if cues.name not in sets:
            raise UnknownNameError(f"maneuver of {PER_MANEUVER}", cues.name, sets)
        return ClassicalWashout(replace(sets[cues.name], name=self.name), self.platform.cab, self.time_step)
