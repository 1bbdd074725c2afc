"""What is still to come: the discounted mean cost after a window, learned from what came.

The value is the square of a network's output, for costs are squares, too: of errors that grow as the machine
strays. It learns by temporal differences (TD(lambda)) towards a slowly following copy of itself, each value
relative to its size.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, Final

import torch
from torch import nn

from .actor import Actor, Latent

_FOLLOW: Final = 0.05
"""Share of the way to the network that its copy goes at each update."""

_RESOLUTION: Final = 0.2
"""Errors of a value count relative to this plus the value."""

_WORD: Final = 2**63 - 1


class Critic(nn.Module):
    """Discounted mean cost from an observation on.

    Args:
        actor: Whose standard of observations it shares.
        hidden: Entries of each hidden layer.
        learning_rate: Of Adam.
    """

    def __init__(self, actor: Actor, hidden: tuple[int, ...], learning_rate: float) -> None:
        super().__init__()
        self.register_buffer("mean", actor.mean.clone())
        self.register_buffer("deviation", actor.deviation.clone())
        self.mean: torch.Tensor
        self.deviation: torch.Tensor
        latent = Latent(actor.mean.numel(), hidden, actor.latent.activation)
        head = nn.Linear(latent.size, 1)
        self.value = nn.Sequential(latent, head)
        with torch.no_grad():
            head.weight.mul_(0.1)
            head.bias.fill_(1.0)
        self.slow = copy.deepcopy(self.value).requires_grad_(False)
        self.optimizer = torch.optim.Adam(self.value.parameters(), lr=learning_rate)
        self._order = torch.Generator().manual_seed(torch.initial_seed() & _WORD)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """(...,) cost a time from observations (..., size) on, by the slow copy."""
        return self._of(self.slow, observation)

    def _of(self, network: nn.Module, observation: torch.Tensor) -> torch.Tensor:
        value: torch.Tensor = network((observation - self.mean) / self.deviation)
        return value.squeeze(-1).square()

    def gradient(self, observation: torch.Tensor) -> torch.Tensor:
        """(n, size) of the value at observations (n, size)."""
        point = observation.detach().requires_grad_(True)
        (found,) = torch.autograd.grad(self(point).sum(), point)
        return found

    def targets(self, seen: torch.Tensor, costs: torch.Tensor, discount: float, trace: float) -> torch.Tensor:
        """(actions, n) TD(lambda) values of ``seen`` (actions + 1, n, size) from ``costs`` (actions, n)."""
        with torch.no_grad():
            values = self(seen)
        found = torch.empty_like(costs)
        later = values[-1]
        for k in reversed(range(len(costs))):
            later = (1.0 - discount) * costs[k] + discount * later
            found[k] = later
            later = (1.0 - trace) * values[k] + trace * later
        return found

    def progress(self) -> dict[str, Any]:
        """What :meth:`go_on` needs beside the parameters."""
        return {"optimizer": self.optimizer.state_dict(), "order": self._order.get_state()}

    def go_on(self, progress: Mapping[str, Any]) -> None:
        """Go on from what :meth:`progress` told."""
        self.optimizer.load_state_dict(progress["optimizer"])
        self._order.set_state(progress["order"])

    def learn(self, seen: torch.Tensor, targets: torch.Tensor, batches: int) -> float:
        """An epoch over observations (k, size) in so many batches; returns the mean error."""
        total = 0.0
        with torch.no_grad():
            size = _RESOLUTION + self(seen)
        for part in torch.randperm(len(seen), generator=self._order).chunk(batches):
            value = self._of(self.value, seen[part])
            loss = nn.functional.smooth_l1_loss(value / size[part], targets[part] / size[part])
            self.optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(self.value.parameters(), 1.0)
            self.optimizer.step()
            total += float(loss.detach()) / batches
        with torch.no_grad():
            for slow, fast in zip(self.slow.parameters(), self.value.parameters(), strict=True):
                slow.lerp_(fast, _FOLLOW)
        return total
