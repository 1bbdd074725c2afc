"""What takes a machine through a drive, time step by time step: a policy, or one with its environment."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..baselines.policy import Policy
from ..envs.cues import CueTrace
from ..envs.errors import ActionError, ConfigurationError
from ..envs.observation import OBSERVATION_SIZE, observe_forward
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform, get_platform
from ..envs.precision import real
from ..envs.simulator import N_AXES, TIME_STEP, Simulator
from ..envs.task import EpisodeOptions, RandomisationOptions, TaskOptions
from ..envs.task.batch import Batch
from .own_machine import on_machine

Floats = NDArray[np.float64]


@runtime_checkable
class TaskPolicy(Protocol):
    """A policy for an environment: sees its observations, and answers with its actions in [-1, 1].

    A washout under it, where the action mode needs one, is its attribute ``base_policy``.
    """

    @property
    def task(self) -> TaskOptions:
        """The environment."""
        ...

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """Actions (n, k) for observations (n, size), and the next state."""
        ...


class Sample(NamedTuple):
    """What a time step gave.

    Args:
        action: (9,) accelerations asked for, m/s^2 and rad/s^2.
        state: One row of ``Simulator.state`` after it, valid until the next step.
        seconds: Wall-clock time the policy took; NaN where it held its last action.
    """

    action: Floats
    state: NDArray[Any]
    seconds: float


class Driver(Protocol):
    """A machine at rest in a drive, and what moves it."""

    @property
    def simulator(self) -> Simulator:
        """With the machine."""
        ...

    def begin(self, start: ArrayLike) -> NDArray[Any]:
        """Put the machine at rest at a pose (9,); returns its state."""
        ...

    def samples(self) -> Iterator[Sample]:
        """One time step after another, without end."""
        ...


class Asked:
    """A policy with its memory."""

    def __init__(self, policy: Policy | TaskPolicy, size: int) -> None:
        self._policy, self._size = policy, size
        self._memory: Any = None
        self._calls = 0

    def __call__(self, observation: NDArray[Any]) -> tuple[Floats, float]:
        """The (size,) action and the seconds it took."""
        begins = np.full(1, self._calls == 0)
        self._calls += 1
        began = time.perf_counter()
        answer: Any = self._policy.predict(observation, self._memory, begins, deterministic=True)
        seconds = time.perf_counter() - began
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise ActionError(
                f"predict must return (action, state); at step {self._calls} it returned "
                f"{type(answer).__name__}"
            )
        self._memory = answer[1]
        return self._numbers(answer[0]), seconds

    def _numbers(self, action: Any) -> Floats:
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            raise ActionError(f"the policy's action at step {self._calls} is not made of numbers") from None
        if values.shape not in ((1, self._size), (self._size,)):
            raise ActionError(
                f"the policy's action at step {self._calls} has shape {values.shape}, "
                f"expected (1, {self._size})"
            )
        return values.reshape(self._size)


class Observer:
    """Observations of a simulator's environments on the host, (n, OBSERVATION_SIZE)."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._out = wp.zeros((simulator.n, OBSERVATION_SIZE), dtype=real, device=simulator.device)
        self._launches = [self._record(state) for state, _ in simulator.copies]

    def _record(self, state: Any) -> Any:
        """A recorded launch for one of the two copies of the state, which hold in turn."""
        simulator = self._simulator
        return wp.launch(
            observe_forward,
            simulator.n,
            inputs=[simulator.machines, simulator.machine_of, state],
            outputs=[self._out],
            device=simulator.device,
            record_cmd=True,
        )

    def __call__(self) -> NDArray[Any]:
        """The observations now."""
        self._launches[self._simulator.current].launch()
        return np.array(self._out.numpy())


class MachineDriver:
    """A policy that sees the machine and asks for accelerations.

    Args:
        policy: The policy.
        cues: The drive, with the time step ``dt``.
        platform: The machine.
        vestibular: Perception model.
        dt: Time step, s.
    """

    def __init__(
        self, policy: Policy, cues: CueTrace, platform: Platform, vestibular: VestibularModel, dt: float
    ) -> None:
        self.simulator = Simulator(platform, cues, vestibular=vestibular, dt=dt)
        self._ask = Asked(policy, N_AXES)

    def begin(self, start: ArrayLike) -> NDArray[Any]:
        """Put the machine at rest at a pose (9,); returns its state."""
        return self.simulator.reset(start)[0]  # type: ignore[no-any-return]

    def samples(self) -> Iterator[Sample]:
        """One time step after another, without end."""
        observe = Observer(self.simulator)
        while True:
            action, seconds = self._ask(observe())
            yield Sample(action, self.simulator.step(action)[0], seconds)


class TaskDriver:
    """A policy that sees an environment and acts in it: without noise, randomness or an early end.

    Args:
        policy: The policy.
        cues: The drive, with the environment's time step.
        platform: The machine; None for the policy's own.
        vestibular: Perception model.

    Raises:
        ConfigurationError: the policy was made for another machine or senses with another model.
    """

    def __init__(
        self, policy: TaskPolicy, cues: CueTrace, platform: Platform | None, vestibular: VestibularModel
    ) -> None:
        if platform is not None:
            policy = on_machine(policy, platform)
        task = deterministic(policy.task, vestibular)
        self._batch = Batch(1, task, drives=[cues], base=getattr(policy, "base_policy", None))
        self.simulator = self._batch.simulator
        self._ask = Asked(policy, self._batch.action_size)

    def begin(self, start: ArrayLike) -> NDArray[Any]:
        """Put the machine at rest at a pose (9,); returns its state."""
        everything = np.ones(1, dtype=bool)
        self._batch.begin(everything)
        state = self.simulator.reset(start)[0]
        self._batch.observe(everything)
        return state  # type: ignore[no-any-return]

    def samples(self) -> Iterator[Sample]:
        """One time step after another, without end, also within an action that is held."""
        batch = self._batch
        while True:
            action, seconds = self._ask(batch.arrays.observation.pull().copy())
            batch.write(action[None])
            for k in batch.play():
                yield Sample(batch.asked[0], self.simulator.state[0], seconds if k == 0 else np.nan)


def deterministic(task: TaskOptions, vestibular: VestibularModel) -> TaskOptions:
    """The environment without noise, randomness or an early end.

    Raises:
        ConfigurationError: it senses with another model.
    """
    if task.observation.perceived and get_vestibular_model(task.vestibular) != vestibular:
        raise ConfigurationError(
            f"the policy senses with the vestibular model {task.vestibular!r}, the rollout has "
            f"{vestibular.name!r}; pass vestibular=get_vestibular_model({task.vestibular!r})"
        )
    return replace(
        task, vestibular=vestibular.name, episode=EpisodeOptions(), randomisation=RandomisationOptions()
    )


def make_driver(
    policy: Policy | TaskPolicy,
    cues: CueTrace,
    platform: Platform | None,
    vestibular: VestibularModel,
    dt: float,
) -> Driver:
    """The driver that a policy needs.

    Raises:
        ConfigurationError: the policy was made for another machine, model or time step.
    """
    own = TIME_STEP if isinstance(policy, TaskPolicy) else getattr(policy, "dt", dt)
    if own != dt:
        raise ConfigurationError(f"the policy's time step is {own} s, the rollout's {dt} s")
    if isinstance(policy, TaskPolicy):
        return TaskDriver(policy, cues, platform, vestibular)
    return MachineDriver(policy, cues, platform or get_platform("paper"), vestibular, dt)
