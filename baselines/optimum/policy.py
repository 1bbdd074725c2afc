"""How far a solve has come, on a terminal; nothing elsewhere, or where it is soon done."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError
from ...envs.perception import VestibularModel, get_vestibular_model
from ...envs.platform import Platform, get_platform
from ...envs.simulator.kernels.observation import OBSERVATION_SIZE, read
from ...envs.simulator.simulator import N_AXES
from ..policy import WHOLE_DRIVE, Policy, checked_episode_start, checked_observation, wrong_state
from .plan import Plan, find, keep, key_of
from .program import OptimumOptions
from .windows import Planner

_PATIENCE: Final = 2.0
"""Time after which something is shown, s."""

OnWindow = Callable[[float, int], None]


class SolveProgress:
    """A bar over the windows of a drive, with the iterations in the one at hand.

    Args:
        label: What is solved.
        wanted: Whether to show it at all: a command that has a bar of its own does without.
    """

    def __init__(self, label: str, wanted: bool = True) -> None:
        self._label, self._began = label, time.monotonic()
        self._wanted = wanted and sys.stderr.isatty()
        self._shown: Progress | None = None

    @property
    def tell(self) -> OnWindow | None:
        """Called with the share that is done and the iterations; None where nothing is shown."""
        return self._tell if self._wanted else None

    def __enter__(self) -> SolveProgress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._shown is not None:
            self._shown.stop()

    def _tell(self, share: float, iterations: int) -> None:
        if time.monotonic() - self._began < _PATIENCE:
            return
        if self._shown is None:
            self._shown = _bar()
            self._shown.start()
            self._shown.add_task(self._label, total=1.0, iterations=0)
        self._shown.update(self._shown.task_ids[0], completed=share, iterations=iterations)
        self._shown.refresh()


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("iteration {task.fields[iterations]}"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,
    )


# The offline optimum as a policy: it is told the whole drive, and plays its plan.


_SAME: Final = 1e-3
"""Largest difference of two poses taken for one, m and rad: less than plans keep from the limits."""


class Optimum(Policy):
    """The best accelerations there are for a drive that is known from beginning to end.

    Args:
        platform: The machine; default: the paper's.
        options: The problem.
        vestibular: The driver's perception, for the objective "perceived"; default: Zacharias'.
        cached: Whether plans are kept on disk and found again.
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
        """The policy for one drive: solved here, or found among the plans kept.

        Args:
            cues: The drive, at the time step of the rollout.

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
        found = find(key, len(cues) - 1) if self._cached else None
        if found is not None:
            return found
        with SolveProgress(f"{self.name}: {cues.name}", self._progress) as progress:
            planner = Planner(self.platform, self.parameters, self.vestibular, cues, pose, progress.tell)
            plan = planner.plan()
        if self._cached:
            keep(key, plan)
        return plan


class PlannedDrive(Policy):
    """Plays the plan for one drive. A machine that begins elsewhere than planned gets a plan of its own.

    Args:
        optimum: Makes plans.
        cues: The drive.
    """

    information = WHOLE_DRIVE

    def __init__(self, optimum: Optimum, cues: CueTrace) -> None:
        self.name, self.parameters = optimum.name, optimum.parameters
        self.plan = optimum.plan(cues)
        self._optimum, self._cues = optimum, cues

    @property
    def statistics(self) -> Mapping[str, str]:
        """How the plan was found."""
        return self.plan.account.notes()

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float64], Any]:
        """The next accelerations of the plan; none after its end.

        Args:
            observation: (1, OBSERVATION_SIZE) or (OBSERVATION_SIZE,); only the first one matters.
            state: The number of steps done; None at first.
            episode_start: (1,) whether the drive begins anew.
            deterministic: No effect.

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
        done = _checked_state(state)
        begins = state is None or (
            episode_start is not None and bool(checked_episode_start(episode_start, 1)[0])
        )
        step = 0 if begins else done
        if begins:
            self._begin_at(pose_of(rows.reshape(-1)))
        within = step < len(self.plan.accelerations)
        answer = self.plan.accelerations[step] if within else np.zeros(N_AXES)
        return answer.reshape((*rows.shape[:-1], N_AXES)).copy(), step + 1

    def _begin_at(self, pose: NDArray[np.float64]) -> None:
        if np.abs(pose - self.plan.start).max() > _SAME:
            self.plan = self._optimum.plan(self._cues, pose)


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
