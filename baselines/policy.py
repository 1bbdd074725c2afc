"""What a policy is: Stable-Baselines3's convention, so that a trained model is one, too.

Any controller becomes a policy with two lines::

    class Mine:
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            return my_accelerations(observation), state
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ..envs.arrays import FLOAT
from ..envs.cues import CueTrace
from ..envs.errors import DataError
from ..envs.simulator.kernels.observation import OBSERVATION_SIZE
from ..envs.simulator.simulator import N_AXES

Array = NDArray[Any]


@runtime_checkable
class Policy(Protocol):
    """Maps observations to accelerations of the nine axes."""

    def predict(
        self,
        observation: Array,
        state: Any = None,
        episode_start: Array | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, Any]:
        """Accelerations for observations.

        Args:
            observation: (n, OBSERVATION_SIZE) or (OBSERVATION_SIZE,), see
            ``envs.simulator.kernels.observation``.
            state: What the last call returned; None at first.
            episode_start: (n,) whether each environment has just been reset.
            deterministic: No effect on a policy without randomness.

        Returns:
            Accelerations (n, 9) or (9,) in the order of ``AXES``, m/s^2 and rad/s^2, and the next state.
        """
        ...


@runtime_checkable
class ForeknowingPolicy(Protocol):
    """A policy that is told the drive before it begins: some of it (preview), or all."""

    def for_drive(self, cues: CueTrace) -> Policy:
        """The policy for one drive, whose first call sees the machine at the first sample.

        Args:
            cues: The drive, at the time step of the rollout.
        """
        ...


def start_of(policy: object) -> Array:
    """(9,) pose a policy likes to begin a drive at: its ``start`` if it has one, else neutral."""
    return np.asarray(getattr(policy, "start", np.zeros(N_AXES)), dtype=np.float64)


def checked_observation(observation: Any) -> Array:
    """Observations as the kernels' numbers.

    Raises:
        DataError: they are not (n, OBSERVATION_SIZE) or (OBSERVATION_SIZE,) finite numbers.
    """
    try:
        values = np.asarray(observation, dtype=FLOAT)
    except (TypeError, ValueError):
        raise DataError(
            f"observation is not numeric; give an array of (n, {OBSERVATION_SIZE}) numbers"
        ) from None
    if values.ndim not in (1, 2) or values.shape[-1] != OBSERVATION_SIZE or not len(values):
        raise DataError(f"observation has shape {values.shape}, expected (n, {OBSERVATION_SIZE})")
    if not np.isfinite(values).all():
        raise DataError("observation is not finite")
    return values


def checked_episode_start(episode_start: Any, n: int) -> NDArray[np.bool_]:
    """(n,) flags of n environments.

    Raises:
        DataError: they are something else.
    """
    flags = np.asarray(episode_start)
    if flags.dtype != np.bool_ or flags.shape != (n,):
        raise DataError(
            f"episode_start is {kind_of(flags)}; give {n} booleans, one an observation, "
            "or None in mid-episode"
        )
    return flags


def wrong_state(state: Any, n: int) -> DataError:
    """The error for a ``state`` that is not what a policy returned."""
    return DataError(
        f"state is {kind_of(state)}; give what the last call for these {n} observations returned, "
        "or None to begin"
    )


def kind_of(values: Any) -> str:
    """What something is, for messages."""
    if not isinstance(values, np.ndarray):
        return f"of type {type(values).__name__}"
    held = "washout memory" if values.dtype.names else str(values.dtype)
    return f"an array of {held} of shape {values.shape}"


class NoMotion:
    """The machine stands still: the zero every other policy is measured from."""

    name = "no-motion"

    def predict(
        self,
        observation: Array,
        state: Any = None,
        episode_start: Array | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, Any]:
        """Nine zeros."""
        return np.zeros((*np.shape(observation)[:-1], N_AXES)), state
