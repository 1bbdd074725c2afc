"""What policies are put through: drives of all kinds in all cars, on machines of many actuators."""

from __future__ import annotations

from typing import Annotated, Any, Final

from pydantic import Field

from ...envs.car import RandomDrives, car_names
from ...envs.car.roads import KINDS
from ...envs.platform import Platform
from ...envs.settings import NonNegative, Positive, configuration
from ...envs.task import RandomisationOptions, TaskOptions
from ...envs.task.library import machines_of

NOMINAL: Final = "nominal"
"""Name of the condition with the machine as it should be."""
SLOWER: Final = "slower"
"""Name of the condition with machines whose actuators have a lag and a dead time."""

_EVENLY: Final[dict[str, Any]] = dict.fromkeys(KINDS, 1.0)
_EVERY_KIND: Final = RandomDrives(**_EVENLY, roughness=(0.0, 600.0), cars=tuple(car_names()))


@configuration
class Endurance:
    """Drives and machines; each drive is driven on the machine as it should be and on a slower one.

    Lag and dead time reach to those of ``motion-cueing robustness``, both at once; 30 to 90 rad/s are 5 to
    14 Hz, what motion bases are said to have (from memory).

    Args:
        drives: What drives are drawn from; default: every kind of road in every car, equally often,
            smooth to rough.
        duration: Of a drive, s.
        friction: Range of a factor on the tires' friction.
        natural_frequency: Range of the actuators' lag, rad/s, drawn for each subsystem of a machine.
        dead_time: Range of their dead time, s, drawn alike.
        machines: Slower machines that drives draw from.
    """

    drives: RandomDrives = _EVERY_KIND
    duration: Positive = 120.0
    friction: tuple[Positive, Positive] = (0.7, 1.0)
    natural_frequency: tuple[Positive, Positive] = (30.0, 90.0)
    dead_time: tuple[NonNegative, NonNegative] = (0.0, 0.05)
    machines: Annotated[int, Field(ge=1)] = 64

    def __post_init__(self) -> None:
        # The ranges are those of an environment, which says what is wrong with them.
        assert self.randomisation(SLOWER).machines == self.machines

    def randomisation(self, condition: str) -> RandomisationOptions:
        """What an environment draws under a condition."""
        if condition == NOMINAL:
            return RandomisationOptions()
        return RandomisationOptions(
            friction=self.friction,
            natural_frequency=self.natural_frequency,
            dead_time=self.dead_time,
            machines=self.machines,
        )

    def machines_under(self, condition: str, platform: Platform) -> list[Platform]:
        """The machines of a condition: the platform, or the slower ones, the same for every batch."""
        return machines_of(TaskOptions(platform=platform, randomisation=self.randomisation(condition)))
