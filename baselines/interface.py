"""How a policy sees and moves a batch of machines: the simulator's rows, or the environment's observations.

A policy opens its interface with ``Policy.connect(machines)``. Then, action by action, whoever drives it
calls ``observe``, ``policy.predict`` and ``act``; neither side knows which kind of policy there is.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..envs.arrays import Mirror, real
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.launch import Launch
from ..envs.perception.models import VestibularModel, get_vestibular_model
from ..envs.platform.machines import Platform
from ..envs.simulator.kernels.observation import OBSERVATION_SIZE, SLICES, observe_forward
from ..envs.simulator.simulator import N_AXES, TIME_STEP, Simulator
from ..envs.task.batch import Batch
from ..envs.task.kernels.observation import ObservationOptions
from ..envs.task.options import EpisodeOptions, RandomizationOptions, TaskOptions

Floats = NDArray[np.float64]
Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Machines:
    """n drives, each on its machine.

    Args:
        drives: (n) cue traces of the same time step.
        platforms: The machines in use.
        platform_of: (n,) index of each drive's machine; default: the first.
        vestibular: The driver's perception.
        time_step: s.
    """

    drives: Sequence[CueTrace]
    platforms: Sequence[Platform]
    platform_of: ArrayLike | None = None
    vestibular: VestibularModel = field(default_factory=lambda: get_vestibular_model("zacharias"))
    time_step: float = TIME_STEP


class Observer:
    """Observations of a simulator's environments on the host, (n, OBSERVATION_SIZE)."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._out = wp.zeros((simulator.n, OBSERVATION_SIZE), dtype=real, device=simulator.device)
        # A recorded launch for each of the two copies of the state, which hold in turn.
        self._launches = [
            Launch(
                observe_forward,
                simulator.n,
                inputs=[simulator.machines, simulator.machine_of, state],
                outputs=[self._out],
                device=simulator.device,
            )
            for state, _ in simulator.copies
        ]

    def __call__(self) -> Array:
        """The observations now."""
        self._launches[self._simulator.current].launch()
        return np.array(self._out.numpy())


class CueFilter(Protocol):
    """What is shown of a car's cues, each (6,): specific force, m/s^2, and angular velocity, rad/s."""

    def begin(self, cues: Floats) -> None:
        """Cues were as now for ever."""

    def put(self, cues: Floats) -> Floats:
        """What is shown at the next time step, from the cues there."""


@dataclass(frozen=True)
class Live:
    """A simulator whose drive may be written while it goes on.

    Args:
        simulator: With the drive's samples.
        memories: Low-passed cues of each sample, with the time constants of the low-passes, s, for each
            observation that holds some: the policy's, and that of the base policy under it.
        known: Rows of controls and road of each sample, with what is seen of them, likewise.
        shown: From the car's cues to those that are written; None where they are the same.
    """

    simulator: Simulator
    memories: tuple[tuple[Mirror, tuple[float, ...]], ...] = ()
    known: tuple[tuple[Mirror, ObservationOptions], ...] = ()
    shown: CueFilter | None = None


class Interface(ABC):
    """Machines as one kind of policy sees and moves them.

    Attributes:
        simulator: With the machines.
        action_size: Entries of an action.
        steps_per_action: Time steps for which an action is held.
        requested: (n, 9) accelerations commanded to the axes in the last time step, m/s^2 and rad/s^2.
        slices: Where the rows of an observation are, by name.
        simulator_cue_measured: Whether its rows of simulator cues are sensors' readings, not a model's.
        live: What the cues of a drive are written into, sample by sample, where they come one by one.
    """

    simulator: Simulator
    action_size: int = N_AXES
    steps_per_action: int = 1
    requested: Floats
    slices: Mapping[str, slice] = SLICES
    simulator_cue_measured: bool = True
    live: tuple[Live, ...]

    @abstractmethod
    def begin(self, start: ArrayLike | None) -> None:
        """Begin all drives, at rest at (9,) or (n, 9) start poses; None: from where the machines are."""

    @abstractmethod
    def observe(self) -> Array:
        """(n, size) observations now."""

    @abstractmethod
    def act(self, action: Floats) -> Iterator[None]:
        """Do actions (n, action_size), with a stop after each time step; to be run to its end.

        Raises:
            ActionError: a value is not finite; nothing has moved then.
        """

    @abstractmethod
    def follow(self, leader: Any) -> Callable[[], None]:
        """What brings these machines to where those of a ``leader``, an interface made alike, are.

        It does as much as the next time step needs, and is fast enough for real time.
        """


class MachineInterface(Interface):
    """For policies that see the simulator's rows and answer with accelerations of the nine axes."""

    def __init__(self, machines: Machines) -> None:
        self.simulator = Simulator(
            machines.platforms,
            machines.drives,
            platform_of=machines.platform_of,
            vestibular=machines.vestibular,
            dt=machines.time_step,
        )
        self.live = (Live(self.simulator),)
        self._observe = Observer(self.simulator)
        self.requested = np.zeros((self.simulator.n, N_AXES))

    def begin(self, start: ArrayLike | None) -> None:
        """Put the machines at rest."""
        if start is not None:
            self.simulator.reset(start)

    def observe(self) -> Array:
        """(n, OBSERVATION_SIZE)."""
        return self._observe()

    def act(self, action: Floats) -> Iterator[None]:
        """Take a time step with accelerations (n, 9)."""
        self.simulator.step(action)
        self.requested = action
        yield

    def follow(self, leader: Any) -> Callable[[], None]:
        """Nothing: the motion does not depend on the cues, and accelerations are given from outside."""
        return lambda: None


class TaskInterface(Interface):
    """For policies of the environment: its observations and actions, without noise or an early end.

    Args:
        machines: The machines.
        task: The environment.
        base_policy: What acts under the policy, where the action mode needs that.

    Raises:
        ConfigurationError: the environment senses with another vestibular model.
    """

    def __init__(self, machines: Machines, task: TaskOptions, base_policy: Any) -> None:
        if task.observation.perceived and get_vestibular_model(task.vestibular) != machines.vestibular:
            raise ConfigurationError(
                f"the policy senses with the vestibular model {task.vestibular!r}, the rollout has "
                f"{machines.vestibular.name!r}; pass vestibular=get_vestibular_model({task.vestibular!r})"
            )
        task = replace(
            task,
            platform=machines.platforms[0],
            vestibular=machines.vestibular.name,
            reward=replace(task.reward, against_base=False),
            episode=EpisodeOptions(),
            randomization=RandomizationOptions(),
        )
        n = len(machines.drives)
        self.batch = Batch(n, task, drives=machines.drives, platforms=machines.platforms, base=base_policy)
        self.simulator = self.batch.simulator
        self.action_size = self.batch.action_size
        self.steps_per_action = task.action.repeat
        self.slices = self.batch.layout.slices
        self.simulator_cue_measured = task.observation.simulator_cue == "machine"
        beside = self.batch.beside
        self._batches = (self.batch,) if beside is None else (self.batch, beside)
        self.live = tuple(Live(one.simulator, one.memories, one.known) for one in self._batches)
        self._machine_of = np.zeros(n, dtype=np.int32)
        if machines.platform_of is not None:
            self._machine_of[...] = machines.platform_of

    @property
    def requested(self) -> Floats:  # type: ignore[override]
        """(n, 9) accelerations commanded by the environment, its base policy included."""
        return self.batch.commanded

    def begin(self, start: ArrayLike | None) -> None:
        """Begin an episode everywhere."""
        n, where = self.batch.n, self.simulator.snapshot() if start is None else None
        everywhere = np.ones(n, dtype=bool)
        self.batch.begin(everywhere, np.arange(n, dtype=np.int32), self._machine_of)
        for one in self._batches:
            if where is None:
                one.simulator.reset(start)
            else:
                one.simulator.restore(where)
        self.batch.observe(everywhere)

    def observe(self) -> Array:
        """(n, size) observations of the environment."""
        return np.array(self.batch.arrays.observation.pull())

    def act(self, action: Floats) -> Iterator[None]:
        """Do actions (n, k) in [-1, 1]."""
        self.batch.write(action)
        for _ in self.batch.play():
            yield

    def follow(self, leader: Any) -> Callable[[], None]:
        """Copies the leader's arrays as bytes: snapshots of a batch take too long for real time."""
        ours, theirs = self.batch, leader.batch
        pairs = zip(vars(theirs.arrays).values(), vars(ours.arrays).values(), strict=True)
        arrays = [(_bytes_of(source.view), _bytes_of(target.view)) for source, target in pairs]
        copy_state = state_copier(theirs.simulator, ours.simulator)

        def copy() -> None:
            for source, target in arrays:
                target[...] = source
            copy_state()
            ours.base.restore(theirs.base.snapshot())

        return copy


def state_copier(leader: Simulator, follower: Simulator) -> Callable[[], None]:
    """What brings a simulator to the state of another that was made alike, fast enough for real time."""
    sources, targets = _states_of(leader), _states_of(follower)

    def copy() -> None:
        held = zip(sources[leader.current], targets[follower.current], strict=True)
        for source, target in held:
            target[...] = source

    return copy


def _states_of(simulator: Simulator) -> list[tuple[NDArray[np.uint8], ...]]:
    """Bytes of state and earlier set-points, for both copies that hold in turn."""
    return [tuple(_bytes_of(array.numpy()) for array in pair) for pair in simulator.copies]


def _bytes_of(array: Any) -> NDArray[np.uint8]:
    """The memory of an array, flat; no copy."""
    return np.asarray(array).reshape(-1).view(np.uint8)
