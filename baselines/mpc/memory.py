"""What a predictive controller sees, remembers and counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.observation import read
from .forecast import REST
from .linearisation import Floats
from .planner import Planned
from .solver import Rows

_RELAXED: Final = 1e-3
"""Violation of a linearised limit from which on a plan counts as relaxed, share of half its range."""


@dataclass(frozen=True)
class Moment:
    """What a controller sees: positions and rates (9,), the car's cues and the cues' error (6,), SI."""

    position: Floats
    rate: Floats
    wanted: Floats
    error: Floats


def moment_of(row: NDArray[Any], angle: float) -> Moment:
    """What an observation says.

    Args:
        row: (OBSERVATION_SIZE,) of one machine.
        angle: Of the turntable a time step ago; the one measured is the nearest to it, rad.
    """
    sine, cosine = read(row, "turntable")
    measured = float(np.arctan2(sine, cosine))
    turned = measured + 2.0 * np.pi * round((angle - measured) / (2.0 * np.pi))
    position = [*(read(row, name) for name in ("carriage", "displacement", "beta")), np.array([turned])]
    rate = [read(row, name) for name in ("carriage_rate", "velocity", "beta_rate", "turntable_rate")]
    wanted = np.concatenate([read(row, "wanted_force"), read(row, "wanted_rate")])
    felt = np.concatenate([read(row, "felt_force"), read(row, "felt_rate")])
    # Observed forces have gravity at rest taken off.
    return Moment(np.concatenate(position), np.concatenate(rate), wanted + REST, felt - wanted)


@dataclass(frozen=True)
class Memory:
    """What a controller knows of one machine.

    Args:
        sample: Of the drive, counted from the start.
        angle: Turntable angle, unwound, rad.
        plan: (n, 9) accelerations at the nodes when it was made.
        age: Time steps since.
        solved: Whether there is a plan.
        active: Limits that held in it.
        error: (6,) of the cues in the last step.
        lasts: (6,) what of the car's cues lasts; None at the start.
        sensors: (6, 3) states of the vestibular filters.
    """

    sample: int
    angle: float
    plan: Floats
    age: int
    solved: bool
    active: Rows
    error: Floats
    lasts: Floats | None
    sensors: Floats


@dataclass
class Counts:
    """What a controller counted.

    Args:
        solves: Plans made.
        failures: Plans that were not found; the machine braked.
        iterations: Programs solved for them.
        rounds: Duals solved for them.
        unconverged: Plans still on the move after their last program, where there may be several.
        relaxed: Plans in which a linearised limit could not be kept.
    """

    solves: int = 0
    failures: int = 0
    iterations: int = 0
    rounds: int = 0
    unconverged: int = 0
    relaxed: int = 0

    def add(self, planned: Planned) -> None:
        """One more."""
        self.solves += 1
        self.failures += not planned.solved
        self.iterations += planned.iterations
        self.rounds += planned.rounds
        self.unconverged += not planned.converged
        self.relaxed += planned.relaxed > _RELAXED
