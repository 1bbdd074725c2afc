"""Whether a machine's true motion keeps its limits, told from the motion alone: the limiter is not asked."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.platform import Platform, actuator_limits
from ...envs.platform.state import LEGS
from ...envs.precision import FLOAT
from .legs import legs_of

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
        limits = actuator_limits(platform)
        self._low, self._high = limits["position_min"], limits["position_max"]
        self._speed, self._acceleration = limits["velocity"], limits["acceleration"]
        self._before: Floats = np.zeros((0, n, 9))
        self.use = dict.fromkeys(_LIMITED, 0.0)
        self.clearance = 1.0

    def exceeded(self, motion: NDArray[Any]) -> dict[str, NDArray[np.bool_]]:
        """(steps, n) whether each of :data:`KINDS` is exceeded.

        Keeps the largest ``use`` of a limit, which is 1, and the least ``clearance`` of singular poses, both
        where they are finite.

        Args:
            motion: (steps, n) rows of ``envs.platform.state.Motion``; they follow those of the last call.
        """
        position, rate, told, clearance = self._actuators(motion)
        change = np.diff(np.concatenate([self._before, rate]), axis=0) / self._dt
        # A machine that begins has come from rest.
        change = np.concatenate([np.zeros((len(rate) - len(change), *rate.shape[1:])), change])
        self._before = rate[-1:].copy()
        ends = np.where(position < 0.0, -self._low, self._high)
        kept = {
            "position": self._keeps("position", position, ends, self._high - self._low),
            "rate": self._keeps("rate", rate, self._speed, self._speed),
            "acceleration": self._keeps("acceleration", change, self._acceleration, self._acceleration),
            "pose": (np.abs(position[..., LEGS] - told) <= TOLERANCE).all(axis=-1) & (clearance > 0.0),
            "number": np.isfinite(position).all(axis=-1) & np.isfinite(rate).all(axis=-1),
        }
        self.clearance = float(np.min(clearance, initial=self.clearance, where=np.isfinite(clearance)))
        return {name: np.logical_not(flags) for name, flags in kept.items()}

    def _keeps(self, name: str, values: Floats, limit: Floats, scale: Floats) -> NDArray[np.bool_]:
        """(steps, n) whether all actuators keep a limit; what is not a number keeps none."""
        size = np.abs(values)
        share = np.divide(size, limit, out=np.zeros_like(size), where=limit > 0.0)
        self.use[name] = float(np.max(share, initial=self.use[name], where=np.isfinite(share)))
        return np.asarray((size <= limit + TOLERANCE * scale).all(axis=-1))

    def _actuators(self, motion: NDArray[Any]) -> tuple[Floats, Floats, Floats, Floats]:
        """Positions and rates (steps, n, 9), legs of the step (steps, n, 6), clearance (steps, n)."""
        shape, rows = motion.shape, motion.reshape(-1)
        position, rate = (np.array(rows[name], dtype=np.float64) for name in ("position", "rate"))
        told = position[:, LEGS].copy()
        pose = np.hstack([rows["displacement"], rows["beta"]]).astype(np.float64)
        pose_rate = np.hstack([rows["velocity"], rows["beta_rate"]]).astype(np.float64)
        legs = legs_of(self._hexapod, pose, pose_rate)
        position[:, LEGS], rate[:, LEGS] = legs.extension, legs.rate
        return (
            position.reshape(*shape, 9),
            rate.reshape(*shape, 9),
            told.reshape(*shape, 6),
            legs.clearance.reshape(shape),
        )
