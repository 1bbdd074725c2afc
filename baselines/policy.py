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

from ..envs.cues import CueTrace
from ..envs.simulator import N_AXES

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
            observation: (n, OBSERVATION_SIZE) or (OBSERVATION_SIZE,), see ``envs.observation``.
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
