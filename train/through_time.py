"""The gradient of what a drive costs with respect to a policy's weights: back through machine and policy."""

from __future__ import annotations

from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray

from ..envs.task.unroll import TaskUnroll
from .actor import Actor
from .actor_steps import ActorSteps

_TINY: Final = 1e-30

Floats = NDArray[np.float64]


class ThroughTime:
    """A drive of an actor through an unroll that has begun.

    Args:
        unroll: The machine.
        actor: Who drives.

    Attributes:
        seen: (actions + 1, n, size) what was seen before each action, and after the last.
    """

    def __init__(self, unroll: TaskUnroll, actor: Actor) -> None:
        self._unroll, self._steps = unroll, ActorSteps(actor)
        seen = []
        for k in range(unroll.actions):
            seen.append(unroll.observe(k))
            unroll.act(k, self._steps.act(seen[-1]))
        seen.append(unroll.observe(unroll.actions))
        self.seen = torch.from_numpy(np.stack(seen))

    def lead_back(self, weights: Floats, at_end: torch.Tensor | None = None) -> torch.Tensor:
        """Lead the gradient of the weighted costs back from the last action to the first; once.

        Args:
            weights: (actions, n) of the costs.
            at_end: (n, size) gradient with respect to what is seen after the last action.

        Returns:
            (actions, n, k) with respect to the actions, those that later ones answer included.
        """
        unroll = self._unroll
        unroll.weigh(weights)
        if at_end is not None:
            unroll.back_through_observe(unroll.actions, at_end.numpy())
        gradients = []
        for k in reversed(range(unroll.actions)):
            gradients.append(unroll.back_through_act(k).copy())
            unroll.back_through_observe(k, self._steps.back(gradients[-1]))
        return torch.from_numpy(np.stack(gradients[::-1]))


def tamed(gradients: torch.Tensor, outlier: float) -> tuple[torch.Tensor, int]:
    """Gradients (actions, n, k) where no environment pulls much harder than the others.

    One in which policy and limits chatter has a gradient that grows with every step back, and would be all
    there is in the sum. One that is not finite is left out.

    Args:
        gradients: From :meth:`ThroughTime.lead_back`.
        outlier: A gradient is shortened to so many times the median environment's.

    Returns:
        The gradients, and how many environments were left out.
    """
    norms = gradients.flatten(2).pow(2).sum(dim=(0, 2)).sqrt()
    sound = torch.isfinite(norms)
    left_out = int((~sound).sum())
    if not sound.any():
        return torch.zeros_like(gradients), left_out
    largest = outlier * norms[sound].median()
    factors = torch.where(sound, torch.clamp(largest / norms.clamp_min(_TINY), max=1.0), 0.0)
    return torch.nan_to_num(gradients, 0.0, 0.0, 0.0) * factors[None, :, None], left_out
