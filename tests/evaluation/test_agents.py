"""Agents are evaluated by file or name as any other policy, and need nothing else."""

from __future__ import annotations

import json

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.evaluation import Trajectory, policies, rollout

from ..envs.task.tasks import drive
from ..train.agents import agent, ship

PAPER = get_platform("paper")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A package with the agents `near` and, for another machine, `far`."""
    agent(name="near").save(tmp_path / "near.safetensors")
    agent(TaskOptions(platform="24-inch"), name="far").save(tmp_path / "far.safetensors")
    ship(tmp_path, monkeypatch)
    return tmp_path


def test_names_are_those_of_baselines_and_agents(folder):
    names = policies.policy_names()
    assert {"no-motion", "classical", "near", "far"} <= set(names)
    assert policies.describe_policy("near") == "agent by ppo for the motion base paper, action acceleration"
    assert policies.describe_policy("no-motion") == "the machine stands still"
    with pytest.raises(UnknownNameError, match="Did you mean near"):
        policies.make_policy("naer", PAPER)


def test_agents_of_a_machine_are_compared_by_default(folder):
    assert "near" in policies.default_policies(PAPER)
    assert "far" not in policies.default_policies(PAPER)
    assert "far" in policies.default_policies(get_platform("24-inch"))


def test_a_policy_is_found_by_name_or_file(folder, tmp_path):
    agent(name="mine").save(tmp_path / "mine.safetensors")
    assert policies.make_policy("near", PAPER).name == "near"
    assert policies.make_policy(str(tmp_path / "mine.safetensors"), PAPER).name == "mine"
    assert isinstance(policies.make_policy("classical", PAPER), ClassicalWashout)
    with pytest.raises(ConfigurationError, match="far was made for the motion base '24-inch', not 'paper'"):
        policies.make_policy("far", PAPER)
    with pytest.raises(DataError, match="there is no such file"):
        policies.make_policy("none.safetensors", PAPER)


def test_an_agent_drives_what_it_was_made_for():
    task = TaskOptions(
        observation=ObservationOptions(preview=4, perceived=True, stack=2),
        action=ActionOptions(mode="residual", authority=0.3, repeat=3),
    )
    one = agent(task, "classical")
    found = rollout(one, drive())
    assert found.policy == "random"
    assert json.loads(found.metadata["parameters"])["algo"] == "ppo"
    washout = rollout(ClassicalWashout(), drive())
    assert np.abs(found.hexapod - washout.hexapod).max() > 0.01
    assert np.isfinite(found.step_time).sum() == 100


@pytest.mark.slow
def test_the_command_evaluates_a_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    agent(name="called otherwise").save("mine.safetensors")
    drive(samples=101).to_csv("weave.csv")
    words = ["evaluate", "--policies", "mine.safetensors", "no-motion", "--maneuvers", "weave.csv"]
    assert main([*words, "--out", "out"]) == 0
    said = capsys.readouterr().out
    assert "mine" in said
    assert Trajectory.load(tmp_path / "out" / "trajectories" / "weave--mine.npz").policy == "mine"
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert results["provenance"]["configuration"]["policies"]["mine"]["parameters"]["seed"] == 3


def test_the_command_refuses_what_does_not_fit(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    agent().save("mine.safetensors")
    (tmp_path / "cut.safetensors").write_bytes((tmp_path / "mine.safetensors").read_bytes()[:-9])
    (tmp_path / "model.zip").write_bytes(b"PK\x03\x04")
    for policy, platform, told in (
        ("mine.safetensors", "nads-1", "made for the motion base 'paper', not 'nads-1'"),
        ("cut.safetensors", "paper", "broken or cut off"),
        ("model.zip", "paper", "`motion-cueing convert model.zip --environment ID"),
    ):
        words = ["evaluate", "--policies", policy, "--platform", platform, "--out", "out"]
        assert main(words) == 2
        said = capsys.readouterr().err
        assert told in said
        assert len(said.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_the_list_names_agents(folder, capsys):
    assert main(["list"]) == 0
    assert "agent by ppo" in capsys.readouterr().out
