"""The base policy under an agent: it acts, and the agent corrects it (residual) or sets its gains.

Any policy that follows Stable-Baselines3's convention can be one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigurationError
from ..platform.kernels.step import AXES
from ..simulator.simulator import Snapshot
from .kernels.action import Mode

Array = NDArray[Any]


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

    def ask(
        self, observation: Array, out: Array, gains: Array | None, mask: NDArray[np.bool_] | None
    ) -> None:
        """Write what the policy does at observations (n, OBSERVATION_SIZE) into ``out`` (n, 9).

        Args:
            observation: The fixed rows.
            out: Accelerations, m/s^2 and rad/s^2.
            gains: (n, k) for a scheduled policy.
            mask: (n,) the environments asked for, the others stay as they are; default: all.
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
