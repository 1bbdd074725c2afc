"""What is still to come: the discounted mean cost after a window, learned from what came.

The value is the square of a network's output, for costs are squares, too: of errors that grow as the machine
strays. It learns by temporal differences (TD(lambda)) towards a slowly following copy of itself, each value
relative to its size.
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
from ....envs.task.unroll import TaskUnroll
from ...networks import Actor, ActorSteps, Latent

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


# What a window of a drive costs: its actions, and by a learned value what is still to come.


Floats = NDArray[np.float64]


@configuration
class ValueOptions:
    """The value of what comes after a window.

    Args:
        horizon: Time constant of the discount, s.
        trace: lambda of its targets: 0 trusts the next value, 1 what the window cost.
        learning_rate: Of Adam.
        net_arch: Entries of each hidden layer.
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


class Ahead:
    """The mean cost of a window, or with a value the discounted one from its beginning on.

    Args:
        options: Of the value; None for no value.
        actor: Whose observations are valued.
        length: Actions of a window.
        time_step: Of an action, s.
    """

    def __init__(self, options: ValueOptions | None, actor: Actor, length: int, time_step: float) -> None:
        self._options, self._critic = options, None
        self._shares, self._of_end = np.full(length, 1.0 / length), 0.0
        if options is not None:
            self._critic = Critic(actor, options.net_arch, options.learning_rate)
            self._discount = math.exp(-time_step / options.horizon)
            powers = self._discount ** np.arange(length + 1)
            self._shares, self._of_end = (1.0 - self._discount) * powers[:-1], float(powers[-1])

    def waits(self, rounds: int) -> bool:
        """Whether the policy has to wait for the value after so many rounds."""
        return self._options is not None and rounds < self._options.lead

    def whole(self, costs: Floats, end: torch.Tensor) -> Floats:
        """(n,) costs of windows.

        Args:
            costs: (length, n) of their actions.
            end: (n, size) what is seen after the last.
        """
        whole: Floats = self._shares @ costs
        if self._critic is None:
            return whole
        with torch.no_grad():
            return np.asarray(whole + self._of_end * self._critic(end).numpy())

    def weights(self, weights: Floats) -> Floats:
        """(length, n) of the costs of actions, for windows that count with ``weights`` (n,)."""
        return np.asarray(self._shares[:, None] * weights)

    def gradient(self, end: torch.Tensor, weights: Floats) -> torch.Tensor | None:
        """(n, size) of the weighted value of the ends ``end`` (n, size); None without a value."""
        if self._critic is None:
            return None
        return self._critic.gradient(end) * torch.from_numpy(self._of_end * weights).float()[:, None]

    def learn(self, seen: torch.Tensor, costs: Floats) -> dict[str, float]:
        """An epoch of the value over windows, where all is finite; returns what there is to log.

        Args:
            seen: (length + 1, n, size) before each action and after the last.
            costs: (length, n).
        """
        sound = torch.from_numpy(np.isfinite(costs).all(axis=0)) & seen.isfinite().all(dim=2).all(dim=0)
        if self._critic is None or self._options is None or not sound.any():
            return {}
        seen, told = seen[:, sound], torch.from_numpy(costs).float()[:, sound]
        targets = self._critic.targets(seen, told, self._discount, self._options.trace)
        inputs = seen[:-1].flatten(0, 1)
        return {"train/value_error": self._critic.learn(inputs, targets.flatten(), self._options.batches)}

    def state(self) -> dict[str, Any]:
        """Everything that changes."""
        if self._critic is None:
            return {}
        return {"weights": self._critic.state_dict(), **self._critic.progress()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        if self._critic is not None:
            self._critic.load_state_dict(state["weights"])
            self._critic.go_on(state)


# The gradient of what a drive costs with respect to a policy's weights: back through machine and policy.


_TINY: Final = 1e-30


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
