"""Accelerations that are straight lines between nodes: the motion they give, exactly.

On an interval of length h from a_0 to a_1 a double integrator goes to

    v_1 = v_0 + h (a_0 + a_1) / 2,    q_1 = q_0 + h v_0 + h^2 (2 a_0 + a_1) / 6,

and before the first node the acceleration is constant. All nine axes share these maps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """Nodes and what they make of accelerations; n nodes.

    Args:
        times: (n,) from now, s.
        position: (n, n) from accelerations at the nodes to positions there.
        rate: (n, n) to rates.
        weights: (n,) of each node in a mean over the horizon, by the trapezoidal rule; their sum is 1.
    """

    times: Floats
    position: Floats
    rate: Floats
    weights: Floats

    def motion(self, position: Floats, rate: Floats, accelerations: Floats) -> tuple[Floats, Floats]:
        """Positions and rates at the nodes, (n, k) each.

        Args:
            position: (k,) now, m or rad.
            rate: (k,) now.
            accelerations: (n, k) at the nodes.
        """
        free = position + np.outer(self.times, rate)
        return free + self.position @ accelerations, rate + self.rate @ accelerations

    def at(self, accelerations: Floats, times: Floats) -> Floats:
        """Accelerations (m, k) of a plan at other times; constant before the first and after the last node.

        Args:
            accelerations: (n, k) at the nodes.
            times: (m,) from now, s.
        """
        j = np.clip(np.searchsorted(self.times, times) - 1, 0, len(self.times) - 2)
        begin, end = self.times[j], self.times[j + 1]
        share = np.clip((times - begin) / (end - begin), 0.0, 1.0)[:, None]
        return np.asarray((1.0 - share) * accelerations[j] + share * accelerations[j + 1])

    def averages(self, dt: float) -> Floats:
        """(n, m) from samples at dt, 2 dt ... to the horizon to one value a node.

        Each node takes the mean under its hat, the line that is 1 there and 0 at its neighbours, so that
        nothing between two nodes is overlooked. The first takes the sample at its own time.
        """
        count = max(round(self.times[-1] / dt), 1)
        samples = dt * np.arange(1, count + 1)
        unit: Any = np.eye(len(self.times))
        hats = np.array([np.interp(samples, self.times, row) for row in unit])
        hats[:, samples < self.times[0]] = 0.0
        hats[0] = 0.0
        hats[0, min(max(round(self.times[0] / dt), 1), count) - 1] = 1.0
        return np.asarray(hats / np.maximum(hats.sum(axis=1, keepdims=True), np.finfo(float).tiny))


def make_grid(nodes: tuple[float, ...]) -> Grid:
    """The grid of nodes at times from now, s."""
    times = np.array(nodes)
    n = len(times)
    position, rate = np.zeros((n, n)), np.zeros((n, n))
    rate[0, 0], position[0, 0] = times[0], 0.5 * times[0] ** 2
    for j, h in enumerate(np.diff(times)):
        rate[j + 1] = rate[j]
        rate[j + 1, j : j + 2] += 0.5 * h
        position[j + 1] = position[j] + h * rate[j]
        position[j + 1, j : j + 2] += h**2 * np.array([2.0, 1.0]) / 6.0
    steps = np.diff(times, prepend=0.0)
    weights = np.append(steps[:-1] + steps[1:], steps[-1])
    weights[0] += steps[0]
    return Grid(times, position, rate, weights / weights.sum())
