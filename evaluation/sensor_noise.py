"""Noise on what a policy sees of the cues: sensors in the car and in the cab that are not perfect."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..baselines import ForeknowingPolicy, Policy
from ..envs.cues import CueTrace
from ..envs.observation import SCALES, SLICES
from ..envs.settings import NonNegative, configuration
from ..envs.task.layout import DIFFERENCE
from .drivers import TaskPolicy
from .rollout import AnyPolicy
from .wrapped import Wrapped

Array = NDArray[Any]

NOISE_VERSION: Final = 2
"""Of what noise is: drives of another one are driven again. 1 was a constant for policies without memory."""

_KINDS = (("wanted_force", "felt_force", "force_error"), ("wanted_rate", "felt_rate", "rate_error"))
_ERRORS = {row.name: row.scale for row in DIFFERENCE}


@configuration
class SensorNoise:
    """White noise, new in every time step; the defaults are of the class of a cheap inertial sensor.

    Args:
        force: Standard deviation on each axis of the specific force wanted and felt, m/s^2.
        rate: Standard deviation on each axis of the angular velocity wanted and felt, rad/s (0.3 deg/s).
        seed: Of the noise, which is the same for every policy.
    """

    force: NonNegative = 0.05
    rate: NonNegative = math.radians(0.3)
    seed: int = 0


def with_noise(policy: AnyPolicy, noise: SensorNoise) -> AnyPolicy:
    """The policy behind noisy sensors. What it is told of the drive ahead stays true."""
    if isinstance(policy, ForeknowingPolicy):
        return _ForeknowingBehind(policy, noise)
    return _TaskBehind(policy, noise) if isinstance(policy, TaskPolicy) else _Behind(policy, noise)


class _Behind(Wrapped):
    """A policy that sees noisy observations.

    Its state is the policy's own in a tuple, so that it is never None but at the beginning, not even where
    the policy has none.

    Args:
        policy: What is behind the sensors.
        noise: Of the sensors.
    """

    errors: Mapping[str, slice] = MappingProxyType({})
    """Where the observation has the difference of cues wanted and felt, by name."""
    in_cab: float = 1.0
    """Share of the noise that the cab's cues get: 0 where a model tells them, not sensors."""

    def __init__(self, policy: Policy | TaskPolicy, noise: SensorNoise) -> None:
        super().__init__(policy)
        self._policy, self._noise = policy, noise
        self._draw = np.random.default_rng(noise.seed)

    def predict(
        self,
        observation: Array,
        state: tuple[Any] | None = None,
        episode_start: Array | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, tuple[Any]]:
        """The answer to the observation with noise on it.

        The noise begins anew, for all rows, where ``episode_start`` says of any that a drive begins; where it
        is None, where ``state`` is.
        """
        if state is None if episode_start is None else np.any(episode_start):
            self._draw = np.random.default_rng(self._noise.seed)
        inner = None if state is None else state[0]
        action, memory = self._policy.predict(self._noisy(observation), inner, episode_start, deterministic)
        return action, (memory,)

    def _noisy(self, observation: Array) -> Array:
        seen = np.array(observation)
        shape = (*seen.shape[:-1], 3)
        for (wanted, felt, error), size in zip(_KINDS, (self._noise.force, self._noise.rate), strict=True):
            in_car, in_cab = self._draw.normal(scale=size, size=(2, *shape))
            in_cab *= self.in_cab
            seen[..., SLICES[wanted]] += in_car / SCALES[wanted]
            seen[..., SLICES[felt]] += in_cab / SCALES[felt]
            if error in self.errors:
                seen[..., self.errors[error]] += (in_car - in_cab) / _ERRORS[error]
        return seen


class _TaskBehind(_Behind):
    """The same for a policy with an environment of its own; only the newest frame of a stack is noisy."""

    def __init__(self, policy: TaskPolicy, noise: SensorNoise) -> None:
        super().__init__(policy, noise)
        self.task = policy.task
        self.in_cab = float(policy.task.observation.felt == "machine")
        self.base_policy = getattr(policy, "base_policy", None)
        layout = getattr(policy, "layout", None)
        self.errors = {} if layout is None else {name: layout.slices[name] for name in _ERRORS}


class _ForeknowingBehind(Wrapped):
    """The same for a policy that is told the drive."""

    def __init__(self, policy: ForeknowingPolicy, noise: SensorNoise) -> None:
        super().__init__(policy)
        self._told: Callable[[CueTrace], Policy] = policy.for_drive
        self._noise = noise

    def for_drive(self, cues: CueTrace) -> Policy:
        """The policy for one drive."""
        return _Behind(self._told(cues), self._noise)
