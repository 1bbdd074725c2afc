"""What the controller did, step by step: little enough to keep for hours, enough to do it again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...envs.cues import CueTrace
from ...envs.perception import get_vestibular_model
from ...envs.platform import Platform
from ...envs.simulator import N_AXES, TIME_STEP, Simulator
from ..drivers import Sample
from ..recording import record, trajectory_of
from ..trajectory import Trajectory
from .watchdog import State

Floats = NDArray[np.float64]

_CUES: Final = slice(0, 6)
_ACTION: Final = slice(6, 6 + N_AXES)
_SECONDS: Final = 15
_STATE: Final = 16
_SIZE: Final = 17
_CHUNK: Final = 6000
"""Rows that are made room for at a time, a minute: a list of an hour would take long to grow."""


class LoopLog:
    """A row a time step: cues in use, accelerations asked for, time the policy took, state."""

    def __init__(self) -> None:
        self._chunks: list[Floats] = []
        self._rows = 0

    def __len__(self) -> int:
        return self._rows

    def add(self, cues: Floats, action: Floats, seconds: float, state: State) -> None:
        """Keep a step.

        Args:
            cues: (6,) specific force, m/s^2, and angular velocity, rad/s, at its begin.
            action: (9,) accelerations in it, m/s^2 and rad/s^2.
            seconds: Time the policy took; NaN if it was not asked.
            state: Of the controller.
        """
        place = self._rows % _CHUNK
        if place == 0:
            self._chunks.append(np.zeros((_CHUNK, _SIZE)))
        row = self._chunks[-1][place]
        row[_CUES], row[_ACTION], row[_SECONDS], row[_STATE] = cues, action, seconds, state
        self._rows += 1

    @property
    def states(self) -> NDArray[np.int64]:
        """(n,) state in each step."""
        return self._table()[:, _STATE].astype(np.int64)

    def trajectory(self, platform: Platform, start: ArrayLike, vestibular: str, policy: Any) -> Trajectory:
        """The drive as any other is recorded: its steps taken once more, with the same accelerations.

        Args:
            platform: The machine.
            start: (9,) pose it began at.
            vestibular: Perception model by name.
            policy: For its name, its parameters and its notes.
        """
        table = self._table()
        player = _Player(table, platform, vestibular)
        cues = player.simulator.drives[0]
        trajectory = trajectory_of(record(player, start), player, policy, cues, None)
        steps = {f"loop_{state.name.lower()}": str(int((self.states == state).sum())) for state in State}
        return replace(trajectory, metadata={**trajectory.metadata, **steps})

    def _table(self) -> Floats:
        if not self._chunks:
            return np.zeros((0, _SIZE))
        return np.concatenate(self._chunks)[: self._rows]


class _Player:
    """The driver that takes the logged steps."""

    def __init__(self, table: Floats, platform: Platform, vestibular: str) -> None:
        self._table = table
        self.simulator = Simulator(
            platform, _cues_of(table), vestibular=get_vestibular_model(vestibular), dt=TIME_STEP
        )

    def begin(self, start: ArrayLike) -> NDArray[Any]:
        """Put the machine at rest at a pose (9,); returns its state."""
        return self.simulator.reset(start)[0]  # type: ignore[no-any-return]

    def samples(self) -> Iterator[Sample]:
        """One time step after another."""
        for row in self._table:
            yield Sample(row[_ACTION], self.simulator.step(row[_ACTION])[0], row[_SECONDS])


def _cues_of(table: Floats) -> CueTrace:
    """The cues in use, with the angular acceleration the controller took."""
    rate = table[:, 3:6]
    change = np.diff(rate, axis=0, prepend=rate[:1]) / TIME_STEP
    time = np.asarray(TIME_STEP * np.arange(len(table)), dtype=np.float64)
    return CueTrace("loop", time, table[:, :3], rate, change, source="in the loop")
