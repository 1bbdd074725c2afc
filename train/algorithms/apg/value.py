"""Value bootstrap: the cost after a window, learned by TD(lambda), as in SHAC (Xu et al. 2022).

With costs c_k a time and discount gamma, a window of length T costs
(1 - gamma) sum_k gamma^k c_k + gamma^T V(observation after it). Without a value it costs their mean.

V is the square of a network's output, because costs are squares of errors. It follows a target network that
moves slowly. Errors count relative to the value's size.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Annotated, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from torch import nn

from ....envs.settings import Positive, configuration
from ....envs.task.options import Count, PositiveCount
from ...networks import Actor, HiddenLayers

Floats = NDArray[np.float64]

_TARGET_RATE: Final = 0.05
"""Share of the way to the network that the target network moves at each update."""

_RESOLUTION: Final = 0.2
"""Errors of a value count relative to this plus the value."""

_WORD: Final = 2**63 - 1


@configuration
class ValueOptions:
    """The value of what comes after a window.

    Args:
        horizon: Time constant of the discount, s.
        trace: lambda of its targets: 0 trusts the next value, 1 what the window cost.
        learning_rate: Of Adam.
        net_arch: Units of each hidden layer.
        batches: Updates a round.
        lead: Rounds in which the value learns before the policy does: the gradient of a wrong one is worse
            than none.
    """

    horizon: Positive = 4.0
    trace: Annotated[float, Field(ge=0.0, le=1.0)] = 0.95
    learning_rate: Positive = 1e-3
    net_arch: tuple[PositiveCount, ...] = (128, 128)
    batches: PositiveCount = 8
    lead: Count = 100


class Critic(nn.Module):
    """Value network: discounted mean cost from an observation on, with its target network and optimizer.

    Args:
        actor: Whose normalization of observations it shares.
        hidden: Units of each hidden layer.
        learning_rate: Of Adam.
    """

    mean: torch.Tensor
    deviation: torch.Tensor

    def __init__(self, actor: Actor, hidden: tuple[int, ...], learning_rate: float) -> None:
        super().__init__()
        self.register_buffer("mean", actor.mean.clone())
        self.register_buffer("deviation", actor.deviation.clone())
        latent = HiddenLayers(actor.mean.numel(), hidden, actor.latent.activation)
        head = nn.Linear(latent.size, 1)
        self.value = nn.Sequential(latent, head)
        with torch.no_grad():
            head.weight.mul_(0.1)
            head.bias.fill_(1.0)
        self.slow = copy.deepcopy(self.value).requires_grad_(False)
        self.optimizer = torch.optim.Adam(self.value.parameters(), lr=learning_rate)
        self._order = torch.Generator().manual_seed(torch.initial_seed() & _WORD)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """(...,) cost a time from observations (..., size) on, by the target network."""
        return self._value(self.slow, observation)

    def _value(self, network: nn.Module, observation: torch.Tensor) -> torch.Tensor:
        value: torch.Tensor = network((observation - self.mean) / self.deviation)
        return value.squeeze(-1).square()

    def gradient(self, observation: torch.Tensor) -> torch.Tensor:
        """(n, size) of the value at observations (n, size)."""
        point = observation.detach().requires_grad_(True)
        (gradient,) = torch.autograd.grad(self(point).sum(), point)
        return gradient

    def targets(
        self, observations: torch.Tensor, costs: torch.Tensor, discount: float, trace: float
    ) -> torch.Tensor:
        """(actions, n) TD(lambda) values of ``observations`` (actions + 1, n, size), costs (actions, n)."""
        with torch.no_grad():
            values = self(observations)
        targets = torch.empty_like(costs)
        later = values[-1]
        for k in reversed(range(len(costs))):
            later = (1.0 - discount) * costs[k] + discount * later
            targets[k] = later
            later = (1.0 - trace) * values[k] + trace * later
        return targets

    def learn(self, observations: torch.Tensor, targets: torch.Tensor, batches: int) -> float:
        """An epoch over observations (k, size) in so many batches; returns the mean error."""
        total = 0.0
        with torch.no_grad():
            size = _RESOLUTION + self(observations)
        for part in torch.randperm(len(observations), generator=self._order).chunk(batches):
            value = self._value(self.value, observations[part])
            loss = nn.functional.smooth_l1_loss(value / size[part], targets[part] / size[part])
            self.optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(self.value.parameters(), 1.0)
            self.optimizer.step()
            total += float(loss.detach()) / batches
        with torch.no_grad():
            for slow, fast in zip(self.slow.parameters(), self.value.parameters(), strict=True):
                slow.lerp_(fast, _TARGET_RATE)
        return total

    def state(self) -> dict[str, Any]:
        """Everything that changes."""
        optimizer, order = self.optimizer.state_dict(), self._order.get_state()
        return {"weights": self.state_dict(), "optimizer": optimizer, "order": order}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        self.load_state_dict(state["weights"])
        self.optimizer.load_state_dict(state["optimizer"])
        self._order.set_state(state["order"])


class ValueBootstrap:
    """Cost of a window: the mean, or with a value the discounted cost from its start on.

    Args:
        options: Of the value; None for no value.
        actor: Whose observations are valued.
        length: Actions of a window.
        time_step: Of an action, s.
    """

    def __init__(self, options: ValueOptions | None, actor: Actor, length: int, time_step: float) -> None:
        self._options, self._critic = options, None
        self._shares, self._share_of_end = np.full(length, 1.0 / length), 0.0
        if options is not None:
            self._critic = Critic(actor, options.net_arch, options.learning_rate)
            self._discount = math.exp(-time_step / options.horizon)
            powers = self._discount ** np.arange(length + 1)
            self._shares, self._share_of_end = (1.0 - self._discount) * powers[:-1], float(powers[-1])

    def warming_up(self, rounds: int) -> bool:
        """Whether the value alone learns in the round after so many."""
        return self._options is not None and rounds < self._options.lead

    def cost(self, costs: Floats, end: torch.Tensor) -> Floats:
        """(n,) costs of windows.

        Args:
            costs: (length, n) of their actions.
            end: (n, size) observations after the last.
        """
        cost: Floats = self._shares @ costs
        if self._critic is None:
            return cost
        with torch.no_grad():
            return np.asarray(cost + self._share_of_end * self._critic(end).numpy())

    def weights(self, weights: Floats) -> Floats:
        """(length, n) of the costs of actions, for windows that count with ``weights`` (n,)."""
        return np.asarray(self._shares[:, None] * weights)

    def gradient(self, end: torch.Tensor, weights: Floats) -> torch.Tensor | None:
        """(n, size) of the weighted value at observations ``end`` (n, size); None without a value."""
        if self._critic is None:
            return None
        return self._critic.gradient(end) * torch.from_numpy(self._share_of_end * weights).float()[:, None]

    def learn(self, observations: torch.Tensor, costs: Floats) -> dict[str, float]:
        """An epoch of the value over windows where all is finite; returns scalars for the log.

        Args:
            observations: (length + 1, n, size) before each action and after the last.
            costs: (length, n).
        """
        finite = observations.isfinite().all(dim=2).all(dim=0)
        finite &= torch.from_numpy(np.isfinite(costs).all(axis=0))
        if self._critic is None or self._options is None or not finite.any():
            return {}
        observations, finite_costs = observations[:, finite], torch.from_numpy(costs).float()[:, finite]
        targets = self._critic.targets(observations, finite_costs, self._discount, self._options.trace)
        inputs = observations[:-1].flatten(0, 1)
        return {"train/value_error": self._critic.learn(inputs, targets.flatten(), self._options.batches)}

    def state(self) -> dict[str, Any]:
        """Everything that changes."""
        return {} if self._critic is None else self._critic.state()

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        if self._critic is not None:
            self._critic.restore(state)
