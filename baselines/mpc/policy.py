"""Model predictive control as a policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.platform import Platform
from ...envs.simulator import N_AXES, TIME_STEP
from ..policy import Array, checked_episode_start, checked_observation, wrong_state
from .braking import Brakes
from .forecast import Forecaster
from .linearisation import Floats
from .memory import Counts, Memory, Moment, moment_of
from .parameters import MpcParameters
from .planner import Planner
from .threads import OneThread


class PredictiveController:
    """A policy that makes a plan at every step and does the beginning of it.

    Args:
        platform: The machine.
        parameters: Of the controller.
        planner: Makes the plans.
        name: In tables.
        configuration: For the record, where it is more than ``parameters``.
        cues: The drive, where some of it is known.
    """

    def __init__(
        self,
        platform: Platform,
        parameters: MpcParameters,
        planner: Planner,
        name: str,
        configuration: Any = None,
        cues: CueTrace | None = None,
    ) -> None:
        self.name, self.dt = name, TIME_STEP
        self.parameters = configuration or parameters
        self._mpc, self._planner = parameters, planner
        self._forecast = Forecaster(planner.grid, parameters.forecast, cues)
        self._brakes = Brakes(platform)
        self._counts = Counts()
        self._one_thread = OneThread()

    @property
    def notes(self) -> Mapping[str, str]:
        """What was counted so far, for a trajectory's metadata."""
        return {f"mpc_{name}": str(value) for name, value in vars(self._counts).items()}

    def predict(
        self,
        observation: Array,
        state: Any = None,
        episode_start: Array | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, Any]:
        """Accelerations; see :meth:`~..policy.Policy.predict`. The state is a memory for each machine.

        Raises:
            DataError: an argument has the wrong type or shape, or the observation is not finite.
        """
        observation = np.asarray(checked_observation(observation), dtype=np.float64)
        rows = np.atleast_2d(observation)
        known = _checked_state(state, len(rows))
        begins = np.zeros(len(rows), dtype=np.bool_)
        if episode_start is not None:
            begins = checked_episode_start(episode_start, len(rows))
        if begins.all():
            self._counts = Counts()
        with self._one_thread():
            answers = [
                self._act(row, None if begin else memory)
                for row, begin, memory in zip(rows, begins, known, strict=True)
            ]
        actions = np.array([action for action, _ in answers]).reshape(*observation.shape[:-1], N_AXES)
        return actions, [memory for _, memory in answers]

    def _act(self, row: NDArray[Any], memory: Memory | None) -> tuple[Floats, Memory]:
        memory = self._begun() if memory is None else memory
        moment = moment_of(row, memory.angle)
        sensors = self._planner.perception.advance(memory.sensors, memory.error, moment.error)
        lasts = self._forecast.remember(memory.lasts, moment.wanted)
        memory = replace(memory, angle=moment.position[8], sensors=sensors, error=moment.error, lasts=lasts)
        if memory.age >= self._mpc.every or not memory.solved:
            memory = self._plan(moment, memory, lasts)
        action = self._action(moment, memory)
        return action, replace(memory, sample=memory.sample + 1, age=memory.age + 1)

    def _begun(self) -> Memory:
        n = len(self._planner.grid.times)
        return Memory(
            sample=0,
            angle=0.0,
            plan=np.zeros((n, N_AXES)),
            age=0,
            solved=False,
            active=np.zeros(0, dtype=np.intp),
            error=np.zeros(6),
            lasts=None,
            sensors=self._planner.perception.start(),
        )

    def _plan(self, moment: Moment, memory: Memory, lasts: Floats) -> Memory:
        grid = self._planner.grid
        planned = self._planner(
            moment.position,
            moment.rate,
            self._forecast(moment.wanted, lasts, memory.sample),
            grid.at(memory.plan, grid.times + TIME_STEP * memory.age),
            memory.active,
            self._planner.perception.memory(memory.sensors, moment.error),
        )
        self._counts.add(planned)
        plan = planned.plan.acceleration if planned.solved else np.zeros_like(memory.plan)
        return replace(memory, plan=plan, age=0, solved=planned.solved, active=planned.active)

    def _action(self, moment: Moment, memory: Memory) -> Floats:
        """The mean acceleration of the plan over the next time step; braking without a plan."""
        if not memory.solved:
            return self._brakes(moment.position, moment.rate)
        middle = TIME_STEP * (memory.age + 0.5)
        return np.asarray(self._planner.grid.at(memory.plan, np.array([middle]))[0])


def _checked_state(state: Any, n: int) -> list[Memory] | list[None]:
    """What is known of n machines."""
    if state is None:
        return [None] * n
    if not isinstance(state, list) or len(state) != n or not all(isinstance(s, Memory) for s in state):
        raise wrong_state(state, n)
    return state


class PreviewController:
    """A predictive controller that is told the drive, and looks ahead as far as its preview goes.

    Args:
        platform: The machine.
        parameters: Of the controller.
        planner: Makes the plans.
        name: In tables.
        configuration: For the record, where it is more than ``parameters``.
    """

    def __init__(
        self,
        platform: Platform,
        parameters: MpcParameters,
        planner: Planner,
        name: str,
        configuration: Any = None,
    ) -> None:
        self.name, self.dt = name, TIME_STEP
        self.parameters = configuration or parameters
        self._platform, self._mpc, self._planner = platform, parameters, planner

    def for_drive(self, cues: CueTrace) -> PredictiveController:
        """The policy for one drive.

        Args:
            cues: The drive, at the machine's time step.
        """
        return PredictiveController(
            self._platform, self._mpc, self._planner, self.name, self.parameters, cues
        )


def make_controller(
    platform: Platform, parameters: MpcParameters, planner: Planner, name: str, configuration: Any = None
) -> PredictiveController | PreviewController:
    """The policy with or without preview; arguments as of :class:`PreviewController`."""
    kind = PreviewController if parameters.forecast.preview > 0.0 else PredictiveController
    return kind(platform, parameters, planner, name, configuration)


def make_mpc(
    platform: Platform, parameters: MpcParameters | None = None, name: str = "mpc"
) -> PredictiveController | PreviewController:
    """Linear time-varying predictive control: the machine is linearised once a plan, about the last plan.

    Args:
        platform: The machine.
        parameters: Of the controller; default: without preview.
        name: In tables.
    """
    parameters = parameters or MpcParameters()
    return make_controller(platform, parameters, Planner(platform, parameters), name)
