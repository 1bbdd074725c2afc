"""A batch of environments and their base policy, on which the single, the vector and other environments run.

Each kernel is a recorded launch with its arrays, once for each copy of the simulator's state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Mirror
from ..cues import CueTrace
from ..errors import ActionError, ConfigurationError, UnknownNameError
from ..perception.models import get_vestibular_model
from ..platform.machines import Platform
from ..simulator.simulator import TIME_STEP, Simulator, Snapshot, bytes_of, put_bytes
from .arrays import ALL, CORE, FRAME, NOTHING, BatchArrays, Launches, rules_of
from .base import Base, RowsBase, Schedule, TaskBase, base_of, gains_of
from .episode import (
    DRIVE,
    MACHINE_STREAM,
    cost_scales,
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
from .kernels.action import action_scale
from .kernels.observation import COMPARED, ObservationOptions, layout_of, low_passed
from .knowledge import expected_of, known_of
from .options import TaskOptions
from .sensors import sensed_drives

Array = NDArray[Any]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Batch:
    """Environments stepped together; rewards, ends and observations lie in ``arrays``, new after each step.

    Args:
        n: Environments.
        options: Everything that can be chosen.
        drives: Cue traces to drive instead of those of ``options.episode``.
        platforms: Machines to draw from instead of those of ``options``.
        base: The base policy of the modes "residual" and "gains": a policy, its name or its file; default:
            what ``options.action.base`` names.
        device: "cpu" or a CUDA device of Warp.

    Attributes:
        beside: The base policy by itself in the same episodes, where reward or observation are against it.

    Raises:
        ConfigurationError: they are, and there is no base policy; or observations are stacked.
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
        machines = machines_of(options) if platforms is None else platforms
        # Refused before the drives are made, which takes seconds.
        policy = base_of(base, options, machines[0])
        self.drives = self._library(drives)
        self.simulator = Simulator(
            machines,
            self.drives,
            drive_of=np.zeros(n, dtype=np.int32),
            vestibular=get_vestibular_model(options.vestibular),
            device=device,
        )
        self.platform = self.simulator.platforms[0]
        self.action_size = gains_of(policy) if options.action.mode == "gains" else options.action.size
        self.layout = layout_of(options.observation, options.action.mode, self.action_size)
        sensors = options.randomization.car_sensors
        seen = sensed_drives(self.drives, sensors, options.episode.library_seed)
        memory = low_passed(seen, options.observation.memory, TIME_STEP)
        errors = options.randomization.road
        known = known_of(self.drives, options.observation, errors, options.episode.library_seed)
        expected = expected_of(self.drives, options.observation)
        known = np.hstack((known, expected)) if expected.size else known
        self.arrays = BatchArrays(n, self.action_size, self.layout, memory, known, self.simulator.device)
        self._clipped: NDArray[np.int32] = self.arrays.command.view["clipped"]
        self.base = self._base(policy)
        platforms = self.simulator.platforms
        self.scales = np.array([action_scale(one, options.action) for one in platforms])
        self._pose_scales = np.array([pose_scale(one) for one in platforms])
        self.time_step = TIME_STEP * options.action.repeat
        self._cost_scales = cost_scales(self.drives, options.reward)
        self._lengths = np.array([len(drive) for drive in self.drives])
        self._keys, self._episodes = np.zeros(n, dtype=np.uint64), np.zeros(n, dtype=np.int64)
        self.rules = rules_of(
            options, self.layout, platforms, TIME_STEP, self.simulator.device, () if sensors.perfect else seen
        )
        self.rules.view.expected = expected.shape[1]
        self._launches = Launches(self.simulator, self.arrays, self.rules)
        self.beside = self._base_alone(policy)

    @property
    def known(self) -> tuple[tuple[Mirror, ObservationOptions], ...]:
        """Controls and road that observations hold, the base policy's included, and what is seen of them."""
        return ((self.arrays.known, self.options.observation), *self.base.known)

    @property
    def memories(self) -> tuple[tuple[Mirror, tuple[float, ...]], ...]:
        """Low-passed cues that observations hold, the base policy's included, and their time constants, s."""
        return ((self.arrays.memory, self.options.observation.memory), *self.base.memories)

    def _library(self, drives: Sequence[CueTrace] | None) -> list[CueTrace]:
        if drives is None:
            drives = library_of(self.options.episode, self.options.randomization)
        return [drive.resampled(TIME_STEP) for drive in drives]

    def _base(self, policy: Any) -> Base:
        """The base policy as the batch needs it; one with a ``task`` sees its own environment."""
        if policy is None:
            return Base()
        if self.options.action.mode == "gains":
            return Schedule(policy, self.n)
        if policy.task is None:
            return RowsBase(policy, self.n)
        return TaskBase(policy, self.options, self.simulator, self.drives, self.arrays)

    def _base_alone(self, policy: Any) -> Batch | None:
        """The base policy by itself in the same episodes; its actions stay zero."""
        reward, seen = self.options.reward, self.options.observation
        if not reward.against_base and not seen.against_base:
            return None
        if policy is None:
            raise ConfigurationError("against_base needs a base policy: action.mode 'residual' or 'gains'")
        if seen.against_base and seen.stack > 1:
            raise ConfigurationError("observation.stack must be 1 with observation.against_base")
        return Batch(
            self.n,
            replace(
                self.options,
                reward=replace(reward, against_base=False),
                observation=replace(seen, against_base=False),
            ),
            drives=self.drives,
            platforms=self.simulator.platforms,
            base=policy,
            device=str(self.simulator.device),
        )

    def seed(self, mask: Mask, seeds: Sequence[int]) -> None:
        """Give the masked environments seeds (one for each environment of the batch), and start over."""
        chosen = np.flatnonzero(mask)
        self._keys[chosen] = [key_of(seeds[i]) for i in chosen.tolist()]
        self._episodes[chosen] = 0
        if self.beside is not None:
            self.beside.seed(mask, seeds)

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
        self.arrays.episode.view["cost_scale"][mask] = self._cost_scales[drive_of]
        self.arrays.episode.push()
        self._place(
            mask,
            drive_of=drive_of,
            machine_of=machine_of,
            sample=first,
            start=start_poses(words, self._pose_scales[machine_of], options.episode.platform_offset),
        )
        if self.beside is not None:
            self.beside.begin(mask, drive, machine)

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
        gains = np.clip(self.arrays.action.pull(), -1.0, 1.0) if base.before else None
        # A base policy acts anew within an action, too; the last observation shows what it does next.
        within = CORE if base.every == 1 else NOTHING
        last = within if base.every and not base.before else ALL
        beside = None if self.beside is None else self.beside.play()
        for k in range(repeat):
            if base.before:
                self._act(gains)
            self._launches.play(k, within if k < repeat - 1 else last)
            if base.every and not base.before and (k + 1) % base.every == 0:
                self._act()
            if beside is not None:
                next(beside)
            yield k
        if last != ALL:
            self._launches.look(False, ALL if within == NOTHING else FRAME)
        if beside is not None and self.beside is not None:
            next(beside, None)
            self._compare(self.beside)
            if self.options.reward.against_base:
                self.arrays.reward.pull()[...] -= self.beside.arrays.reward.pull()
                self.arrays.reward.push()

    def _compare(self, beside: Batch) -> None:
        """Write how the machines differ from those ``beside``, which the base policy drives alone."""
        if not self.options.observation.against_base:
            return
        where, seen = self.layout.slices["against_base"], self.arrays.observation
        own, theirs = seen.pull(), beside.arrays.observation.pull()
        bound, gains = self.layout.bounds[where], self.layout.gains
        change = (own[:, COMPARED] - theirs[:, COMPARED]) * (gains[where] / gains[COMPARED])
        np.clip(change, -bound, bound, out=own[:, where])
        seen.push()

    def observe(self, begins: Mask) -> None:
        """Make the observations of the environments new whose episode ``begins`` (n,)."""
        self._mark(begins)
        self._launches.look(True, CORE)
        if self.base.every and not self.base.before:
            self._act(mask=begins)
        self._launches.look(True, FRAME)
        self._mark(np.zeros(self.n, dtype=bool))
        if self.beside is not None:
            self.beside.observe(begins)
            self._compare(self.beside)

    def _act(self, gains: NDArray[np.float32] | None = None, mask: Mask | None = None) -> None:
        """Let the base policy act."""
        self.base.act(self.arrays.core.pull(), self.arrays.base.view, gains, mask)
        self.arrays.base.push()

    def snapshot(self) -> Snapshot:
        """Everything that changes, for :meth:`restore` of a batch made alike."""
        arrays = {name: bytes_of(mirror.array) for name, mirror in self.arrays.changing()}
        machines = {f"simulator.{name}": data for name, data in self.simulator.snapshot().items()}
        draws_made = {"keys": self._keys.copy(), "episodes": self._episodes.copy()}
        beside = {} if self.beside is None else self.beside.snapshot()
        prefixed = {f"alone.{name}": data for name, data in beside.items()}
        return {**arrays, **machines, **draws_made, **self.base.snapshot(), **prefixed}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot: the same actions then give the same bits.

        Raises:
            DataError: it is of another batch or version.
        """
        for name, mirror in self.arrays.changing():
            put_bytes(mirror.array, name, snapshot)
            mirror.pull()
        self.simulator.restore(_under("simulator.", snapshot))
        self._keys[...], self._episodes[...] = snapshot["keys"], snapshot["episodes"]
        self.base.restore(snapshot)
        if self.beside is not None:
            self.beside.restore(_under("alone.", snapshot))

    @property
    def commanded(self) -> NDArray[np.float64]:
        """(n, 9) accelerations commanded to the axes in the last time step, m/s^2 and rad/s^2."""
        return np.array(self.arrays.command.pull()["commanded"], dtype=np.float64)

    @property
    def clipped(self) -> NDArray[np.int32]:
        """(n,) entries of the last action beyond its bound."""
        self.arrays.command.pull()
        return self._clipped

    def write(self, action: ArrayLike) -> None:
        """Put actions (n, action_size) into ``arrays.action``.

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        values, taken = np.asarray(action, dtype=np.float32), self.arrays.action
        if values.shape != taken.view.shape:
            raise ActionError(f"action has shape {values.shape}, expected {taken.view.shape}")
        if not np.isfinite(values).all():
            raise ActionError(f"action is not finite: {values[~np.isfinite(values)][:3]} among its entries")
        taken.view[...] = values
        taken.push()

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


def _under(prefix: str, snapshot: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The entries of a snapshot whose names begin with a prefix, without it."""
    return {name.removeprefix(prefix): data for name, data in snapshot.items() if name.startswith(prefix)}
