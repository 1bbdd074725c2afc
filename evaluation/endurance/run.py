"""Endurance: policies through hours of random drives, a batch at a time, on nominal and slower machines.

Everything about a drive follows from its seed: road, car, friction, machine. Finished drives are kept policy
by policy, so that a run that was stopped goes on, and can be made longer. :class:`TrueLimits` checks the true
motion by NumPy's kinematics, without the limiter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...baselines.compensation import Compensated, CompensationOptions
from ...baselines.interface import Machines
from ...baselines.policy import Policy
from ...envs.arrays import FLOAT
from ...envs.car.simulation import Plan, simulate
from ...envs.cues import CueTrace
from ...envs.errors import DataError
from ...envs.platform import Platform, actuator_limits
from ...envs.platform.kernels.step import LEGS
from ...envs.platform.kinematics import leg_motion
from ...envs.platform.machines import limits_exceeded
from ...envs.settings import to_dict
from ...envs.simulator.simulator import TIME_STEP, Simulator
from ...envs.task.episode import slippery
from ..metrics import Criteria, cue_error
from ..policies import make_policy
from ..results import drive_key
from ..rollout import Rollout
from ..studies.study import identity
from .results import (
    NOMINAL,
    Endurance,
    EnduranceStore,
    Endured,
    EnduredDrive,
    PolicyEndurance,
)

Floats = NDArray[np.float64]

KINDS: Final = ("position", "rate", "acceleration", "pose", "number")
"""What can be exceeded: an actuator's travel, speed or acceleration; a pose, which its legs must hold and
which must not be singular; and numbers, where the motion is not finite."""

TOLERANCE: Final = 1e-6 if FLOAT is np.float64 else 1e-2
"""Of each limit, relative, for rounding; legs may differ from their pose by as much, m."""

_LIMITED: Final = ("position", "rate", "acceleration")


class TrueLimits:
    """Holds motion against a machine's own numbers, batch by batch in the order of time.

    Actuators of the hexapod are not taken from the machine's step, but computed from the pose it came to.

    Args:
        platform: The machine; lag and dead time make no difference.
        n: Environments.
        dt: Time step, s.
    """

    def __init__(self, platform: Platform, n: int, dt: float) -> None:
        self._hexapod, self._dt = platform.hexapod, dt
        self._limits = actuator_limits(platform)
        self._before: Floats = np.zeros((0, n, 9))
        self.use = dict.fromkeys(_LIMITED, 0.0)
        self.clearance = 1.0

    def exceeded(self, motion: NDArray[Any]) -> dict[str, NDArray[np.bool_]]:
        """(steps, n) whether each of :data:`KINDS` is exceeded.

        Keeps the largest ``use`` of a limit, which is 1, and the least ``clearance`` of singular poses, both
        where they are finite.

        Args:
            motion: (steps, n) rows of ``envs.platform.kernels.step.Motion``; they follow those of the
            last call.
        """
        position, rate, reported, clearance = self._actuators(motion)
        change = np.diff(np.concatenate([self._before, rate]), axis=0) / self._dt
        # A machine that begins has come from rest.
        change = np.concatenate([np.zeros((len(rate) - len(change), *rate.shape[1:])), change])
        self._before = rate[-1:].copy()
        limits = self._limits
        ends = np.where(position < 0.0, -limits["position_min"], limits["position_max"])
        largest = (ends, limits["velocity"], limits["acceleration"])
        for name, values, limit in zip(_LIMITED, (position, rate, change), largest, strict=True):
            share = np.divide(np.abs(values), limit, out=np.zeros_like(values), where=limit > 0.0)
            self.use[name] = float(np.max(share, initial=self.use[name], where=np.isfinite(share)))
        self.clearance = float(np.min(clearance, initial=self.clearance, where=np.isfinite(clearance)))
        exceeded = limits_exceeded(limits, position, rate, change, TOLERANCE)
        holds = (np.abs(position[..., LEGS] - reported) <= TOLERANCE).all(axis=-1) & (clearance > 0.0)
        finite = np.isfinite(position).all(axis=-1) & np.isfinite(rate).all(axis=-1)
        beyond = [np.asarray(flags.any(axis=-1)) for flags in exceeded]
        return dict(zip(KINDS, (*beyond, np.logical_not(holds), np.logical_not(finite)), strict=True))

    def _actuators(self, motion: NDArray[Any]) -> tuple[Floats, Floats, Floats, Floats]:
        """Positions and rates (steps, n, 9), legs of the step (steps, n, 6), clearance (steps, n)."""
        shape, rows = motion.shape, motion.reshape(-1)
        position, rate = (np.array(rows[name], dtype=np.float64) for name in ("position", "rate"))
        reported = position[:, LEGS].copy()
        pose = np.hstack([rows["displacement"], rows["beta"]]).astype(np.float64)
        pose_rate = np.hstack([rows["velocity"], rows["beta_rate"]]).astype(np.float64)
        # Legs of a pose that is not finite are not a number, and count as such.
        with np.errstate(invalid="ignore"):
            legs = leg_motion(self._hexapod, pose, pose_rate)
        position[:, LEGS], rate[:, LEGS] = legs.extension, legs.rate
        return (
            position.reshape(*shape, 9),
            rate.reshape(*shape, 9),
            reported.reshape(*shape, 6),
            legs.clearance.reshape(shape),
        )


_ROWS: Final = 8192
"""Time steps of drives that are checked together: some ten megabytes."""

_CHANNELS: Final = (
    ("reference_cue", "simulator_cue", "cue_error"),
    ("perceived_reference", "perceived_simulator", "perceived_cue_error"),
)


class Watch:
    """Cue errors and limits of a simulator's drives, a block of time steps at a time."""

    def __init__(self, simulator: Simulator, platform: Platform) -> None:
        self._simulator, n = simulator, simulator.n
        self._rows = np.zeros((max(1, _ROWS // n), n), dtype=simulator.state.dtype)
        self._filled, self._criteria = 0, Criteria()
        self.limits = TrueLimits(platform, n, simulator.dt)
        self.samples = 0
        self.at_limit = np.zeros(n, dtype=np.int64)
        self.beyond = np.zeros(n, dtype=np.int64)
        self.exceeded = {kind: np.zeros(n, dtype=np.int64) for kind in KINDS}
        self.errors = {name: np.zeros(n) for _, _, name in _CHANNELS}

    def note(self) -> bool:
        """Take the state now; returns whether a block was full and was checked."""
        # As bytes, which NumPy copies at once; structures it copies field by field.
        self._rows[self._filled].view(np.uint8)[...] = self._simulator.state.view(np.uint8)
        self._filled += 1
        if self._filled < len(self._rows):
            return False
        self.check()
        return True

    def check(self) -> None:
        """Check the states noted since the last time."""
        rows, self._filled = self._rows[: self._filled], 0
        if not len(rows):
            return
        self.samples += len(rows)
        self.at_limit += np.count_nonzero(rows["limits"], axis=0)
        exceeded = self.limits.exceeded(rows["motion"])
        for kind, flags in exceeded.items():
            self.exceeded[kind] += flags.sum(axis=0)
        self.beyond += np.any(list(exceeded.values()), axis=0).sum(axis=0)
        for reference, simulated, name in _CHANNELS:
            error = cue_error(_cues(rows[reference]), _cues(rows[simulated]), self._criteria)
            self.errors[name] += error.reshape(rows.shape).sum(axis=0)


def _cues(side: NDArray[Any]) -> Floats:
    """(rows, 6) specific force and angular velocity."""
    flat = side.reshape(-1)
    return np.hstack([flat["force"], flat["rate"]]).astype(np.float64)


def drive_and_check(
    run: Rollout, platform: Platform, progress: Callable[[int], None] = lambda steps: None
) -> tuple[list[Endured], dict[str, float]]:
    """Drive drives of one length to their end.

    Args:
        run: At the first sample, with actions made finite.
        platform: The machine as it should be.
        progress: Called now and then with the time steps done since; what it raises ends the drive.

    Returns:
        The result of each drive, and of all: the largest use of each limit and the least clearance of
        singular poses.
    """
    watch = Watch(run.simulator, platform)
    done = reported = 0
    watch.note()
    for done, _ in enumerate(run.steps(), start=1):
        if watch.note():
            progress(done - reported)
            reported = done
    watch.check()
    progress(done - reported)
    means = {name: total / watch.samples for name, total in watch.errors.items()}
    drives = [
        Endured(
            samples=watch.samples,
            **{name: float(mean[i]) if np.isfinite(mean[i]) else None for name, mean in means.items()},
            at_limit=float(watch.at_limit[i] / watch.samples),
            beyond=int(watch.beyond[i]),
            exceeded={kind: int(counts[i]) for kind, counts in watch.exceeded.items()},
            actions_not_finite=int(run.not_finite[i]),
        )
        for i in range(run.simulator.n)
    ]
    return drives, {**watch.limits.use, "clearance": watch.limits.clearance}


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

    A car that slides off its path stays in: its driver perceives that, too.
    """
    plans = [endurance.drives.plan(seed, endurance.duration) for seed in seeds]
    random = np.random.default_rng
    frictions = [float(random((seed, _FRICTION_STREAM)).uniform(*endurance.friction)) for seed in seeds]
    machines = [int(random((seed, _MACHINE_STREAM)).integers(endurance.machines)) for seed in seeds]
    plans = [replace(p, car=slippery(p.car, factor)) for p, factor in zip(plans, frictions, strict=True)]
    return [
        SeededDrive(seed, plan.car.name, friction, machine, cues)
        for seed, friction, machine, plan, cues in zip(
            seeds, frictions, machines, plans, _driven(plans), strict=True
        )
        if cues is not None
    ]


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
"""Called with the policy and condition at hand, and the seconds of drive done since the last call."""


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
    """Drives the missing drives.

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
            key = drive_key(
                platform=to_dict(request.platform),
                endurance=request.endurance.about(),
                policy=identity(request.policies[label], policy),
            )
            self._stores[label] = EnduranceStore(request.folder, label, key, fresh)

    @property
    def seconds(self) -> float:
        """Of drive that are to be done, all policies and conditions."""
        drives = sum(len(store.missing(self._request.seeds)) for store in self._stores.values())
        return drives * len(self._request.endurance.conditions) * self._request.endurance.duration

    def drive(self, progress: Progress) -> EnduranceOutcome:
        """Drive to the end, or until ``progress`` raises :class:`Stopped`; finished drives are on disk."""
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
        for condition, known in endurance.conditions.items():

            def report(steps: int, what: str = f"{label}, {condition}") -> None:
                progress(what, steps * len(drives) * TIME_STEP)

            machines = Machines(
                drives=[drive.cues for drive in drives],
                platforms=endurance.machines_under(condition, platform),
                platform_of=[0 if condition == NOMINAL else drive.machine for drive in drives],
            )
            policy = self._policies[label]
            if known is not None:
                policy = Compensated(policy, CompensationOptions(known=known))
            run = Rollout(policy, machines, finite=True)
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
