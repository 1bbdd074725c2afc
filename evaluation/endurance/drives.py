"""The drives, each with all that its seed stands for: road, car, friction, machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ...envs.car.simulation import Plan, simulate
from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.task.library import slippery
from .options import Endurance

_MACHINE_STREAM: Final = 2
_FRICTION_STREAM: Final = 3
"""Beside the seed of a drive; 1 is the road's unevenness."""


@dataclass(frozen=True, eq=False)
class SeededDrive:
    """A drive; everything about it follows from its seed.

    Args:
        seed: Of the drive.
        car: Name of the car.
        friction: Factor on the friction of its tires.
        machine: Index of the slower machine.
        cues: Of the drive.
    """

    seed: int
    car: str
    friction: float
    machine: int
    cues: CueTrace


def seeded_drives(endurance: Endurance, seeds: Sequence[int]) -> list[SeededDrive]:
    """The drives of seeds; those whose car leaves the range of its model are left out.

    A car that slides off its path stays: its driver feels that, too.

    Raises:
        ConfigurationError: a seed or the duration is out of range.
    """
    plans = [endurance.drives.plan(seed, endurance.duration) for seed in seeds]
    frictions = [_friction(endurance, seed) for seed in seeds]
    plans = [replace(p, car=slippery(p.car, factor)) for p, factor in zip(plans, frictions, strict=True)]
    return [
        SeededDrive(seed, plan.car.name, friction, _machine(endurance, seed), cues)
        for seed, friction, plan, cues in zip(seeds, frictions, plans, _driven(plans), strict=True)
        if cues is not None
    ]


def _friction(endurance: Endurance, seed: int) -> float:
    return float(np.random.default_rng((seed, _FRICTION_STREAM)).uniform(*endurance.friction))


def _machine(endurance: Endurance, seed: int) -> int:
    return int(np.random.default_rng((seed, _MACHINE_STREAM)).integers(endurance.machines))


def _driven(plans: Sequence[Plan]) -> list[CueTrace | None]:
    """All in one launch, which one car out of range fails; then one by one."""
    try:
        return list(simulate(plans))
    except DataError:
        return [_alone(plan) for plan in plans]


def _alone(plan: Plan) -> CueTrace | None:
    try:
        return simulate([plan])[0]
    except DataError:
        return None
