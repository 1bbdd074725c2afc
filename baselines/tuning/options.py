"""Everything that can be chosen about a search."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from ...envs.car import RandomDrives, drive_seeds
from ...envs.errors import ConfigurationError
from ...envs.settings import Positive, configuration
from ..families import AnyWashout, algorithm_of
from .objective import Measure

TRAIN: Final = "train"
"""Stands for random drives; the standard maneuvers are for evaluation."""
HELD_OUT_SEED: Final = 1_000_000
"""Of the random drives a search never sees: those that agents are validated on."""
HELD_OUT: Final = 64
"""Their number."""

ROADS: Final = RandomDrives(urban=0.3, rural=0.2, highway=0.1, track=0.4)
"""What the shipped agents are trained on: fierce drives are many, because maneuvers are fierce."""

Count = Annotated[int, Field(ge=0, lt=2**32)]


@configuration
class TuningOptions:
    """A search; with its drives and its machine it determines the result.

    Args:
        start: Where it begins, and what it leaves as it is: orders of filters, blocks that are off.
        objective: J, or J of what the driver senses.
        method: "cma", or "gradient" through the machine's own equations, for a classical washout.
        maneuvers: "train" for random drives, or names of maneuvers and recordings.
        limits: Where no limit may be met: in "all" drives, or on "roads", which spares the random drives on a
            track; a set that takes the fiercest of them without a limit is a timid one on every road.
        drives: Number of random drives, if any.
        duration: Of each, s.
        roads: What the random drives are drawn from.
        drives_seed: Of the random drives; the one that agents are trained with unless told otherwise.
        budget: Time to simulate, h.
        seed: Of everything else that is drawn.
    """

    start: AnyWashout
    objective: Measure = "J"
    method: Literal["cma", "gradient"] = "cma"
    maneuvers: Annotated[tuple[str, ...], Field(min_length=1)] = (TRAIN,)
    limits: Literal["roads", "all"] = "roads"
    drives: Annotated[int, Field(ge=1)] = 256
    duration: Positive = 60.0
    roads: RandomDrives = ROADS
    drives_seed: Count = 0
    budget: Positive = 1000.0
    seed: Count = 0

    def __post_init__(self) -> None:
        if self.method == "gradient" and self.objective != "J":
            raise ConfigurationError("objective perceived has no gradient; use method cma")
        if self.method == "gradient" and algorithm_of(self.start) != "classical":
            raise ConfigurationError("only the classical washout has a gradient; use method cma")
        seen = drive_seeds(self.drives, self.drives_seed) if TRAIN in self.maneuvers else []
        if set(seen) & set(drive_seeds(HELD_OUT, HELD_OUT_SEED)):
            raise ConfigurationError(f"drives_seed {self.drives_seed} gives drives that are held out")
