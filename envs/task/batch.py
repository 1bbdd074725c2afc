"""A batch of environments and their base policy, on which the single, the vector and other environments run.

Each kernel is a recorded launch with its arrays, once for each copy of the simulator's state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..arrays import Mirror, real, vec9
from ..cues import CueTrace
from ..errors import ActionError, ConfigurationError, UnknownNameError
from ..perception.models import get_vestibular_model
from ..platform.kernels.step import AXES
from ..platform.machines import Platform
from ..simulator.kernels.observation import OBSERVATION_SIZE
from ..simulator.simulator import TIME_STEP, Simulator, Snapshot, bytes_of, put_bytes
from .episode import (
    DRIVE,
    MACHINE_STREAM,
    draw,
    fill_episodes,
    key_of,
    library_of,
    machines_of,
    pose_scale,
    start_poses,
    start_samples,
    uniform,
)
from .kernels.action import Mode, action_scale, action_scales
from .kernels.episode import Arrays, Command, Rules, forget, look, play
from .kernels.observation import Episode, Layout, ability_of, layout_of, low_passed, view_of
from .kernels.reward import reward_of, vec_terms
from .options import TaskOptions

Array = NDArray[Any]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Base:
    """The base policy of a batch, with its memory.

    Args:
        policy: The policy, or None. Mode "residual" needs ``predict`` (accelerations for observations);
            mode "gains" needs ``gain_names`` and ``schedule(observation, gains, state, episode_start)``.
            Its state must be None or an array with one row an environment.
        mode: What actions mean.
        n: Environments.

    Raises:
        ConfigurationError: the mode needs another policy than there is.
    """

    def __init__(self, policy: Any, mode: Mode, n: int) -> None:
        self.policy = policy
        self.residual, self.scheduled = mode == "residual", mode == "gains"
        self.action_size = len(AXES)
        if policy is not None and not (self.residual or self.scheduled):
            raise ConfigurationError(f"base= is of no use with action.mode {mode!r}; leave it out")
        try:
            if self.residual:
                self._predict = policy.predict
            elif self.scheduled:
                self._schedule, self.action_size = policy.schedule, len(policy.gain_names)
        except AttributeError:
            method = "predict" if self.residual else "schedule"
            raise ConfigurationError(
                f"action.mode {mode!r} needs base=, a policy with {method}(...)"
            ) from None
        self._begins = np.ones(n, dtype=bool)
        self._state: Any = None

    def begin(self, mask: NDArray[np.bool_]) -> None:
        """Episodes begin in the masked environments."""
        self._begins |= mask

    def act(
        self, observation: Array, out: Array, gains: Array | None, mask: NDArray[np.bool_] | None
    ) -> None:
        """Write what the policy does at observations (n, OBSERVATION_SIZE) into ``out`` (n, 9).

        Args:
            observation: The fixed rows.
            out: Accelerations, m/s^2 and rad/s^2.
            gains: (n, k) for a scheduled policy.
            mask: (n,) the environments it acts in, the others stay as they are; default: all.
        """
        begins = self._begins.copy()
        if self.scheduled:
            action, state = self._schedule(observation, gains, self._state, begins)
        else:
            action, state = self._predict(observation, self._state, begins, deterministic=True)
        action = np.reshape(action, out.shape)
        if mask is None or self._state is None or state is None:
            out[...], self._state = action, state
            self._begins[...] = False
            return
        out[mask] = action[mask]
        self._state = np.array(self._state)
        self._state[mask] = np.asarray(state)[mask]
        self._begins &= ~mask

    def snapshot(self) -> Snapshot:
        """The memory, for :meth:`restore`."""
        state = {} if self._state is None else {"base_state": np.array(self._state)}
        return {"base_begins": self._begins.copy(), **state}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot."""
        self._begins[...] = snapshot["base_begins"]
        state = snapshot.get("base_state")
        self._state = None if state is None else np.array(state)


NOTHING, CORE, FRAME, ALL = range(4)
"""Parts of an observation, as the kernels number them."""


class BatchArrays:
    """The arrays of a batch, as attributes named like the fields of :class:`~.kernels.episode.Arrays`."""

    def __init__(
        self, n: int, action_size: int, layout: Layout, memory: NDArray[np.float32], device: Any
    ) -> None:
        self.episode = Mirror(n, Episode, device)
        self.begins = Mirror(n, wp.bool, device)
        self.base = Mirror(n, vec9, device)
        self.command = Mirror(n, Command, device)
        self.terms = Mirror(n, vec_terms, device)
        self.reward = Mirror(n, real, device)
        self.terminated, self.truncated = Mirror(n, wp.bool, device), Mirror(n, wp.bool, device)
        self.action = Mirror((n, action_size), wp.float32, device)
        self.now = Mirror((n, action_size), wp.float32, device)
        self.before = Mirror((n, action_size), wp.float32, device)
        self.core = Mirror((n, OBSERVATION_SIZE), real, device)
        self.fixed = Mirror((n, OBSERVATION_SIZE), real, device)
        self.observation = Mirror((n, layout.size), wp.float32, device)
        self.bounds = Mirror(layout.size, wp.float32, device)
        self.bounds.view[...] = layout.bounds
        self.bounds.push()
        self.memory = Mirror(memory.shape, wp.float32, device)
        self.memory.view[...] = memory
        self.memory.push()

    def for_kernels(self) -> Any:
        """The kernels' form."""
        arrays: Any = Arrays()
        for name, mirror in vars(self).items():
            setattr(arrays, name, mirror.array)
        return arrays


def rules_of(
    options: TaskOptions, layout: Layout, platforms: Sequence[Platform], dt: float, device: Any
) -> Any:
    """What is the same for a whole batch, as the kernels read it."""
    rules: Any = Rules()
    rules.action = action_scales(platforms, options.action, device)
    rules.reward = reward_of(options.reward, options.episode.terminate_on_failure)
    noise = options.randomization.force_noise, options.randomization.rate_noise
    rules.view = view_of(layout, options.observation, dt, noise)
    if options.observation.machine:
        abilities = np.array([ability_of(platform) for platform in platforms])
        rules.view.abilities = wp.array(abilities, dtype=wp.float32, device=device)
    rules.share, rules.dt = 1.0 / options.action.repeat, dt
    return rules


class Launches:
    """The recorded launches of a batch; each step replaces the simulator's state."""

    def __init__(self, simulator: Simulator, arrays: BatchArrays, rules: Any) -> None:
        self._simulator = simulator
        self._common = [rules, arrays.for_kernels()]
        self._recorded: dict[tuple[Any, ...], Any] = {}

    def play(self, first: bool, parts: int) -> None:
        """A time step, the ``first`` of an action or a later one, and ``parts`` of the observations."""
        simulator = self._simulator
        key = ("play", first, parts, simulator.current)
        if key not in self._recorded:
            begin, end = simulator.copies[simulator.current], simulator.copies[1 - simulator.current]
            *constants, _ = simulator.constants
            self._record(key, play, [*self._common, *constants, int(first), parts, *begin, *end])
        self._recorded[key].launch()
        simulator.swap()

    def look(self, only_begins: bool, parts: int) -> None:
        """``parts`` of the observations, outside of a step."""
        simulator = self._simulator
        key = ("look", only_begins, parts, simulator.current)
        if key not in self._recorded:
            machines, _, drives, machine_of, drive_of, _ = simulator.constants
            state, _ = simulator.copies[simulator.current]
            arrays = [machines, drives, machine_of, drive_of]
            self._record(key, look, [*self._common, *arrays, int(only_begins), parts, state])
        self._recorded[key].launch()

    def forget(self) -> None:
        """Forget the actions where episodes begin."""
        if ("forget",) not in self._recorded:
            self._record(("forget",), forget, [self._common[1]])
        self._recorded[("forget",)].launch()

    def _record(self, key: tuple[Any, ...], kernel: Any, arguments: list[Any]) -> None:
        n, device = self._simulator.n, self._simulator.device
        self._recorded[key] = wp.launch(kernel, n, inputs=arguments, device=device, record_cmd=True)


_CONSTANT: Final = ("bounds", "memory")
"""Arrays that are what they were when the batch was made."""


class Batch:
    """Environments stepped together; rewards, ends and observations lie in ``arrays``, new after each step.

    Args:
        n: Environments.
        options: Everything that can be chosen.
        drives: Cue traces to drive instead of those of ``options.episode``.
        platforms: Machines to draw from instead of those of ``options``.
        base: The base policy, where ``options.action.mode`` needs one.
        device: "cpu" or a CUDA device of Warp.
    """

    def __init__(
        self,
        n: int,
        options: TaskOptions,
        *,
        drives: Sequence[CueTrace] | None = None,
        platforms: Sequence[Platform] | None = None,
        base: Any = None,
        device: str = "cpu",
    ) -> None:
        if n < 1:
            raise ConfigurationError(f"a batch needs at least one environment, found {n}")
        self.n, self.options = n, options
        self.drives = self._library(drives)
        self.simulator = Simulator(
            machines_of(options) if platforms is None else platforms,
            self.drives,
            drive_of=np.zeros(n, dtype=np.int32),
            vestibular=get_vestibular_model(options.vestibular),
            device=device,
        )
        self.platform = self.simulator.platforms[0]
        self.base = Base(base, options.action.mode, n)
        self.action_size = self.base.action_size
        self.layout = layout_of(options.observation, options.action.mode, self.action_size)
        memory = low_passed(self.drives, options.observation.memory, TIME_STEP)
        self.arrays = BatchArrays(n, self.action_size, self.layout, memory, self.simulator.device)
        platforms = self.simulator.platforms
        self.scales = np.array([action_scale(one, options.action) for one in platforms])
        self._pose_scales = np.array([pose_scale(one) for one in platforms])
        self.time_step = TIME_STEP * options.action.repeat
        self._lengths = np.array([len(drive) for drive in self.drives])
        self._keys, self._episodes = np.zeros(n, dtype=np.uint64), np.zeros(n, dtype=np.int64)
        self.rules = rules_of(options, self.layout, platforms, TIME_STEP, self.simulator.device)
        self._launches = Launches(self.simulator, self.arrays, self.rules)

    def _library(self, drives: Sequence[CueTrace] | None) -> list[CueTrace]:
        if drives is None:
            drives = library_of(self.options.episode, self.options.randomization)
        return [drive.resampled(TIME_STEP) for drive in drives]

    def seed(self, mask: Mask, seeds: Sequence[int]) -> None:
        """Give the masked environments seeds (one for each environment of the batch), and start over."""
        chosen = np.flatnonzero(mask)
        self._keys[chosen] = [key_of(seeds[i]) for i in chosen.tolist()]
        self._episodes[chosen] = 0

    @property
    def scale(self) -> Floats:
        """(9,) accelerations an action of 1 stands for, m/s^2 and rad/s^2; (n, 9) where machines differ."""
        if np.all(self.scales == self.scales[0]):
            return np.array(self.scales[0])
        return np.array(self.scales[self.simulator.platform_of])

    @property
    def usual_scale(self) -> Floats:
        """(9,) median of the scales of the machines that can move an axis; 0 where none can."""
        moving = np.where(self.scales > 0.0, self.scales, np.nan)
        moving[:, ~np.any(self.scales > 0.0, axis=0)] = 0.0
        return np.asarray(np.nanmedian(moving, axis=0))

    def begin(self, mask: Mask, drive: ArrayLike | None = None, machine: ArrayLike | None = None) -> None:
        """Begin the next episode in the masked environments.

        Args:
            mask: (n,) which.
            drive: (n,) index of the drive, instead of a drawn one.
            machine: (n,) index of the machine, instead of a drawn one.
        """
        words = draw(self._keys[mask], self._episodes[mask])
        self._episodes[mask] += 1
        drive_of = self._chosen(words[:, DRIVE], len(self.drives), drive, mask)
        machine_of = self._chosen(words[:, MACHINE_STREAM], len(self.scales), machine, mask)
        options = self.options
        first, last = start_samples(words, self._lengths[drive_of], options.episode, TIME_STEP)
        fill_episodes(self.arrays.episode.view, mask, words, last, options.randomization)
        self.arrays.episode.push()
        self._place(
            mask,
            drive_of=drive_of,
            machine_of=machine_of,
            sample=first,
            start=start_poses(words, self._pose_scales[machine_of], options.episode.platform_offset),
        )

    def _place(self, mask: Mask, **drawn: NDArray[Any]) -> None:
        """Put the masked environments where was drawn for them."""
        where = {name: np.zeros((self.n, *values.shape[1:]), values.dtype) for name, values in drawn.items()}
        for name, values in drawn.items():
            where[name][mask] = values
        self.simulator.place(mask, **where)
        self._mark(mask)
        self.base.begin(mask)
        self._launches.forget()

    def _mark(self, begins: Mask) -> None:
        self.arrays.begins.view[...] = begins
        self.arrays.begins.push()

    def _chosen(
        self, words: NDArray[np.uint64], count: int, given: ArrayLike | None, mask: Mask
    ) -> NDArray[np.int32]:
        """Indices below ``count`` for the masked environments, drawn unless they are given (n,)."""
        if given is not None:
            return np.broadcast_to(np.asarray(given, dtype=np.int32), (self.n,))[mask]
        return np.floor(uniform(words) * count).astype(np.int32)

    def step(self) -> None:
        """Advance by one action, which lies in ``arrays.action``; rewards, ends and observations are new."""
        for _ in self.play():
            pass

    def play(self) -> Iterator[int]:
        """The same as :meth:`step`, with a stop after each time step of the action; to be run to its end."""
        repeat, base = self.options.action.repeat, self.base
        gains = np.clip(self.arrays.action.pull(), -1.0, 1.0) if base.scheduled else None
        # A base policy has the machine's time step: it acts anew within an action, too.
        within = CORE if base.residual or base.scheduled else NOTHING
        for k in range(repeat):
            if base.scheduled:
                self._act(gains)
            self._launches.play(k == 0, within if k < repeat - 1 or base.residual else ALL)
            if base.residual:
                self._act()
            yield k
        if base.residual:
            self._launches.look(False, FRAME)

    def observe(self, begins: Mask) -> None:
        """Make the observations of the environments new whose episode ``begins`` (n,)."""
        self._mark(begins)
        self._launches.look(True, CORE)
        if self.base.residual:
            self._act(mask=begins)
        self._launches.look(True, FRAME)
        self._mark(np.zeros(self.n, dtype=bool))

    def _act(self, gains: NDArray[np.float32] | None = None, mask: Mask | None = None) -> None:
        """Let the base policy act."""
        self.base.act(self.arrays.core.pull(), self.arrays.base.view, gains, mask)
        self.arrays.base.push()

    def snapshot(self) -> Snapshot:
        """Everything that changes, for :meth:`restore` of a batch made alike."""
        arrays = {name: bytes_of(mirror.array) for name, mirror in self._changing()}
        machines = {f"simulator.{name}": data for name, data in self.simulator.snapshot().items()}
        draws_made = {"keys": self._keys.copy(), "episodes": self._episodes.copy()}
        return {**arrays, **machines, **draws_made, **self.base.snapshot()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot: the same actions then give the same bits.

        Raises:
            DataError: it is of another batch or version.
        """
        for name, mirror in self._changing():
            put_bytes(mirror.array, name, snapshot)
            mirror.pull()
        prefix = "simulator."
        self.simulator.restore(
            {name.removeprefix(prefix): data for name, data in snapshot.items() if name.startswith(prefix)}
        )
        self._keys[...], self._episodes[...] = snapshot["keys"], snapshot["episodes"]
        self.base.restore(snapshot)

    def _changing(self) -> list[tuple[str, Mirror]]:
        """The arrays that change, by name."""
        return [(name, mirror) for name, mirror in vars(self.arrays).items() if name not in _CONSTANT]

    @property
    def commanded(self) -> NDArray[np.float64]:
        """(n, 9) accelerations commanded to the axes in the last time step, m/s^2 and rad/s^2."""
        return np.array(self.arrays.command.pull()["commanded"], dtype=np.float64)

    @property
    def clipped(self) -> NDArray[np.int32]:
        """(n,) entries of the last action outside [-1, 1]."""
        return np.asarray(self.arrays.command.pull()["clipped"])

    def write(self, action: ArrayLike) -> None:
        """Put actions (n, action_size) into ``arrays.action``.

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        values = np.asarray(action, dtype=np.float32)
        if values.shape != self.arrays.action.view.shape:
            raise ActionError(f"action has shape {values.shape}, expected {self.arrays.action.view.shape}")
        if not np.isfinite(values).all():
            raise ActionError(f"action is not finite: {values[~np.isfinite(values)][:3]} among its entries")
        self.arrays.action.view[...] = values
        self.arrays.action.push()

    def drive_indices(self, names: str | int | Sequence[str | int]) -> NDArray[np.int32]:
        """Indices into :attr:`drives`, of drives by index or name.

        Raises:
            UnknownNameError: no drive of the library has this name.
        """
        known = [drive.name for drive in self.drives]
        chosen = []
        for name in [names] if isinstance(names, str | int) else names:
            label = known[name] if isinstance(name, int | np.integer) and 0 <= name < len(known) else name
            if label not in known:
                raise UnknownNameError("drive", str(name), known)
            chosen.append(int(name) if isinstance(name, int | np.integer) else known.index(label))
        return np.array(chosen, dtype=np.int32)
