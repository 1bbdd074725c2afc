"""Base policies: the controller that acts under the agent in the action modes "residual" and "gains".

- :class:`Base`: none, for the other modes.
- :class:`RowsBase`: a washout, predictive control or one's own. It sees the simulator's rows, and answers
  with accelerations.
- :class:`TaskBase`: an agent, such as a linear washout. It sees its own environment's observation, and
  answers with actions.
- :class:`Schedule`: a washout whose gains the agent chooses.

A whole batch acts at once, in every time step, or as often as an agent's own environment does.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import Mirror
from ..cues import CueTrace
from ..errors import ConfigurationError
from ..platform.machines import Platform
from ..simulator.simulator import TIME_STEP, Simulator, Snapshot, bytes_of, put_bytes
from .arrays import FRAME, BatchArrays, Launches, rules_of
from .kernels.observation import ObservationOptions, layout_of, low_passed
from .knowledge import expected_of, known_of
from .options import TaskOptions
from .sensors import sensed_drives

Array = NDArray[Any]
Mask = NDArray[np.bool_]

_MAKER: Final = "motion_cueing.train.agents", "make_policy"
"""Module and function that make a policy of a name or file; this room knows no policies itself."""


def base_of(policy: Any, options: TaskOptions, platform: Platform) -> Any:
    """The base policy of a task: ``policy`` itself, or what it or ``action.base`` names; None for none.

    Raises:
        UnknownNameError: no policy has this name.
        ConfigurationError: the action mode has no base policy, or its policy must know the drive.
    """
    mode = options.action.mode
    if mode not in ("residual", "gains"):
        if policy is not None:
            raise ConfigurationError(f"base= is of no use with action.mode {mode!r}; leave it out")
        return None
    given = options.action.base if policy is None else policy
    if given is None:
        raise ConfigurationError(
            f"action.mode {mode!r} needs base=, a policy, its name or its file; or the name as action.base"
        )
    module, function = _MAKER
    make = getattr(import_module(module), function)
    # What is given as an object may be meant for another machine.
    given = make(given, platform, force=not isinstance(given, str | Path))
    if given.needs_drive:
        raise ConfigurationError(
            f"base {given.name}: it must know the drive before it begins, which no environment tells it; "
            "take one that does not, such as 'classical' or 'mpc'"
        )
    return given


def gains_of(policy: Any) -> int:
    """How many gains the base policy of the mode "gains" has.

    Raises:
        ConfigurationError: it has none.
    """
    try:
        return len(policy.gain_names)
    except AttributeError:
        raise ConfigurationError(
            f"base {policy.name}: action.mode 'gains' needs a policy with gain_names and schedule(...), "
            "such as ScheduledWashout"
        ) from None


class Base:
    """No base policy.

    Attributes:
        policy: The policy, or None.
        every: Time steps from one action of the policy to the next; 0 for never.
        before: Whether it acts before each time step, with the agent's action, instead of after it.
        memories: Low-passed cues that its own observation holds, and their time constants, s.
        known: Controls and road that its own observation holds, and what is seen of them.
    """

    policy: Any = None
    every: int = 0
    before: bool = False
    memories: tuple[tuple[Mirror, tuple[float, ...]], ...] = ()
    known: tuple[tuple[Mirror, ObservationOptions], ...] = ()

    def begin(self, mask: Mask) -> None:
        """Episodes begin in the masked environments."""

    def act(
        self, observation: Array, out: Array, gains: Array | None = None, mask: Mask | None = None
    ) -> None:
        """Write what the policy does into ``out`` (n, 9), accelerations in m/s^2 and rad/s^2.

        Args:
            observation: (n, OBSERVATION_SIZE) the simulator's rows.
            out: Where to.
            gains: (n, k) of a schedule.
            mask: (n,) the environments it acts in, the others stay as they are; default: all.
        """

    def snapshot(self) -> Snapshot:
        """The memory, for :meth:`restore`."""
        return {}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot."""


class _Remembering(Base):
    """A policy whose state is None, an array with a row, or a list with an item for each environment."""

    def __init__(self, policy: Any, n: int) -> None:
        self.policy = policy
        self._begins = np.ones(n, dtype=bool)
        self._state: Any = None

    def begin(self, mask: Mask) -> None:
        """Episodes begin in the masked environments."""
        self._begins |= mask

    def _remember(self, state: Any, mask: Mask | None) -> None:
        """Keep the next state of the masked environments, of all where there is none yet."""
        if mask is None or self._state is None or state is None:
            self._state = state
            self._begins[...] = False
            return
        self._state = copy.copy(self._state)
        for i in np.flatnonzero(mask).tolist():
            self._state[i] = state[i]
        self._begins &= ~mask

    def snapshot(self) -> Snapshot:
        """The memory, for :meth:`restore`."""
        state = {} if self._state is None else {"base_state": copy.deepcopy(self._state)}
        return {"base_begins": self._begins.copy(), **state}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot."""
        # Early versions kept none for an agent.
        self._begins[...] = snapshot.get("base_begins", False)
        self._state = copy.deepcopy(snapshot.get("base_state"))


class RowsBase(_Remembering):
    """A policy that sees the simulator's rows."""

    every = 1

    def _answer(self, observation: Array, gains: Array | None, begins: Mask) -> tuple[Any, Any]:
        answer: tuple[Any, Any] = self.policy.predict(observation, self._state, begins, deterministic=True)
        return answer

    def act(
        self, observation: Array, out: Array, gains: Array | None = None, mask: Mask | None = None
    ) -> None:
        """Write what the policy does; see :class:`Base`."""
        action, state = self._answer(observation, gains, self._begins.copy())
        action = np.reshape(action, out.shape)
        if mask is None or self._state is None or state is None:
            out[...] = action
        else:
            out[mask] = action[mask]
        self._remember(state, mask)


class Schedule(RowsBase):
    """A policy with ``gain_names`` and ``schedule(observation, gains, state, episode_start)``."""

    before = True

    def _answer(self, observation: Array, gains: Array | None, begins: Mask) -> tuple[Any, Any]:
        answer: tuple[Any, Any] = self.policy.schedule(observation, gains, self._state, begins)
        return answer


class TaskBase(_Remembering):
    """An agent, with the observations and actions of its own environment on the machines of the batch.

    Args:
        policy: The agent: ``task`` and ``predict``.
        options: The task of the batch.
        simulator: Of the batch.
        drives: Of the batch, at the machine's time step.
        shared: Arrays of the batch; the noise of its episodes is that of the agent's sensors, too.

    Raises:
        ConfigurationError: the agent has a base policy itself, or acts at another rate than it can here.
    """

    def __init__(
        self,
        policy: Any,
        options: TaskOptions,
        simulator: Simulator,
        drives: Sequence[CueTrace],
        shared: BatchArrays,
    ) -> None:
        task, repeat = policy.task, policy.task.action.repeat
        if task.action.mode in ("residual", "gains"):
            raise ConfigurationError(
                f"base {policy.name}: it has a base itself; give an agent whose action.mode is 'acceleration'"
            )
        if options.action.repeat % repeat:
            raise ConfigurationError(
                f"base {policy.name}: it acts every {repeat} time steps, of which action.repeat "
                f"{options.action.repeat} is no multiple"
            )
        super().__init__(policy, simulator.n)
        self.every = repeat
        layout = layout_of(task.observation, task.action.mode, task.action.size)
        sensors = options.randomization.car_sensors
        sensed = sensed_drives(drives, sensors, options.episode.library_seed)
        memory = low_passed(sensed, task.observation.memory, TIME_STEP)
        errors, seed = options.randomization.road, options.episode.library_seed
        known = known_of(drives, task.observation, errors, seed)
        expected = expected_of(drives, task.observation)
        known = np.hstack((known, expected)) if expected.size else known
        self.arrays = BatchArrays(simulator.n, task.action.size, layout, memory, known, simulator.device)
        self.known = ((self.arrays.known, task.observation),)
        self.memories = ((self.arrays.memory, task.observation.memory),)
        self.arrays.episode, self.arrays.begins = shared.episode, shared.begins
        rules = rules_of(
            task, layout, simulator.platforms, TIME_STEP, simulator.device, () if sensors.perfect else sensed
        )
        rules.view.expected = expected.shape[1]
        self._launches = Launches(simulator, self.arrays, rules)
        self._commanded = self.arrays.command.view["commanded"]

    def begin(self, mask: Mask) -> None:
        """Forget the last action where episodes begin, and all that the agent remembers."""
        super().begin(mask)
        self._launches.forget()

    def act(
        self, observation: Array, out: Array, gains: Array | None = None, mask: Mask | None = None
    ) -> None:
        """Write what the agent does; see :class:`Base`."""
        arrays = self.arrays
        self._launches.look(mask is not None, FRAME)
        seen, begins = arrays.observation.pull(), self._begins
        action, state = self.policy.predict(seen, self._state, begins, deterministic=True)
        self._remember(state, mask)
        arrays.action.view[...] = action
        arrays.action.push()
        self._launches.ask(mask is not None)
        arrays.command.pull()
        np.copyto(out, self._commanded, where=True if mask is None else mask[:, None])

    def snapshot(self) -> Snapshot:
        """The memory, for :meth:`restore`."""
        changing = {f"base.{name}": bytes_of(mirror.array) for name, mirror in self.arrays.changing()}
        return changing | super().snapshot()

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot."""
        super().restore(snapshot)
        for name, mirror in self.arrays.changing():
            put_bytes(mirror.array, f"base.{name}", snapshot)
            mirror.pull()
