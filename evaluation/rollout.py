"""The motion base an agent was made for, and those it may drive."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..baselines.policy import ForeknowingPolicy, Policy, start_of
from ..envs.arrays import real
from ..envs.car import Car
from ..envs.cues import CueTrace
from ..envs.errors import ActionError, ConfigurationError
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform, actuator_limits, get_platform
from ..envs.settings import to_dict
from ..envs.simulator.kernels.observation import OBSERVATION_SIZE, observe_forward
from ..envs.simulator.simulator import N_AXES, TIME_STEP, Simulator
from ..envs.task import EpisodeOptions, RandomizationOptions, TaskOptions
from ..envs.task.batch import Batch
from ..envs.task.drives import platform_of
from .trajectory import LimitTable, Trajectory

Anyone = TypeVar("Anyone")
"""A :class:`~.drivers.TaskPolicy`."""


def on_machine(policy: Anyone, platform: Platform) -> Anyone:
    """A policy on a machine: one that is told its machine (``observation.machine``) is told this one.

    Args:
        policy: With a ``task``; one that goes elsewhere has ``on(platform)``, as an agent.
        platform: The machine.

    Raises:
        ConfigurationError: the policy was made for another machine, and is not told which it has.
    """
    own: Any = policy
    if own.task.observation.machine and callable(getattr(own, "on", None)):
        return own.on(platform)  # type: ignore[no-any-return]
    check_machine(policy, platform)
    return policy


def check_machine(policy: Any, platform: Platform) -> None:
    """Refuse a machine that a policy was not made for.

    Raises:
        ConfigurationError: the machine is another one.
    """
    own = platform_of(policy.task)
    if own != platform:
        name = getattr(policy, "name", type(policy).__name__)
        raise ConfigurationError(
            f"{name} was made for the motion base {own.name!r}, not {platform.name!r}; evaluate it on "
            f"{own.name!r}, or force it, in Python: agent.on(get_platform({platform.name!r}))"
        )


# What takes a machine through a drive, time step by time step: a policy, or one with its environment.


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
        task, vestibular=vestibular.name, episode=EpisodeOptions(), randomization=RandomizationOptions()
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


# Keeps what a drive gave, and makes a trajectory of it.


_ABOUT: Final = ("parameters", "vestibular", "source")
"""Metadata of every trajectory; what else there is a policy noted."""


def notes_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """What a policy counted in a drive, such as solves that did not converge, by the drive's metadata."""
    return {name: text for name, text in metadata.items() if name not in _ABOUT}


@dataclass(frozen=True)
class Recording:
    """What a drive gave; row k is the machine at sample k, row 0 the start.

    Args:
        states: (n,) rows of ``Simulator.state``.
        actions: (n, 9) accelerations asked for in the step that ended at a row.
        seconds: (n,) wall-clock time of the policy; NaN where it was not asked.
    """

    states: NDArray[Any]
    actions: NDArray[np.float64]
    seconds: NDArray[np.float64]


def record(driver: Driver, start: ArrayLike, on_step: Callable[[int, int], None] | None = None) -> Recording:
    """Run a driver from a pose (9,) to the end of its drive.

    Args:
        driver: The driver.
        start: Pose to begin at.
        on_step: Called with the steps done and the steps in all.
    """
    n = len(driver.simulator.drives[0])
    states = np.zeros(n, dtype=driver.simulator.state.dtype)
    actions, seconds = np.zeros((n, N_AXES)), np.full(n, np.nan)
    states[0] = driver.begin(start)
    for k, sample in zip(range(1, n), driver.samples(), strict=False):
        actions[k], states[k], seconds[k] = sample
        if on_step is not None:
            on_step(k, n - 1)
    return Recording(states, actions, seconds)


def trajectory_of(
    recording: Recording, driver: Driver, policy: Any, cues: CueTrace, car: Car | None
) -> Trajectory:
    """The trajectory of a recorded drive.

    Args:
        recording: The drive.
        driver: That drove it.
        policy: For its name, its parameters, and its ``notes``: what it counted, as text.
        cues: That were driven.
        car: That was driven, for the record.
    """
    states, platform = recording.states, driver.simulator.platforms[0]
    motion, simulated, reference = states["motion"], states["simulator_cue"], states["reference_cue"]
    shifts = np.arange(0, 36, 4, dtype=np.uint64)
    limits = actuator_limits(platform)
    parameters = getattr(policy, "parameters", None)
    return Trajectory(
        maneuver=cues.name,
        policy=str(getattr(policy, "name", type(policy).__name__)),
        platform=platform.name,
        car=car.name if car else cues.source or cues.name,
        time=cues.time,
        f_reference=reference["force"],
        w_reference=reference["rate"],
        head_f_reference=reference["head_force"],
        f_simulator=simulated["force"],
        w_simulator=simulated["rate"],
        head_f_simulator=simulated["head_force"],
        perceived_f_reference=states["perceived_reference"]["force"],
        perceived_w_reference=states["perceived_reference"]["rate"],
        perceived_f_simulator=states["perceived_simulator"]["force"],
        perceived_w_simulator=states["perceived_simulator"]["rate"],
        carriage=motion["position"][:, :2],
        carriage_rate=motion["rate"][:, :2],
        hexapod=np.hstack([motion["displacement"], motion["beta"]]),
        hexapod_rate=np.hstack([motion["velocity"], motion["beta_rate"]]),
        turntable=motion["position"][:, 8],
        turntable_rate=motion["rate"][:, 8],
        legs=motion["position"][:, 2:8],
        legs_rate=motion["rate"][:, 2:8],
        action=recording.actions,
        applied=states["acceleration"],
        limits_active=((states["limits"][:, None] >> shifts) & np.uint64(0xF)).astype(np.uint8),
        step_time=recording.seconds,
        limits=LimitTable(**limits),
        metadata={
            "parameters": json.dumps(to_dict(parameters)) if parameters is not None else "{}",
            "vestibular": driver.simulator.vestibular.name,
            "source": cues.source,
            **getattr(policy, "notes", {}),
        },
    )


# A policy that stands before another one, and is to the rollout what that one is.


_OWN: Final = ("start", "dt")
"""Attributes that a policy may have, and that then hold for whatever stands before it."""


class Wrapped:
    """What a rollout asks a policy for beside its answers, taken from another one.

    Args:
        policy: The other one.
    """

    name: str
    parameters: Any

    def __init__(self, policy: Any) -> None:
        self._inner = policy
        self.name = getattr(policy, "name", type(policy).__name__)
        self.parameters = getattr(policy, "parameters", None)
        for attribute in _OWN:
            if hasattr(policy, attribute):
                setattr(self, attribute, getattr(policy, attribute))

    @property
    def notes(self) -> Mapping[str, str]:
        """What the policy has counted by now."""
        return getattr(self._inner, "notes", {})


# One policy through one drive: the loop every figure in this project comes from.


AnyPolicy = Policy | TaskPolicy | ForeknowingPolicy
"""Whatever :func:`rollout` takes through a drive."""


def rollout(
    policy: AnyPolicy,
    cues: CueTrace,
    platform: Platform | None = None,
    car: Car | None = None,
    *,
    start: ArrayLike | None = None,
    vestibular: VestibularModel | None = None,
    dt: float = TIME_STEP,
    on_step: Callable[[int, int], None] | None = None,
) -> Trajectory:
    """Drive a machine through a cue trace with a policy.

    Args:
        policy: Anything with ``predict``. One with a ``task``, as an agent has, sees the observations of
            that environment and acts in it; any other sees ``envs.simulator.kernels.observation`` and
            asks for accelerations.
            One with ``for_drive`` is told the cues first. Its ``notes``, if any, become metadata.
        cues: The drive; another time step is resampled.
        platform: The machine; default: that of the policy's task, or the paper's.
        car: The car that was driven, for the record.
        start: (9,) pose to begin at; default: the policy's ``start``, or neutral.
        vestibular: Perception model; default: Zacharias'.
        dt: Time step, s.
        on_step: Called with the steps done and the steps in all.

    Raises:
        ActionError: the policy returned something else than as many finite numbers as expected and a state.
        ConfigurationError: an argument is of the wrong type, or the policy was made for another time step,
            machine or perception model.
    """
    if not isinstance(cues, CueTrace):
        raise ConfigurationError(
            f"cues must be a CueTrace, found {type(cues).__name__}; get_maneuver(name).drive()"
        )
    if platform is not None and not isinstance(platform, Platform):
        raise ConfigurationError(
            f"platform must be a Platform, found {type(platform).__name__}; get_platform(name)"
        )
    cues = cues.resampled(dt)
    if isinstance(policy, ForeknowingPolicy):
        policy = policy.for_drive(cues)
    driver = make_driver(policy, cues, platform, vestibular or get_vestibular_model("zacharias"), dt)
    recording = record(driver, start_of(policy) if start is None else start, on_step)
    return trajectory_of(recording, driver, policy, cues, car)
