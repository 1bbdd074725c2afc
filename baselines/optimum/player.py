"""The real step, played ahead: whether a plan keeps every limit, what it is worth, and where it leads."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...envs.cues import CueTrace
from ...envs.perception import VestibularModel
from ...envs.platform import Platform
from ...envs.platform.machines import UNITY
from ...envs.platform.state import SINGULAR
from ...envs.simulator import N_AXES, Simulator
from ...envs.snapshot import Snapshot

Floats = NDArray[np.float64]

_STRENGTH: Final = 1.0 - 1e-4
"""Share of the limits to play with, so that braking, which uses them to the full, meets none by round-off."""


@dataclass(frozen=True)
class Played:
    """What became of some accelerations.

    Args:
        accelerations: (n, 9) that the machine followed.
        clean: Whether it met no limit, so that they are those asked for.
        states: (n,) rows of ``Simulator.state``.
    """

    accelerations: Floats
    clean: bool
    states: NDArray[Any]

    @property
    def singular(self) -> bool:
        """Whether it was kept from a singular pose."""
        return bool(np.any(self.states["limits"] & np.uint64(SINGULAR)))


class Player:
    """A machine without lag or dead time on its way through a drive, always the time step after.

    Args:
        platform: The machine.
        cues: The drive.
        vestibular: The driver's perception.
        start: (9,) pose to begin at.
    """

    def __init__(
        self, platform: Platform, cues: CueTrace, vestibular: VestibularModel, start: ArrayLike
    ) -> None:
        self._simulator = Simulator(_weakened(platform), cues, vestibular=vestibular, dt=cues.dt)
        self._simulator.reset(start)

    @property
    def state(self) -> Any:
        """A row of ``Simulator.state``."""
        return self._simulator.state[0]

    def snapshot(self) -> Snapshot:
        """For :meth:`restore`."""
        return self._simulator.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to where a snapshot was taken."""
        self._simulator.restore(snapshot)

    def play(self, accelerations: Floats) -> Played:
        """Follow accelerations (n, 9)."""
        states = np.zeros(len(accelerations), dtype=self._simulator.state.dtype)
        if np.all(np.isfinite(accelerations)):
            for k, acceleration in enumerate(accelerations):
                states[k] = self._simulator.step(acceleration)[0]
            return Played(accelerations, not np.any(states["limits"]), states)
        return Played(accelerations, False, states)

    def brake(self, steps: int) -> Played:
        """Come to rest as fast as every actuator may, and stand."""
        states = np.zeros(steps, dtype=self._simulator.state.dtype)
        for k in range(steps):
            states[k] = self._simulator.step(-self.rates() / self._simulator.dt)[0]
        return Played(np.array(states["acceleration"], dtype=np.float64), True, states)

    def positions(self) -> Floats:
        """(9,) in the order of ``AXES``."""
        return _axes(self.state["motion"], "position", "displacement", "beta")

    def rates(self) -> Floats:
        """(9,) in the order of ``AXES``."""
        return _axes(self.state["motion"], "rate", "velocity", "beta_rate")


def _axes(motion: Any, actuators: str, linear: str, angular: str) -> Floats:
    parts = (motion[actuators][:2], motion[linear], motion[angular], motion[actuators][8:])
    return np.concatenate(parts).astype(np.float64).reshape(N_AXES)


def _weakened(platform: Platform) -> Platform:
    parts: dict[str, Any] = {}
    for name in ("carriage", "hexapod", "turntable"):
        part = getattr(platform, name)
        if part is not None:
            speed, force = _STRENGTH * part.velocity, _STRENGTH * part.acceleration
            parts[name] = replace(part, velocity=speed, acceleration=force, dynamics=UNITY)
    return replace(platform, **parts)
