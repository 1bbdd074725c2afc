"""The arrays of a batch and the kernels' launches on them, recorded once for each copy of the state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..arrays import FLOAT, Mirror, real, vec6, vec9
from ..cues import CueTrace
from ..launch import Launch
from ..platform.machines import Platform
from ..simulator.kernels.observation import OBSERVATION_SIZE
from ..simulator.simulator import Simulator
from .kernels.action import action_scales
from .kernels.episode import Arrays, Command, Rules, ask, forget, look, play
from .kernels.observation import Episode, Layout, ability_of, lifted_cues, view_of
from .kernels.reward import reward_of, vec_terms
from .options import TaskOptions

NOTHING, CORE, FRAME, ALL = range(4)
"""Parts of an observation, as the kernels number them."""


class BatchArrays:
    """The arrays of a batch, as attributes named like the fields of :class:`~.kernels.episode.Arrays`."""

    def __init__(
        self,
        n: int,
        action_size: int,
        layout: Layout,
        memory: NDArray[np.float32],
        known: NDArray[np.float32],
        device: Any,
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
        self.bounds = Mirror(layout.size, wp.vec2f, device)
        self.bounds.view[...] = np.stack([layout.bounds, layout.gains], axis=1)
        self.bounds.push()
        self.memory = Mirror(memory.shape, wp.float32, device)
        self.memory.view[...] = memory
        self.memory.push()
        self.known = Mirror(known.shape, wp.float32, device)
        self.known.view[...] = known
        self.known.push()

    def for_kernels(self) -> Any:
        """The kernels' form."""
        arrays: Any = Arrays()
        for name, mirror in vars(self).items():
            setattr(arrays, name, mirror.array)
        return arrays

    def changing(self) -> list[tuple[str, Mirror]]:
        """The arrays that change, by name."""
        return [(name, mirror) for name, mirror in vars(self).items() if name not in _CONSTANT]


_CONSTANT: Final = ("bounds", "memory", "known")
"""Arrays that are what they were when the batch was made."""


def rules_of(
    options: TaskOptions,
    layout: Layout,
    platforms: Sequence[Platform],
    dt: float,
    device: Any,
    sensed: Sequence[CueTrace] = (),
) -> Any:
    """What is the same for a whole batch, as the kernels read it.

    ``sensed`` are the drives as the car's sensors give them, if these have errors.
    """
    rules: Any = Rules()
    rules.action = action_scales(platforms, options.action, device)
    rules.reward = reward_of(options.reward, options.episode.terminate_on_failure)
    noise = options.randomization.force_noise, options.randomization.rate_noise
    rules.view = view_of(layout, options.observation, dt, noise)
    rules.view.sensed = int(bool(sensed))
    rows = lifted_cues(sensed) if sensed else np.zeros((1, 6))
    rules.view.sensed_cues = wp.array(rows.astype(FLOAT), dtype=vec6, device=device)
    if options.observation.machine:
        abilities = np.array([ability_of(platform) for platform in platforms])
        rules.view.abilities = wp.array(abilities, dtype=wp.float32, device=device)
    rules.repeat, rules.dt = options.action.repeat, dt
    return rules


class Launches:
    """The recorded launches of a batch; each step replaces the simulator's state."""

    def __init__(self, simulator: Simulator, arrays: BatchArrays, rules: Any) -> None:
        self._simulator = simulator
        self._common = [rules, arrays.for_kernels()]
        self._recorded: dict[tuple[Any, ...], Launch] = {}

    def play(self, step: int, parts: int) -> None:
        """Time step number ``step`` of an action, and ``parts`` of the observations."""
        simulator = self._simulator
        key = ("play", step, parts, simulator.current)
        launch = self._recorded.get(key)
        if launch is None:
            begin, end = simulator.copies[simulator.current], simulator.copies[1 - simulator.current]
            *constants, _ = simulator.constants
            launch = self._record(key, play, [*self._common, *constants, step, parts, *begin, *end])
        launch.launch()
        simulator.swap()

    def look(self, only_begins: bool, parts: int) -> None:
        """``parts`` of the observations, outside of a step."""
        simulator = self._simulator
        key = ("look", only_begins, parts, simulator.current)
        launch = self._recorded.get(key)
        if launch is None:
            machines, _, drives, machine_of, drive_of, _ = simulator.constants
            state, _ = simulator.copies[simulator.current]
            arrays = [machines, drives, machine_of, drive_of]
            launch = self._record(key, look, [*self._common, *arrays, int(only_begins), parts, state])
        launch.launch()

    def ask(self, only_begins: bool) -> None:
        """The accelerations of a base policy's actions, without a time step."""
        simulator = self._simulator
        key = ("ask", only_begins, simulator.current)
        launch = self._recorded.get(key)
        if launch is None:
            _, _, _, machine_of, _, _ = simulator.constants
            state, _ = simulator.copies[simulator.current]
            launch = self._record(key, ask, [*self._common, machine_of, int(only_begins), state])
        launch.launch()

    def forget(self) -> None:
        """Forget the actions where episodes begin."""
        key = ("forget",)
        launch = self._recorded.get(key)
        if launch is None:
            launch = self._record(key, forget, [self._common[1]])
        launch.launch()

    def _record(self, key: tuple[Any, ...], kernel: Any, arguments: list[Any]) -> Launch:
        n, device = self._simulator.n, self._simulator.device
        launch = self._recorded[key] = Launch(kernel, n, arguments, device=device)
        return launch
