"""Braking to a stop: what a controller does without a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.platform import Platform
from ...envs.simulator.kernels.observation import read
from ...envs.simulator.simulator import N_AXES, TIME_STEP
from ..policy import Array, Information, Policy, checked_episode_start, checked_observation, wrong_state
from ..symbolic import SymbolicMachine, cs
from .parameters import MpcParameters, NmpcParameters
from .prediction import REST, Floats, Forecaster
from .problem import moving_axes
from .solver import OneThread, Planned, Planner, Rows

_ROUNDS: Final = 3
"""Newton's steps to the platform's accelerations; each squares the error."""

_LEAST: Final = 1e-3
"""Of the Jacobian's singular values, relative to the largest: directions in which legs move less are left."""

_SHARE: Final = 1.0 - 1e-6
"""Of the acceleration limits, so that rounding does not exceed them."""


class Brakes:
    """Accelerations that bring every actuator to rest by itself, as fast as its acceleration limit lets it.

    So each leg stops where its own limits say it can; the platform's accelerations are those that give
    the legs their rates at the end of the step.
    """

    def __init__(self, platform: Platform) -> None:
        machine = SymbolicMachine(platform)
        q, v, a = (cs.SX.sym(name, N_AXES) for name in ("q", "v", "a"))
        after = machine.leg_rates(q + TIME_STEP * v + 0.5 * TIME_STEP**2 * a, v + TIME_STEP * a)
        self._after = cs.Function("after", [q, v, a], [after, cs.jacobian(after, a[2:8])])
        self._rates = machine.leg_rates
        self._change = _SHARE * TIME_STEP * machine.limits["acceleration"]
        self._moving = np.isin(np.arange(N_AXES), moving_axes(platform))

    def __call__(self, position: Floats, rate: Floats) -> Floats:
        """(9,) accelerations for the next time step.

        Args:
            position: (9,) of the axes.
            rate: (9,).
        """
        legs = np.asarray(self._rates(position, rate))[:, 0]
        actuators = np.concatenate([rate[:2], legs, rate[8:]])
        reference = actuators - np.clip(actuators, -self._change, self._change)
        action = (reference - actuators) / TIME_STEP
        action[2:8] = 0.0
        for _ in range(_ROUNDS):
            after, slope = (np.asarray(part) for part in self._after(position, rate, action))
            # Least squares: near a singular pose no accelerations give the legs all of their rates.
            action[2:8] += np.linalg.lstsq(slope, reference[2:8] - after[:, 0], rcond=_LEAST)[0]
        return np.asarray(np.where(self._moving, action, 0.0))


# What a predictive controller sees, remembers and counts.


_RELAXED: Final = 1e-3
"""Violation of a linearized limit from which on a plan counts as relaxed, share of half its range."""


@dataclass(frozen=True)
class Moment:
    """What a controller sees: positions and rates (9,), the car's cues and the cues' error (6,), SI."""

    position: Floats
    rate: Floats
    reference: Floats
    error: Floats


def moment_of(row: NDArray[Any], angle: float) -> Moment:
    """What an observation says.

    Args:
        row: (OBSERVATION_SIZE,) of one machine.
        angle: Of the turntable a time step ago; the one measured is the nearest to it, rad.
    """
    sine, cosine = read(row, "turntable")
    measured = float(np.arctan2(sine, cosine))
    turned = measured + 2.0 * np.pi * round((angle - measured) / (2.0 * np.pi))
    position = [*(read(row, name) for name in ("carriage", "displacement", "beta")), np.array([turned])]
    rate = [read(row, name) for name in ("carriage_rate", "velocity", "beta_rate", "turntable_rate")]
    reference = np.concatenate([read(row, "reference_force"), read(row, "reference_rate")])
    simulated = np.concatenate([read(row, "simulator_force"), read(row, "simulator_rate")])
    # Observed forces have gravity at rest taken off.
    return Moment(np.concatenate(position), np.concatenate(rate), reference + REST, simulated - reference)


@dataclass(frozen=True)
class Memory:
    """What a controller knows of one machine.

    Args:
        sample: Of the drive, counted from the start.
        angle: Turntable angle, unwound, rad.
        plan: (n, 9) accelerations at the nodes when it was made.
        age: Time steps since.
        solved: Whether there is a plan.
        active: Limits that held in it.
        error: (6,) of the cues in the last step.
        lasts: (6,) what of the car's cues lasts; None at the start.
        sensors: (6, 3) states of the vestibular filters.
    """

    sample: int
    angle: float
    plan: Floats
    age: int
    solved: bool
    active: Rows
    error: Floats
    lasts: Floats | None
    sensors: Floats


@dataclass
class Counts:
    """What a controller counted.

    Args:
        solves: Plans made.
        failures: Plans that were not found; the machine braked.
        iterations: Programs solved for them.
        rounds: Duals solved for them.
        unconverged: Plans still on the move after their last program, where there may be several.
        relaxed: Plans in which a linearized limit could not be kept.
    """

    solves: int = 0
    failures: int = 0
    iterations: int = 0
    rounds: int = 0
    unconverged: int = 0
    relaxed: int = 0

    def add(self, planned: Planned) -> None:
        """One more."""
        self.solves += 1
        self.failures += not planned.solved
        self.iterations += planned.iterations
        self.rounds += planned.rounds
        self.unconverged += not planned.converged
        self.relaxed += planned.relaxed > _RELAXED


# Model predictive control as a policy.


class PredictiveController(Policy):
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
        self.name, self.time_step = name, TIME_STEP
        self.platform: Platform = platform
        self.parameters = configuration or parameters
        self.information = Information.ahead(parameters.forecast.preview)
        self._mpc, self._planner = parameters, planner
        self._forecast = Forecaster(planner.grid, parameters.forecast, cues)
        self._brakes = Brakes(platform)
        self._counts = Counts()
        self._one_thread = OneThread()

    @property
    def statistics(self) -> Mapping[str, str]:
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
        lasts = self._forecast.remember(memory.lasts, moment.reference)
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
            self._forecast(moment.reference, lasts, memory.sample),
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


class PreviewController(Policy):
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
        self.name, self.time_step = name, TIME_STEP
        self.platform: Platform = platform
        self.parameters = configuration or parameters
        self.information = Information.ahead(parameters.forecast.preview)
        self._mpc, self._planner = parameters, planner

    def for_drive(self, cues: CueTrace) -> PredictiveController:
        """The policy for one drive.

        Args:
            cues: The drive, at the machine's time step.
        """
        return PredictiveController(self.platform, self._mpc, self._planner, self.name, self.parameters, cues)


def make_controller(
    platform: Platform, parameters: MpcParameters, planner: Planner, name: str, configuration: Any = None
) -> PredictiveController | PreviewController:
    """The policy with or without preview; arguments as of :class:`PreviewController`."""
    kind = PreviewController if parameters.forecast.preview > 0.0 else PredictiveController
    return kind(platform, parameters, planner, name, configuration)


def make_mpc(
    platform: Platform, parameters: MpcParameters | None = None, name: str = "mpc"
) -> PredictiveController | PreviewController:
    """Linear time-varying predictive control: the machine is linearized once a plan, about the last plan.

    Args:
        platform: The machine.
        parameters: Of the controller; default: without preview.
        name: In tables.
    """
    parameters = parameters or MpcParameters()
    return make_controller(platform, parameters, Planner(platform, parameters), name)


# Nonlinear model predictive control: each plan is the solution of the nonlinear program.
#
# The machine's nine axes are double integrators, so shooting from node to node is exact whatever the
# accelerations, and the states are eliminated. What is nonlinear are the cues (rotating frames) and the
# legs; sequential quadratic programming linearizes them again about each new plan until it no longer
# changes, with a search along each change that takes the exact cost and the exact limits.


def make_nmpc(
    platform: Platform, parameters: NmpcParameters | None = None, name: str = "nmpc"
) -> PredictiveController | PreviewController:
    """Nonlinear predictive control.

    Args:
        platform: The machine.
        parameters: Of the controller; default: without preview.
        name: In tables.
    """
    parameters = parameters or NmpcParameters()
    planner = Planner(platform, parameters.mpc, parameters.iterations, parameters.tolerance)
    return make_controller(platform, parameters.mpc, planner, name, parameters)
