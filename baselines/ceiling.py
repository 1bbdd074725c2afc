"""The classical washout's ceiling: for each standard maneuver the set that is best for it alone.

No controller that has to take what comes: it is told which maneuver it is, and has been tuned on it. It says
how far the structure of the classical washout reaches.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ..envs.cues import CueTrace
from ..envs.errors import UnknownNameError
from ..envs.platform.machines import Platform
from ..envs.simulator import TIME_STEP
from .washout import ClassicalWashout, WashoutParameters, load_washout

_SETS: Final = Path(__file__).parent / "washout" / "presets" / "ceiling"


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

    Args:
        platform: The machine.
        dt: Time step, s.
    """

    name = "classical-ceiling"

    def __init__(self, platform: Platform, dt: float = TIME_STEP) -> None:
        self.platform, self.dt = platform, dt

    def for_drive(self, cues: CueTrace) -> ClassicalWashout:
        """The washout for a maneuver, found by the name of its cues.

        Raises:
            UnknownNameError: no set has been tuned for it.
        """
        washout = ClassicalWashout(load_ceiling(cues.name), self.platform.cab, self.dt)
        washout.name = self.name
        return washout
