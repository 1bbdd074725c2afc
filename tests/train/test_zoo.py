"""Hyperparameters for RL-Baselines3-Zoo."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import gymnasium
import pytest
import sb3_contrib
import stable_baselines3

from motion_cueing.envs import ENVIRONMENT_ID, ENVIRONMENTS
from motion_cueing.envs.settings import read_yaml

from ..repository import ROOT

FILES = sorted((ROOT / "train" / "zoo").glob("*.yaml"))
ZOO = ("n_envs", "n_timesteps")
"""What the zoo takes for itself; the rest are arguments of the algorithm."""


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_learning_environments_have_hyperparameters_that_the_algorithm_takes(path):
    found = read_yaml(path)
    assert found.keys() == ENVIRONMENTS.keys() - {ENVIRONMENT_ID}
    name = path.stem.upper()
    algorithm = getattr(stable_baselines3, name, None) or getattr(sb3_contrib, name)
    for values in found.values():
        assert values["n_timesteps"] > 0
        arguments = {key: value for key, value in values.items() if key not in ZOO}
        algorithm(env=gymnasium.make("Pendulum-v1"), device="cpu", **arguments)


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("rl_zoo3") is None, reason="needs rl-zoo3")
def test_the_zoo_trains(tmp_path):
    hyperparameters = ["n_envs:1", "n_steps:64"]
    words = ["-m", "rl_zoo3.train", "--algo", "ppo", "--env", "motion_cueing/CueingPreview-v0", "-n", "64"]
    words += ["--conf-file", str(ROOT / "train" / "zoo" / "ppo.yaml"), "--gym-packages", "motion_cueing.envs"]
    words += ["--eval-freq", "-1", "--env-kwargs", "episode:{'library':2}", "-params", *hyperparameters]
    done = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("logs/ppo/*/*.zip"))
