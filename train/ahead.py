"""What a window of a drive costs: its actions, and by a learned value what is still to come."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from ..envs.settings import Positive, configuration
from ..envs.task.options import Count, PositiveCount
from .actor import Actor
from .critic import Critic

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
