"""Means over what was played since the last row of the log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from ..envs.task.reward_kernel import TERMS


class Monitor:
    """Sums reward and its terms over steps, and returns and lengths over episodes that ended."""

    def __init__(self) -> None:
        self._sums: dict[str, float] = {}
        self._steps, self._episodes = 0, 0

    def step(
        self, reward: NDArray[Any], terms: NDArray[Any], infos: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        """Add a step.

        Args:
            reward: (n,) of each environment.
            terms: (n, N_TERMS) terms of the reward.
            infos: Of each environment; ``episode`` where one has ended, as ``Monitor`` of
                Stable-Baselines3 tells it.
        """
        self._steps += 1
        self._add("rollout/reward", float(reward.mean()))
        for name, value in zip(TERMS, terms.mean(axis=0).tolist(), strict=True):
            self._add(f"terms/{name}", value)
        for info in infos:
            if "episode" in info:
                self._episodes += 1
                self._add("rollout/episode_return", info["episode"]["r"])
                self._add("rollout/episode_steps", info["episode"]["l"])

    def _add(self, name: str, value: float) -> None:
        self._sums[name] = self._sums.get(name, 0.0) + float(value)

    def take(self) -> dict[str, float]:
        """The means, and begin anew; empty where nothing was played."""
        counts = {name: self._episodes if "episode" in name else self._steps for name in self._sums}
        means = {name: total / counts[name] for name, total in self._sums.items()}
        self._sums, self._steps, self._episodes = {}, 0, 0
        return means

    def state(self) -> dict[str, Any]:
        """The sums, for :meth:`restore`."""
        return {"sums": dict(self._sums), "steps": self._steps, "episodes": self._episodes}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        self._sums = dict(state["sums"])
        self._steps, self._episodes = state["steps"], state["episodes"]
