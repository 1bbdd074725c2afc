"""Algorithms of another package, by call and by entry point."""

from __future__ import annotations

import sys

import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.train import register
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import load_config
from motion_cueing.train.registry import ALGORITHMS, algorithm_names

LEARNER = '''
"""A policy that does nothing, found without learning."""
from pathlib import Path

import numpy as np

from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.train import Learner
from motion_cueing.train.agents import Network


class Still(Learner):
    preset = Path(__file__).parent / "still.yaml"

    def __init__(self, config):
        self._size = layout_of(config.task.observation, config.task.action.mode, 9).size
        self._total, self._steps = config.steps, 0

    @property
    def steps(self):
        return self._steps

    def learn(self, boundary):
        while self._steps < self._total:
            boundary()
            self._steps += 100

    def scalars(self):
        return {"train/nothing": 0.0}

    def network(self):
        return Network((np.zeros((9, self._size)),), (np.zeros(9),))

    def state(self):
        return {"steps": self._steps}

    def restore(self, state):
        self._steps = state["steps"]
'''
PRESET = """
steps: 300
normalize: {observation: false, reward: false}
task: {episode: {library: 1, drive_duration: 5.0}}
validation: {every: 200, drives: 1, duration: 3.0}
"""
ENTRY_POINT = "[motion_cueing.algorithms]\nstill = someones_package:Still\n"


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with an algorithm, as an installation would leave it."""
    site = tmp_path / "site"
    (site / "someones_package-1.0.dist-info").mkdir(parents=True)
    (site / "someones_package-1.0.dist-info" / "METADATA").write_text(
        "Name: someones-package\nVersion: 1.0\n"
    )
    (site / "someones_package-1.0.dist-info" / "entry_points.txt").write_text(ENTRY_POINT)
    (site / "someones_package").mkdir()
    (site / "someones_package" / "__init__.py").write_text(LEARNER)
    (site / "someones_package" / "still.yaml").write_text(PRESET)
    monkeypatch.syspath_prepend(site)
    # Entry points are looked up once a process, and nothing can be taken out of a registry.
    monkeypatch.setattr(ALGORITHMS, "_discovered", False)
    monkeypatch.setattr(ALGORITHMS, "_entries", dict(ALGORITHMS._entries))
    yield "someones_package"
    sys.modules.pop("someones_package", None)


def test_an_installed_package_brings_an_algorithm(package, tmp_path, capsys):
    assert "still" in algorithm_names()
    assert ALGORITHMS.description("still") == "from someones-package"
    assert load_config("still").steps == 300
    assert main(["train", "--algo", "still", "--out", str(tmp_path / "run")]) == 0
    agent = Agent.load(tmp_path / "run" / "final.safetensors")
    assert (agent.record.algo, agent.record.steps) == ("still", 300)


def test_an_algorithm_is_registered_by_a_call(package):
    register("mine", "someones_package:Still", "does nothing")
    assert ALGORITHMS["mine"].__name__ == "Still"
    assert load_config("mine").algo == "mine"
    with pytest.raises(ConfigurationError, match="algorithm 'ppo' is registered already"):
        register("ppo", "someones_package:Still")
    register("ppo", "someones_package:Still", replace=True)
    assert ALGORITHMS["ppo"] is ALGORITHMS["mine"]


def test_a_module_that_cannot_be_imported_is_named(package):
    register("broken", "someones_package:Missing")
    with pytest.raises(ConfigurationError, match="algorithm 'broken': someones_package:Missing cannot be"):
        load_config("broken")


def test_a_misspelt_name_is_answered_with_a_near_one():
    with pytest.raises(UnknownNameError, match="Did you mean ppo"):
        load_config("pppo")
