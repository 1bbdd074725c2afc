"""Agents with random weights, for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from motion_cueing.baselines.registry import POLICIES
from motion_cueing.baselines.washout.classical.policies import KNOBS
from motion_cueing.envs.task import TaskOptions
from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.train.agents import Agent, Network, Record, RecurrentNetwork, names, register_agents
from motion_cueing.train.agents.network import LstmLayer

RECORD = Record(
    algo="ppo", seed=3, command="motion-cueing train --algo ppo", steps=1000, versions={"numpy": "2.0"}
)


def network(sizes, seed: int = 0, normalized: bool = True, **choices: Any) -> Network:
    """A network with the sizes of its layers, input first."""
    rng = np.random.default_rng(seed)
    extra = [0] * (len(sizes) - 2) + [sizes[0] if choices.get("skip") else 0]
    shapes = [(b, a + e) for a, b, e in zip(sizes, sizes[1:], extra, strict=False)]
    statistics = {}
    if normalized:
        statistics = {"mean": rng.normal(size=sizes[0]), "variance": rng.uniform(0.01, 4.0, sizes[0])}
    return Network(
        weights=tuple(rng.normal(size=shape) / np.sqrt(shape[1]) for shape in shapes),
        biases=tuple(0.1 * rng.normal(size=shape[0]) for shape in shapes),
        **{**statistics, **choices},
    )


def recurrent(size: int, units=(6, 5), outputs: int = 9, seed: int = 0, **choices: Any) -> RecurrentNetwork:
    """A network with LSTM layers of these units."""
    rng, layers, inputs = np.random.default_rng(seed), [], size
    for n in units:
        shapes = (4 * n, inputs), (4 * n, n), (4 * n,)
        layers.append(LstmLayer(*(rng.normal(size=shape) / np.sqrt(n) for shape in shapes)))
        inputs = n
    statistics = {"mean": rng.normal(size=size), "variance": rng.uniform(0.01, 4.0, size)}
    return RecurrentNetwork(
        tuple(layers), network((inputs, 4, outputs), normalized=False), **statistics, **choices
    )


def agent(task: TaskOptions | None = None, base: Any = None, name: str = "random", **choices: Any) -> Agent:
    """An agent with a small network that fits a task."""
    task = task or TaskOptions()
    outputs = len(KNOBS) if task.action.mode == "gains" else 9
    size = layout_of(task.observation, task.action.mode, outputs).size
    return Agent(name, task, network((size, 16, 16, outputs), **choices), RECORD, base)


def ship(folder, monkeypatch):
    """Let the agents in a folder, and no others, come with the package until the test is over."""
    own = {name: entry for name, entry in POLICIES._entries.items() if name not in names.agent_names()}
    # Private, as a registry has no other way to forget a name.
    monkeypatch.setattr(POLICIES, "_entries", own)
    monkeypatch.setattr(names, "FOLDER", folder)
    register_agents(folder)
