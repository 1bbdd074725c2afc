"""Groups of environments in the same drive, whose mean return is the baseline of each (as in GRPO).

With the same road, start and machine, the returns of a group differ by their actions alone. Most of the
variance of an advantage is the road's; the mean of the others in the group takes it off.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer

from ....envs.errors import ConfigurationError


class GroupRolloutBuffer(RolloutBuffer):
    """A rollout buffer whose advantages are those over the rest of the group.

    For PPO as ``rollout_buffer_class=GroupRolloutBuffer``, ``rollout_buffer_kwargs={"group": 4}``, with a
    ``DrivingSimulatorVecEnv(..., group=4)``.

    Args:
        group: Consecutive environments in one drive; 1 leaves advantages as they are.
        *arguments: Of ``RolloutBuffer``.
        **keywords: Of ``RolloutBuffer``.

    Attributes:
        shared: Share of the variance of the last advantages that a group has in common: the drive's.

    Raises:
        ConfigurationError: the environments are no multiple of the group.
    """

    def __init__(self, *arguments: Any, group: int = 1, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        if group < 1 or self.n_envs % group:
            raise ConfigurationError(
                f"rollout_buffer_kwargs.group {group}: the {self.n_envs} environments are no multiple of it"
            )
        self.group, self.shared = group, 0.0

    def compute_returns_and_advantage(self, last_values: torch.Tensor, dones: NDArray[np.bool_]) -> None:
        """Returns and advantages as ever; then the mean advantage of the others is taken off."""
        super().compute_returns_and_advantage(last_values, dones)
        if self.group == 1:
            return
        steps = len(self.advantages)
        grouped = self.advantages.reshape(steps, -1, self.group)
        own = grouped - grouped.mean(axis=2, keepdims=True)
        # Unbiased: the mean of a group has a share of the variance within it.
        within, whole = own.var() * self.group / (self.group - 1), grouped.var()
        self.shared = float(1.0 - within / whole) if whole > 0.0 else 0.0
        leave_one_out = own * (self.group / (self.group - 1))
        self.advantages = leave_one_out.reshape(self.advantages.shape).astype(np.float32)
