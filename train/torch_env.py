"""The batch with PyTorch tensors on its own device: nothing but the ends of episodes visits the host."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import warp as wp

from ..envs.cues import CueTrace
from ..envs.errors import ActionError
from ..envs.task.batch import Batch
from ..envs.task.environment import task_options
from ..envs.task.options import TaskOptions


@dataclass(frozen=True)
class Transition:
    """What a step gives; all but the last two are views that the next step overwrites.

    Args:
        observation: (n, size) float32; of the next episode where one has ended.
        reward: (n,) in the kernels' precision.
        terminated: (n,) bool.
        truncated: (n,) bool.
        terms: (n, N_TERMS) terms of the reward, in the order of ``TERMS``.
        ended: (m,) environments whose episode has ended in this step.
        final_observation: (m, size) their last observations.
    """

    observation: torch.Tensor
    reward: torch.Tensor
    terminated: torch.Tensor
    truncated: torch.Tensor
    terms: torch.Tensor
    ended: torch.Tensor
    final_observation: torch.Tensor


class DrivingSimulatorTorch:
    """A batch of driving simulators in PyTorch; an environment that ends begins anew in the same step.

    A base policy, where the action mode needs one, acts on the host.

    Args:
        num_envs: Environments.
        task: Everything that can be chosen, or the name or file of a task; default: all defaults.
        drives: Cue traces to drive instead of those of ``task.episode``.
        base: The base policy of the action modes "residual" and "gains", by name or file too; default:
            ``action.base``.
        device: "cuda:0" and the like, or "cpu"; the same name for Warp and PyTorch.
        **fields: Fields of ``TaskOptions`` to replace, as dataclasses or dictionaries.

    Raises:
        ConfigurationError: an option is unknown, of the wrong type or out of range.
    """

    def __init__(
        self,
        num_envs: int,
        task: TaskOptions | str | Path | None = None,
        *,
        drives: Sequence[CueTrace] | None = None,
        base: Any = None,
        device: str = "cuda:0",
        **fields: Any,
    ) -> None:
        self.task = task_options(task, fields)
        self.batch = Batch(num_envs, self.task, drives=drives, base=base, device=device)
        self.num_envs, self.device = num_envs, torch.device(device)
        arrays = self.batch.arrays
        self._action = wp.to_torch(arrays.action.array)
        self._observation: torch.Tensor = wp.to_torch(arrays.observation.array)
        self._reward, self._terms = wp.to_torch(arrays.reward.array), wp.to_torch(arrays.terms.array)
        self._terminated = wp.to_torch(arrays.terminated.array)
        self._truncated = wp.to_torch(arrays.truncated.array)

    def reset(self, seed: int) -> torch.Tensor:
        """Begin anew, environment i with ``seed + i``; returns the observations (n, size), a view."""
        everywhere = np.ones(self.num_envs, dtype=bool)
        self.batch.seed(everywhere, [seed + i for i in range(self.num_envs)])
        with self._stream():
            self.batch.begin(everywhere)
            self.batch.observe(everywhere)
        return self._observation

    def step(self, action: torch.Tensor) -> Transition:
        """Advance by one action (n, k) of each environment.

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        if action.shape != self._action.shape:
            raise ActionError(f"action has shape {tuple(action.shape)}, expected {tuple(self._action.shape)}")
        if not bool(torch.isfinite(action).all()):
            raise ActionError("action is not finite")
        with self._stream():
            self._action.copy_(action.detach())
            self.batch.step()
            ended = torch.nonzero(self._terminated | self._truncated).flatten()
            final = self._observation[ended]
            if len(ended):
                self._begin(ended)
        ends = self._terminated, self._truncated
        return Transition(self._observation, self._reward, *ends, self._terms, ended, final)

    def _begin(self, ended: torch.Tensor) -> None:
        mask = np.zeros(self.num_envs, dtype=bool)
        mask[ended.cpu().numpy()] = True
        self.batch.begin(mask)
        self.batch.observe(mask)

    @contextmanager
    def _stream(self) -> Iterator[None]:
        """Kernels run in PyTorch's order of work."""
        if self.device.type == "cpu":
            yield
            return
        with wp.ScopedStream(wp.stream_from_torch(torch.cuda.current_stream(self.device))):
            yield
