"""The classical washout's ceiling: for each standard maneuver the set that is best for it alone.

No controller that has to take what comes: it is told which maneuver it is, and has been tuned on it. It says
how far the structure of the classical washout reaches.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from ..envs.cues import CueTrace
from ..envs.errors import UnknownNameError
from ..envs.platform.machines import Platform
from ..envs.settings import configuration
from ..envs.simulator import TIME_STEP
from .washout import ClassicalWashout, WashoutParameters, load_washout

_SETS: Final = Path(__file__).parent / "washout" / "presets" / "ceiling"


@configuration
class CeilingParameters:
    """The sets.

    Args:
        sets: By maneuver.
    """

    sets: dict[str, WashoutParameters]


def ceiling_maneuvers() -> list[str]:
    """Names of the maneuvers there are sets for."""
    return sorted(path.stem for path in _SETS.glob("*.yaml"))


def load_ceiling(maneuver: str) -> WashoutParameters:
    """The best set for a maneuver.

    Raises:
        UnknownNameError: there is none.
    """
    if maneuver not in ceiling_maneuvers():
        raise UnknownNameError("maneuver of classical-ceiling", maneuver, ceiling_maneuvers())
    return load_washout(_SETS / f"{maneuver}.yaml")


class CeilingWashout:
    """The classical washout with the best set for the maneuver at hand.

    Without a turntable it yaws the cab with the hexapod (k_T = 0), as the paper's EST3: the sets are tuned on
    a machine with one.

    Args:
        platform: The machine.
        dt: Time step, s.
    """

    name = "classical-ceiling"

    def __init__(self, platform: Platform, dt: float = TIME_STEP) -> None:
        self.platform, self.dt = platform, dt
        sets = {name: load_ceiling(name) for name in ceiling_maneuvers()}
        if platform.turntable is None:
            sets = {name: replace(found, turntable_share=0.0) for name, found in sets.items()}
        self.parameters = CeilingParameters(sets)

    def for_drive(self, cues: CueTrace) -> ClassicalWashout:
        """The washout for a maneuver, found by the name of its cues.

        Raises:
            UnknownNameError: no set has been tuned for it.
        """
        sets = self.parameters.sets
        if cues.name not in sets:
            raise UnknownNameError("maneuver of classical-ceiling", cues.name, sets)
        return ClassicalWashout(replace(sets[cues.name], name=self.name), self.platform.cab, self.dt)
