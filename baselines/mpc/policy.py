"""Model predictive control as a policy: a new plan over the horizon at every step.

1. Read the state of the machine and the reference cue from the observation (:func:`read_measurement`).
2. Update the sustained cue and the vestibular filters (:class:`Memory`).
3. Forecast the reference cue, linearize about the last plan, solve (:class:`.solver.Planner`).
4. Do the mean acceleration of the plan over the next time step. Without a plan, brake (:class:`Brakes`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ...envs.simulator.kernels.observation import read
from ...envs.simulator.simulator import N_AXES, TIME_STEP
from ..policy import (
    Array,
    Information,
    Policy,
    Starts,
    checked_episode_start,
    checked_observation,
    wrong_state,
)
from ..symbolic import SymbolicMachine, cs
from .parameters import MpcParameters
from .prediction import REST, Floats, Forecaster
from .solver import Plan, Planner, Rows, moving_axes

try:
    from threadpoolctl import ThreadpoolController
except ImportError:
    raise ConfigurationError(
        "this controller needs threadpoolctl, which is not installed: "
        "pip install 'motion-cueing-gym[optimal]'"
    ) from None

_NEWTON_STEPS: Final = 3
"""Newton's steps to the platform's accelerations; each squares the error."""

_LEAST_SINGULAR_VALUE: Final = 1e-3
"""Of the Jacobian, relative to the largest: directions in which legs move less are not corrected."""

_BRAKING: Final = 1.0 - 1e-6
"""Share of the acceleration limits to brake with, so that rounding does not exceed them."""

_RELAXED: Final = 1e-3
"""Violation of a linearized limit from which on a plan counts as relaxed, share of half its range."""


class Brakes:
    """Emergency braking: every actuator comes to rest by itself, as fast as its acceleration limit allows.

    So each leg stops where its own limits say it can. The platform's accelerations follow from the leg rates
    at the end of the step, by Newton's method.
    """

    def __init__(self, platform: Platform) -> None:
        machine = SymbolicMachine(platform)
        q, v, a = (cs.SX.sym(name, N_AXES) for name in ("q", "v", "a"))
        after = machine.leg_rates(q + TIME_STEP * v + 0.5 * TIME_STEP**2 * a, v + TIME_STEP * a)
        self._after = cs.Function("after", [q, v, a], [after, cs.jacobian(after, a[2:8])])
        self._rates = machine.leg_rates
        self._change = _BRAKING * TIME_STEP * machine.limits["acceleration"]
        self._moving = np.isin(np.arange(N_AXES), moving_axes(platform))

    def __call__(self, position: Floats, rate: Floats) -> Floats:
        """(9,) accelerations for the next time step, from positions and rates (9,) of the axes."""
        legs = np.asarray(self._rates(position, rate))[:, 0]
        actuators = np.concatenate([rate[:2], legs, rate[8:]])
        reference = actuators - np.clip(actuators, -self._change, self._change)
        action = (reference - actuators) / TIME_STEP
        action[2:8] = 0.0
        for _ in range(_NEWTON_STEPS):
            after, slope = (np.asarray(part) for part in self._after(position, rate, action))
            # Least squares: near a singular pose no accelerations give the legs all of their rates.
            action[2:8] += np.linalg.lstsq(slope, reference[2:8] - after[:, 0], rcond=_LEAST_SINGULAR_VALUE)[
                0
            ]
        return np.asarray(np.where(self._moving, action, 0.0))


@dataclass(frozen=True)
class Measurement:
    """Measured positions and rates (9,), reference cue and cue error (6,), SI."""

    position: Floats
    rate: Floats
    reference: Floats
    error: Floats


def read_measurement(row: NDArray[Any], angle: float) -> Measurement:
    """The measurement in an observation.

    Args:
        row: (OBSERVATION_SIZE,) of one machine.
        angle: Unwound angle of the turntable a time step ago, rad; the measured one is taken nearest to it.
    """
    sine, cosine = read(row, "turntable")
    measured = float(np.arctan2(sine, cosine))
    turned = measured + 2.0 * np.pi * round((angle - measured) / (2.0 * np.pi))
    position = [*(read(row, name) for name in ("carriage", "displacement", "beta")), np.array([turned])]
    rate = [read(row, name) for name in ("carriage_rate", "velocity", "beta_rate", "turntable_rate")]
    reference = np.concatenate([read(row, "reference_force"), read(row, "reference_rate")])
    simulated = np.concatenate([read(row, "simulator_force"), read(row, "simulator_rate")])
    # Observed forces have gravity at rest taken off.
    error = simulated - reference
    return Measurement(np.concatenate(position), np.concatenate(rate), reference + REST, error)


@dataclass(frozen=True)
class Memory:
    """State of the controller of one machine.

    Args:
        sample: Number of the sample, from the start of the drive.
        angle: Turntable angle, unwound, rad.
        plan: (n, 9) accelerations at the nodes when the plan was made.
        age: Time steps since.
        solved: Whether there is a plan.
        active: Limits that held in it.
        error: (6,) cue error in the last step.
        sustained: (6,) sustained part of the reference cue; None at the start.
        vestibular: (6, 3) states of the vestibular filters.
    """

    sample: int
    angle: float
    plan: Floats
    age: int
    solved: bool
    active: Rows
    error: Floats
    sustained: Floats | None
    vestibular: Floats


@dataclass
class Counts:
    """Statistics of a drive.

    Args:
        solves: Plans made.
        failures: Plans without a solution; the machine braked.
        iterations: Quadratic programs solved.
        rounds: Dual programs solved.
        unconverged: Nonlinear plans that did not converge.
        relaxed: Plans in which a linearized limit could not be kept.
    """

    solves: int = 0
    failures: int = 0
    iterations: int = 0
    rounds: int = 0
    unconverged: int = 0
    relaxed: int = 0

    def add(self, plan: Plan) -> None:
        """Count a plan."""
        self.solves += 1
        self.failures += not plan.solved
        self.iterations += plan.iterations
        self.rounds += plan.rounds
        self.unconverged += not plan.converged
        self.relaxed += plan.relaxed > _RELAXED


class PredictiveController(Policy):
    """Model predictive control, linear or nonlinear.

    Args:
        platform: The machine.
        parameters: Of the controller.
        name: In tables.
        planner: Of the same machine and parameters, to share it among drives; default: a new one.
        cues: The drive, where some of it is known.
    """

    def __init__(
        self,
        platform: Platform,
        parameters: MpcParameters,
        name: str = "mpc",
        planner: Planner | None = None,
        cues: CueTrace | None = None,
    ) -> None:
        self.name, self.time_step, self.parameters = name, TIME_STEP, parameters
        self.platform: Platform = platform
        self.information = Information.ahead(parameters.forecast.preview)
        self._planner = planner or Planner(platform, parameters)
        self._forecast = Forecaster(self._planner.grid, parameters.forecast, cues)
        self._brakes = Brakes(platform)
        self._counts = Counts()
        # BLAS shares a product among all cores. For matrices of this size that gains nothing on an idle
        # machine, and on a busy one the threads wait for each other: 130 ms instead of 1 ms was measured.
        self._blas: Any = ThreadpoolController()

    @property
    def statistics(self) -> Mapping[str, str]:
        """Statistics of the drive so far, for a trajectory's metadata."""
        return {f"mpc_{name}": str(value) for name, value in vars(self._counts).items()}

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[Array, Any]:
        """Accelerations; see :meth:`~..policy.Policy.predict`. The state is a memory for each machine.

        Raises:
            DataError: an argument has the wrong type or shape, or the observation is not finite.
        """
        observation = np.asarray(checked_observation(observation), dtype=np.float64)
        rows = np.atleast_2d(observation)
        memories = _checked_state(state, len(rows))
        begins = np.zeros(len(rows), dtype=np.bool_)
        if episode_start is not None:
            begins = checked_episode_start(episode_start, len(rows))
        if begins.all():
            self._counts = Counts()
        with self._blas.limit(limits=1, user_api="blas"):
            answers = [
                self._act(row, None if begin else memory)
                for row, begin, memory in zip(rows, begins, memories, strict=True)
            ]
        actions = np.array([action for action, _ in answers]).reshape(*observation.shape[:-1], N_AXES)
        return actions, [memory for _, memory in answers]

    def _act(self, row: NDArray[Any], memory: Memory | None) -> tuple[Floats, Memory]:
        memory = memory or Memory(
            sample=0,
            angle=0.0,
            plan=np.zeros((len(self._planner.grid.times), N_AXES)),
            age=0,
            solved=False,
            active=np.zeros(0, dtype=np.intp),
            error=np.zeros(6),
            sustained=None,
            vestibular=self._planner.perceived.start(),
        )
        measured = read_measurement(row, memory.angle)
        sustained = self._forecast.update(memory.sustained, measured.reference)
        memory = replace(
            memory,
            angle=measured.position[8],
            vestibular=self._planner.perceived.advance(memory.vestibular, memory.error, measured.error),
            error=measured.error,
            sustained=sustained,
        )
        if memory.age >= self.parameters.every or not memory.solved:
            memory = self._plan(measured, memory, sustained)
        action = self._action(measured, memory)
        return action, replace(memory, sample=memory.sample + 1, age=memory.age + 1)

    def _plan(self, measured: Measurement, memory: Memory, sustained: Floats) -> Memory:
        grid = self._planner.grid
        plan = self._planner(
            measured.position,
            measured.rate,
            self._forecast(measured.reference, sustained, memory.sample),
            grid.at(memory.plan, grid.times + TIME_STEP * memory.age),
            memory.active,
            self._planner.perceived.free_response(memory.vestibular, measured.error),
        )
        self._counts.add(plan)
        acceleration = plan.motion.acceleration if plan.solved else np.zeros_like(memory.plan)
        return replace(memory, plan=acceleration, age=0, solved=plan.solved, active=plan.active)

    def _action(self, measured: Measurement, memory: Memory) -> Floats:
        """The mean acceleration of the plan over the next time step; braking without a plan."""
        if not memory.solved:
            return self._brakes(measured.position, measured.rate)
        middle = TIME_STEP * (memory.age + 0.5)
        return np.asarray(self._planner.grid.at(memory.plan, np.array([middle]))[0])


def _checked_state(state: Any, n: int) -> list[Memory] | list[None]:
    """The memories of n machines."""
    if state is None:
        return [None] * n
    if not isinstance(state, list) or len(state) != n or not all(isinstance(s, Memory) for s in state):
        raise wrong_state(state, n)
    return state


class PreviewController(Policy):
    """Model predictive control with preview: it needs the drive before it begins."""

    def __init__(self, platform: Platform, parameters: MpcParameters, name: str = "mpc-preview") -> None:
        self.name, self.time_step, self.parameters = name, TIME_STEP, parameters
        self.platform: Platform = platform
        self.information = Information.ahead(parameters.forecast.preview)
        self._planner = Planner(platform, parameters)

    def for_drive(self, cues: CueTrace) -> PredictiveController:
        """The policy for one drive, at the machine's time step."""
        return PredictiveController(self.platform, self.parameters, self.name, self._planner, cues)


def make_mpc(
    platform: Platform, parameters: MpcParameters | None = None, name: str = "mpc"
) -> PredictiveController | PreviewController:
    """Model predictive control for a machine, with preview where the parameters have one; default: none."""
    parameters = parameters or MpcParameters()
    kind = PreviewController if parameters.forecast.preview > 0.0 else PredictiveController
    return kind(platform, parameters, name)
