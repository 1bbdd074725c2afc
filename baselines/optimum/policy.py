"""The offline optimum as a policy: it plans the whole drive before it begins, and plays its plan."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError
from ...envs.perception import VestibularModel, get_vestibular_model
from ...envs.platform import Platform, get_platform
from ...envs.progress import progress
from ...envs.simulator.kernels.observation import OBSERVATION_SIZE, read
from ...envs.simulator.simulator import N_AXES
from ..policy import (
    WHOLE_DRIVE,
    Array,
    Policy,
    Starts,
    checked_episode_start,
    checked_observation,
    wrong_state,
)
from .plan import Plan, key_of, load_plan, store_plan
from .program import OptimumOptions
from .windows import OnWindow, Planner

_PATIENCE: Final = 2.0
"""Time after which the bar is shown, s."""


@contextmanager
def solve_progress(label: str, enabled: bool = True) -> Iterator[OnWindow | None]:
    """A bar over the windows of a drive, on a terminal, once the solve takes long and if it is ``enabled``.

    Yields:
        To be called with the share that is done and the iterations; None where nothing is shown.
    """
    if not (enabled and sys.stderr.isatty()):
        yield None
        return
    began, bar = time.monotonic(), None
    with ExitStack() as shown:

        def on_window(share: float, iterations: int) -> None:
            nonlocal bar
            if bar is None and time.monotonic() - began >= _PATIENCE:
                bar = shown.enter_context(progress(100.0, "%", label))
            if bar is not None:
                bar.move(100.0 * share, note=f"iteration {iterations}")

        yield on_window


_SAME: Final = 1e-3
"""Largest difference of two poses that count as one, m and rad: less than a plan's distance from limits."""


class Optimum(Policy):
    """The offline optimum: the best accelerations for a drive that is known from beginning to end.

    Args:
        platform: The machine; default: the paper's.
        options: The problem.
        vestibular: The driver's perception, for the objective "perceived"; default: Zacharias'.
        cached: Whether plans are stored on disk and loaded again.
        progress: Whether a long solve shows a bar on a terminal.
    """

    information = WHOLE_DRIVE

    def __init__(
        self,
        platform: Platform | None = None,
        options: OptimumOptions | None = None,
        vestibular: VestibularModel | None = None,
        cached: bool = True,
        progress: bool = True,
    ) -> None:
        self.platform: Platform = platform or get_platform("paper")
        self.parameters = options or OptimumOptions()
        self.vestibular = vestibular or get_vestibular_model("zacharias")
        self.name = "optimum" if self.parameters.objective == "J" else "optimum-perceived"
        self._cached, self._progress = cached, progress

    def for_drive(self, cues: CueTrace) -> PlannedDrive:
        """The policy for one drive, at the time step of the rollout: solved here, or loaded from disk.

        Raises:
            ConfigurationError: the cues are no CueTrace.
        """
        if not isinstance(cues, CueTrace):
            raise ConfigurationError(
                f"cues must be a CueTrace, found {type(cues).__name__}; get_maneuver(name).drive()"
            )
        return PlannedDrive(self, cues)

    def plan(self, cues: CueTrace, start: ArrayLike | None = None) -> Plan:
        """The plan for a drive.

        Args:
            cues: The drive, at the machine's time step.
            start: (9,) pose to begin at; default: neutral.

        Raises:
            DataError: the start lies outside the machine's travel.
        """
        pose = np.zeros(N_AXES) if start is None else np.array(start, dtype=np.float64)
        key = key_of(self.platform, self.parameters, self.vestibular, cues, pose)
        stored = load_plan(key, len(cues) - 1) if self._cached else None
        if stored is not None:
            return stored
        with solve_progress(f"{self.name}: {cues.name}", self._progress) as on_window:
            planner = Planner(self.platform, self.parameters, self.vestibular, cues, pose, on_window)
            plan = planner.plan()
        if self._cached:
            store_plan(key, plan)
        return plan


class PlannedDrive(Policy):
    """Plays the plan for one drive. A machine that begins elsewhere than planned gets a plan of its own."""

    information = WHOLE_DRIVE

    def __init__(self, optimum: Optimum, cues: CueTrace) -> None:
        self.name, self.parameters = optimum.name, optimum.parameters
        self.plan = optimum.plan(cues)
        self._optimum, self._cues = optimum, cues

    @property
    def statistics(self) -> Mapping[str, str]:
        """Report of the solve, for a trajectory's metadata."""
        return self.plan.report.notes()

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[NDArray[np.float64], Any]:
        """The next accelerations of the plan; none after its end. The state is the number of steps done.

        Of the observations of one machine only the first matters.

        Raises:
            DataError: an argument has the wrong type or shape, or the observation is not finite.
            ConfigurationError: the observation has more than one row: a plan is for one machine.
        """
        rows = np.asarray(checked_observation(observation), dtype=np.float64)
        if rows.size != OBSERVATION_SIZE:
            raise ConfigurationError(
                f"a plan is for one machine: the observation must have {OBSERVATION_SIZE} entries, found "
                f"shape {rows.shape}"
            )
        step = _checked_state(state)
        begins = state is None or (
            episode_start is not None and bool(checked_episode_start(episode_start, 1)[0])
        )
        if begins:
            step, pose = 0, pose_of(rows.reshape(-1))
            if np.abs(pose - self.plan.start).max() > _SAME:
                self.plan = self._optimum.plan(self._cues, pose)
        within = step < len(self.plan.accelerations)
        action = self.plan.accelerations[step] if within else np.zeros(N_AXES)
        return action.reshape((*rows.shape[:-1], N_AXES)).copy(), step + 1


def _checked_state(state: Any) -> int:
    """The number of steps done; 0 for None."""
    if state is None:
        return 0
    if isinstance(state, bool) or not isinstance(state, int) or state < 0:
        raise wrong_state(state, 1)
    return state


def pose_of(observation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(9,) positions in an observation, the turntable's angle within half a turn."""
    sine, cosine = read(observation, "turntable")
    parts = [read(observation, name) for name in ("carriage", "displacement", "beta")]
    return np.concatenate([*parts, [np.arctan2(sine, cosine)]])
