"""The recorded launches of a batch: each kernel with its arrays, once for each copy of the state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..mirror import Mirror
from ..observation import OBSERVATION_SIZE
from ..platform.machines import Platform
from ..precision import real, vec9
from ..simulator import Simulator
from .ability import ability_of
from .act_kernel import MODES, ActionScale, AxisScale
from .episode import Episode
from .kernels import Arrays, Command, Rules, forget, look, play
from .layout import Layout
from .observe_kernel import places_of
from .options import ActionOptions, TaskOptions
from .reward_kernel import reward_scale, vec_terms
from .scaling import action_scale, free_axes, velocity_scale

NOTHING, CORE, FRAME, ALL = range(4)
"""Parts of an observation, as the kernels number them."""

_KINDS: Final[dict[str, Any]] = {
    "episode": Episode,
    "begins": wp.bool,
    "base": vec9,
    "command": Command,
    "terms": vec_terms,
    "reward": real,
    "terminated": wp.bool,
    "truncated": wp.bool,
}


class BatchArrays:
    """The arrays of a batch, as attributes named like the fields of :class:`~.kernels.Arrays`.

    Args:
        n: Environments.
        action_size: Entries of an action.
        layout: Of the observations.
        memory: Low-passed cues of every sample of every drive, see :func:`~.memory.low_passed`.
        device: Where kernels work on them.
    """

    episode: Mirror
    begins: Mirror
    base: Mirror
    command: Mirror
    terms: Mirror
    reward: Mirror
    terminated: Mirror
    truncated: Mirror

    def __init__(
        self, n: int, action_size: int, layout: Layout, memory: NDArray[np.float32], device: Any
    ) -> None:
        for name, kind in _KINDS.items():
            setattr(self, name, Mirror(n, kind, device))
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


def _axis_scale(platform: Platform, options: ActionOptions) -> Any:
    """The kernel's form of what an action of 1 stands for on a machine."""
    scale: Any = AxisScale()
    largest = action_scale(platform, options)
    scale.acceleration, scale.jerk = vec9(*largest), vec9(*largest / options.rise_time)
    scale.velocity = vec9(*velocity_scale(platform))
    return scale


def _actions(platforms: Sequence[Platform], options: ActionOptions, device: Any) -> Any:
    """The kernel's form of what an action stands for."""
    scale: Any = ActionScale()
    scale.mode, scale.free = MODES[options.mode], vec9(*free_axes(options.frozen))
    axes = [_axis_scale(platform, options) for platform in platforms]
    scale.axes = wp.array(axes, dtype=AxisScale, device=device)
    scale.cab_frame = int(options.frame == "cab")
    return scale


def rules_of(
    options: TaskOptions, layout: Layout, platforms: Sequence[Platform], dt: float, device: Any
) -> Any:
    """What is the same for a whole batch, as the kernels read it."""
    rules: Any = Rules()
    rules.action = _actions(platforms, options.action, device)
    rules.reward = reward_scale(options.reward, options.episode.terminate_on_failure)
    rules.places = places_of(layout, options.observation, dt, options.randomisation)
    if options.observation.machine:
        abilities = np.array([ability_of(platform) for platform in platforms])
        rules.places.abilities = wp.array(abilities, dtype=wp.float32, device=device)
    rules.share, rules.dt = 1.0 / options.action.repeat, dt
    return rules


class Launches:
    """What a batch launches.

    Args:
        simulator: The machines, whose state each step replaces.
        arrays: Of the batch.
        rules: From :func:`rules_of`.
    """

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
