"""The Gymnasium environment: a batch with one row."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import EzPickle
from numpy.typing import ArrayLike, NDArray

from ..cues import CueTrace
from ..errors import ActionError
from .batch import Batch
from .options import TaskOptions
from .reward_kernel import TERMS
from .spaces import action_space, checked_render_mode, observation_space, task_options

Observation = NDArray[np.float32]
Action = NDArray[np.float32]


class DrivingSimulator(gymnasium.Env[Observation, Action], EzPickle):
    """A driving simulator that moves its driver as a car would; ``docs/environment.md`` has rows and units.

    Args:
        task: Everything that can be chosen; default: all defaults.
        drives: Cue traces to drive instead of those of ``task.episode``.
        base: The base policy of the action modes "residual" and "gains".
        render_mode: One of ``metadata["render_modes"]``, or None.
        **fields: Fields of :class:`~.options.TaskOptions` to replace, as dataclasses or dictionaries.

    Raises:
        ConfigurationError: an option is unknown, of the wrong type or out of range.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  (as Gymnasium declares it)

    def __init__(
        self,
        task: TaskOptions | None = None,
        *,
        drives: Sequence[CueTrace] | None = None,
        base: Any = None,
        render_mode: str | None = None,
        **fields: Any,
    ) -> None:
        EzPickle.__init__(self, task, drives=drives, base=base, render_mode=render_mode, **fields)
        self.render_mode = checked_render_mode(render_mode, self.metadata)
        self.task = task_options(task, fields)
        self.batch = Batch(1, self.task, drives=drives, base=base)
        self.observation_space = observation_space(self.batch)
        self.action_space = action_space(self.batch)
        self._all = np.ones(1, dtype=bool)
        self._seeded = False

    @property
    def scale(self) -> NDArray[np.float64]:
        """(9,) accelerations that an action of 1 stands for, m/s^2 and rad/s^2."""
        return self.batch.scale

    def action_of(self, acceleration: ArrayLike) -> Action:
        """Actions of the mode "acceleration" for accelerations (..., 9); 0 on axes that cannot move."""
        return normalised(acceleration, self.batch.scale)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the next episode.

        Args:
            seed: Start over with this seed.
            options: ``drive``: index or name of the drive, instead of drawing one.

        Returns:
            The observation, and ``drive`` (index into ``batch.drives``) and ``time`` (s, in the drive).
        """
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self.batch.seed(self._all, [self.np_random_seed])
            self._seeded = True
        drive = (options or {}).get("drive")
        self.batch.begin(self._all, None if drive is None else self.batch.drive_indices(drive))
        self.batch.observe(self._all)
        state = self.batch.simulator.state[0]
        where = int(self.batch.simulator.drive_of[0])
        info = {"drive": where, "time": float(self.batch.drives[where].time[state["sample"]])}
        return self.batch.arrays.observation.pull()[0].copy(), info

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance by one action.

        Returns:
            Observation, reward, whether failed, whether at the end, and every term of the reward by
            name, with ``clipped``, the entries of the action outside [-1, 1].

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        batch = self.batch
        batch.write(np.asarray(action)[None])
        batch.step()
        info: dict[str, Any] = dict(zip(TERMS, batch.arrays.terms.pull()[0].tolist(), strict=True))
        info["clipped"] = int(batch.clipped[0])
        return (
            batch.arrays.observation.pull()[0].copy(),
            float(batch.arrays.reward.pull()[0]),
            bool(batch.arrays.terminated.pull()[0]),
            bool(batch.arrays.truncated.pull()[0]),
            info,
        )


def normalised(acceleration: ArrayLike, scale: NDArray[np.float64]) -> Action:
    """Actions (..., 9) for accelerations in SI units; 0 where the scale is 0.

    Raises:
        ActionError: not nine accelerations.
    """
    values = np.asarray(acceleration, dtype=np.float64)
    if values.shape[-1:] != scale.shape:
        raise ActionError(f"accelerations have shape {values.shape}, expected (..., {len(scale)})")
    return np.divide(values, scale, out=np.zeros_like(values), where=scale > 0.0).astype(np.float32)
