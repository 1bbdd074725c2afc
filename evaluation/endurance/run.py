"""The drives, each with all that its seed stands for: road, car, friction, machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Final

import numpy as np

from ...envs.car.simulation import Plan, simulate
from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.platform import Platform
from ...envs.simulator.simulator import TIME_STEP
from ...envs.task.drives import slippery
from ..policies import make_policy
from ..rollout import AnyPolicy
from ..studies.store import identity
from .batch_drivers import batch_driver
from .checks import watched
from .results import (
    NOMINAL,
    SLOWER,
    Endurance,
    EnduranceStore,
    Endured,
    EnduredDrive,
    PolicyEndurance,
    endurance_key,
)

_MACHINE_STREAM: Final = 2
_FRICTION_STREAM: Final = 3
"""Beside the seed of a drive; 1 is the road's roughness."""


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


# Policies through many drives, a batch at a time, with the machine as it should be and with slower ones.


Tell = Callable[[str, float], None]
"""Told what is driven and the seconds of drive that were done since the last time."""

CONDITIONS: Final = (NOMINAL, SLOWER)


class Stopped(Exception):  # noqa: N818  (not an error)
    """Raised by a :data:`Tell` to stop."""


@dataclass(frozen=True)
class Asked:
    """What is to be driven.

    Args:
        endurance: What policies are put through.
        platform: The machine.
        policies: Name or file by label.
        seeds: Of the drives.
        batch: Drives side by side.
        folder: Where drives that are done are kept.
    """

    endurance: Endurance
    platform: Platform
    policies: Mapping[str, str]
    seeds: Sequence[int]
    batch: int
    folder: Path


@dataclass
class Found:
    """What came of it.

    Args:
        policies: By label, of the drives that were asked for.
        driven: Drives that were driven now.
        left_out: Seeds whose car left the range of its model.
        finished: Whether everything was driven.
    """

    policies: dict[str, PolicyEndurance] = field(default_factory=dict)
    driven: int = 0
    left_out: list[int] = field(default_factory=list)
    finished: bool = True


class Run:
    """Drives what is not done yet.

    Args:
        asked: What is to be driven.
        fresh: Forget what these policies have driven.

    Raises:
        MotionCueingError: there is no such policy, or it was not made for the machine.
    """

    def __init__(self, asked: Asked, fresh: bool = False) -> None:
        self._asked, self._found = asked, Found()
        # All of them first: a wrong name forgets nothing.
        self._policies: dict[str, AnyPolicy] = {
            label: make_policy(name, asked.platform) for label, name in asked.policies.items()
        }
        self._stores: dict[str, EnduranceStore] = {}
        for label, name in asked.policies.items():
            about = identity(name, self._policies[label])
            key = endurance_key(asked.platform, asked.endurance, about)
            self._stores[label] = EnduranceStore(asked.folder, label, key, fresh)

    @property
    def seconds(self) -> float:
        """Of drive that are to be done, all policies and conditions."""
        drives = sum(len(store.missing(self._asked.seeds)) for store in self._stores.values())
        return drives * len(CONDITIONS) * self._asked.endurance.duration

    def drive(self, tell: Tell) -> Found:
        """Drive until everything is done, or ``tell`` raises :class:`Stopped`; what is done is kept."""
        try:
            for drives in self._batches():
                for label in self._policies:
                    self._drive_batch(label, drives, tell)
        except Stopped:
            self._found.finished = False
        wanted = set(self._asked.seeds)
        for label, store in self._stores.items():
            kept = store.kept
            chosen = tuple(drive for drive in kept.drives if drive.seed in wanted)
            self._found.policies[label] = PolicyEndurance(kept.key, chosen, kept.extremes)
        return self._found

    def _batches(self) -> Iterator[list[SeededDrive]]:
        """Drives that any policy has not done yet."""
        missing = list(
            dict.fromkeys(chain(*(store.missing(self._asked.seeds) for store in self._stores.values())))
        )
        for first in range(0, len(missing), self._asked.batch):
            seeds = missing[first : first + self._asked.batch]
            drives = seeded_drives(self._asked.endurance, seeds)
            made = {drive.seed for drive in drives}
            self._found.left_out += [seed for seed in seeds if seed not in made]
            yield drives

    def _drive_batch(self, label: str, drives: Sequence[SeededDrive], tell: Tell) -> None:
        missing = set(self._stores[label].missing([drive.seed for drive in drives]))
        drives = [drive for drive in drives if drive.seed in missing]
        if not drives:
            return
        outcomes: dict[str, list[Endured]] = {}
        extremes: dict[str, dict[str, float]] = {}
        for condition in CONDITIONS:
            what = f"{label}, {condition}"
            outcomes[condition], extremes[condition] = self._under(condition, label, drives, what, tell)
        self._stores[label].keep(_records(drives, outcomes), extremes)
        self._found.driven += len(drives)

    def _under(
        self, condition: str, label: str, drives: Sequence[SeededDrive], what: str, tell: Tell
    ) -> tuple[list[Endured], dict[str, float]]:
        asked = self._asked
        driver = batch_driver(
            self._policies[label],
            [drive.cues for drive in drives],
            asked.platform,
            [0 if condition == NOMINAL else drive.machine for drive in drives],
            asked.endurance,
            condition,
        )
        return watched(driver, asked.platform, lambda steps: tell(what, steps * len(drives) * TIME_STEP))


def _records(drives: Sequence[SeededDrive], outcomes: Mapping[str, Sequence[Endured]]) -> list[EnduredDrive]:
    return [
        EnduredDrive(
            name=drive.cues.name,
            seed=drive.seed,
            car=drive.car,
            friction=drive.friction,
            machine=drive.machine,
            conditions={condition: found[i] for condition, found in outcomes.items()},
        )
        for i, drive in enumerate(drives)
    ]
