"""Endurance: policies through hours of random drives, a batch at a time, on nominal and slower machines.

Everything about a drive follows from its seed: road, car, friction, machine. Finished drives are kept policy
by policy, so that a run that was stopped goes on, and can be made longer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...baselines.interface import Machines
from ...baselines.policy import Policy
from ...envs.car.simulation import Plan, simulate
from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.platform import Platform
from ...envs.simulator.simulator import TIME_STEP
from ...envs.task.episode import slippery
from ..policies import make_policy
from ..rollout import Rollout
from ..studies.store import identity
from .checks import drive_and_check
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
    """A drive and what its seed stands for.

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
    """The drives of seeds; those whose car leaves the range of its model are skipped.

    A car that slides off its path stays in: its driver feels that, too.

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


Progress = Callable[[str, float], None]
"""Given what is driven, and the seconds of drive done since the last call."""

CONDITIONS: Final = (NOMINAL, SLOWER)


class Stopped(Exception):  # noqa: N818  (not an error)
    """Raised by a :data:`Progress` to stop."""


@dataclass(frozen=True)
class EnduranceRequest:
    """The drives of a run.

    Args:
        endurance: What policies are put through.
        platform: The machine.
        policies: By label, as :func:`~..policies.make_policy` takes them.
        seeds: Of the drives.
        batch: Drives side by side.
        folder: Where finished drives are kept.
    """

    endurance: Endurance
    platform: Platform
    policies: Mapping[str, Any]
    seeds: Sequence[int]
    batch: int
    folder: Path


@dataclass
class EnduranceOutcome:
    """The result of a run.

    Args:
        policies: By label, with the drives of the request.
        driven: Drives that were driven now.
        skipped: Seeds whose car left the range of its model.
        finished: Whether every drive is done.
    """

    policies: dict[str, PolicyEndurance] = field(default_factory=dict)
    driven: int = 0
    skipped: list[int] = field(default_factory=list)
    finished: bool = True


class EnduranceRun:
    """Drives what is not done yet.

    Args:
        request: The drives.
        fresh: Forget what these policies have driven.

    Raises:
        MotionCueingError: there is no such policy, or it was not made for the machine.
    """

    def __init__(self, request: EnduranceRequest, fresh: bool = False) -> None:
        self._request, self._outcome = request, EnduranceOutcome()
        # All of them first: a wrong name forgets nothing.
        self._policies: dict[str, Policy] = {
            label: make_policy(given, request.platform) for label, given in request.policies.items()
        }
        self._stores: dict[str, EnduranceStore] = {}
        for label, policy in self._policies.items():
            about = identity(request.policies[label], policy)
            key = endurance_key(request.platform, request.endurance, about)
            self._stores[label] = EnduranceStore(request.folder, label, key, fresh)

    @property
    def seconds(self) -> float:
        """Of drive that are to be done, all policies and conditions."""
        drives = sum(len(store.missing(self._request.seeds)) for store in self._stores.values())
        return drives * len(CONDITIONS) * self._request.endurance.duration

    def drive(self, progress: Progress) -> EnduranceOutcome:
        """Drive until everything is done, or ``progress`` raises :class:`Stopped`; what is done is kept."""
        try:
            for drives in self._batches():
                for label in self._policies:
                    self._drive_batch(label, drives, progress)
        except Stopped:
            self._outcome.finished = False
        requested = set(self._request.seeds)
        for label, store in self._stores.items():
            kept = store.kept
            chosen = tuple(drive for drive in kept.drives if drive.seed in requested)
            self._outcome.policies[label] = PolicyEndurance(kept.key, chosen, kept.extremes)
        return self._outcome

    def _batches(self) -> Iterator[list[SeededDrive]]:
        """Drives that any policy has not done yet."""
        seeds, size = self._request.seeds, self._request.batch
        missing = list(dict.fromkeys(chain(*(store.missing(seeds) for store in self._stores.values()))))
        for first in range(0, len(missing), size):
            batch = missing[first : first + size]
            drives = seeded_drives(self._request.endurance, batch)
            made = {drive.seed for drive in drives}
            self._outcome.skipped += [seed for seed in batch if seed not in made]
            yield drives

    def _drive_batch(self, label: str, drives: Sequence[SeededDrive], progress: Progress) -> None:
        missing = set(self._stores[label].missing([drive.seed for drive in drives]))
        drives = [drive for drive in drives if drive.seed in missing]
        if not drives:
            return
        results: dict[str, list[Endured]] = {}
        extremes: dict[str, dict[str, float]] = {}
        endurance, platform = self._request.endurance, self._request.platform
        for condition in CONDITIONS:

            def report(steps: int, what: str = f"{label}, {condition}") -> None:
                progress(what, steps * len(drives) * TIME_STEP)

            machines = Machines(
                drives=[drive.cues for drive in drives],
                platforms=endurance.machines_under(condition, platform),
                platform_of=[0 if condition == NOMINAL else drive.machine for drive in drives],
            )
            run = Rollout(self._policies[label], machines, finite=True)
            results[condition], extremes[condition] = drive_and_check(run, platform, report)
        self._stores[label].keep(_records(drives, results), extremes)
        self._outcome.driven += len(drives)


def _records(drives: Sequence[SeededDrive], results: Mapping[str, Sequence[Endured]]) -> list[EnduredDrive]:
    return [
        EnduredDrive(
            name=drive.cues.name,
            seed=drive.seed,
            car=drive.car,
            friction=drive.friction,
            machine=drive.machine,
            conditions={condition: endured[i] for condition, endured in results.items()},
        )
        for i, drive in enumerate(drives)
    ]
