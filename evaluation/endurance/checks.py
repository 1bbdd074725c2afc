"""Checks of a drive: the true motion's limits by NumPy's kinematics, and what the driver gets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.arrays import FLOAT
from ...envs.platform import Platform, actuator_limits
from ...envs.platform.kernels.step import LEGS
from ...envs.platform.kinematics import leg_motion
from ...envs.platform.machines import limits_exceeded
from ...envs.simulator.simulator import Simulator
from ..metrics import Criteria, cue_error
from ..rollout import Rollout
from .results import Endured

Floats = NDArray[np.float64]


# Whether a machine's true motion keeps its limits, told from the motion alone: the limiter is not asked.


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
        position, rate, told, clearance = self._actuators(motion)
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
        holds = (np.abs(position[..., LEGS] - told) <= TOLERANCE).all(axis=-1) & (clearance > 0.0)
        finite = np.isfinite(position).all(axis=-1) & np.isfinite(rate).all(axis=-1)
        beyond = [np.asarray(flags.any(axis=-1)) for flags in exceeded]
        return dict(zip(KINDS, (*beyond, np.logical_not(holds), np.logical_not(finite)), strict=True))

    def _actuators(self, motion: NDArray[Any]) -> tuple[Floats, Floats, Floats, Floats]:
        """Positions and rates (steps, n, 9), legs of the step (steps, n, 6), clearance (steps, n)."""
        shape, rows = motion.shape, motion.reshape(-1)
        position, rate = (np.array(rows[name], dtype=np.float64) for name in ("position", "rate"))
        told = position[:, LEGS].copy()
        pose = np.hstack([rows["displacement"], rows["beta"]]).astype(np.float64)
        pose_rate = np.hstack([rows["velocity"], rows["beta_rate"]]).astype(np.float64)
        # Legs of a pose that is not finite are not a number, and count as such.
        with np.errstate(invalid="ignore"):
            legs = leg_motion(self._hexapod, pose, pose_rate)
        position[:, LEGS], rate[:, LEGS] = legs.extension, legs.rate
        return (
            position.reshape(*shape, 9),
            rate.reshape(*shape, 9),
            told.reshape(*shape, 6),
            legs.clearance.reshape(shape),
        )


_ROWS: Final = 8192
"""Time steps of drives that are checked together: some ten megabytes."""

_CHANNELS: Final = (
    ("reference_cue", "simulator_cue", "cue_error"),
    ("perceived_reference", "perceived_simulator", "perceived_cue_error"),
)


class Watch:
    """Cue errors and limits of a simulator's drives, a block of time steps at a time.

    Args:
        simulator: With the drives.
        platform: The machine, whose limits count.
    """

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
            self.errors[name] += self._errors(rows[reference], rows[simulated])

    def _errors(self, reference: NDArray[Any], simulated: NDArray[Any]) -> Floats:
        """(n,) sums over the block."""
        error = cue_error(_cues(reference), _cues(simulated), self._criteria)
        return np.asarray(error.reshape(reference.shape).sum(axis=0))


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
    return _outcomes(watch, run.not_finite), {**watch.limits.use, "clearance": watch.limits.clearance}


def _outcomes(watch: Watch, not_finite: NDArray[np.int64]) -> list[Endured]:
    return [
        Endured(
            samples=watch.samples,
            **{name: _mean(total[i], watch.samples) for name, total in watch.errors.items()},
            at_limit=float(watch.at_limit[i] / watch.samples),
            beyond=int(watch.beyond[i]),
            exceeded={kind: int(counts[i]) for kind, counts in watch.exceeded.items()},
            actions_not_finite=int(not_finite[i]),
        )
        for i in range(len(not_finite))
    ]


def _mean(total: float, samples: int) -> float | None:
    return float(total / samples) if np.isfinite(total) else None
