"""Agents whose observation describes the platform, on all platforms."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import ablation_names, get_platform, platform_names
from motion_cueing.envs.task import DrivingSimulator, TaskOptions
from motion_cueing.evaluation import policies, rollout
from motion_cueing.realtime.machine import make_machine

from ..envs.task.tasks import drive
from ..train.agents import agent, ship

pytestmark = pytest.mark.slow

TOLD = TaskOptions(observation={"machine": True, "frame": "cab"}, action={"frame": "cab", "authority": 0.1})


@pytest.mark.parametrize("name", [*platform_names(), "paper-hexapod-only"])
def test_it_drives_any_machine_as_in_an_environment_of_it(name):
    one, platform = agent(TOLD), get_platform(name)
    found = rollout(one, drive(samples=51), platform)
    env = DrivingSimulator(one.for_platform(platform).task, drives=[drive(samples=51)])
    observation, _ = env.reset(seed=0)
    asked = []
    for _ in range(50):
        observation, *_ = env.step(one.predict(observation)[0])
        asked.append(env.batch.commanded[0])
    assert found.platform == platform.name
    np.testing.assert_allclose(found.action[1:], asked, rtol=1e-12)
    assert np.abs(found.hexapod).max() > 1e-6


def test_what_it_does_depends_on_what_it_is_told():
    one = agent(TOLD)
    moves = [rollout(one, drive(samples=31), get_platform(name)).hexapod for name in ("paper", "24-inch")]
    assert np.abs(moves[0] - moves[1]).max() > 1e-6


def test_by_name_it_is_made_for_the_machine_at_hand(tmp_path, monkeypatch):
    agent(TOLD, name="any").save(tmp_path / "any.safetensors")
    agent(name="one").save(tmp_path / "one.safetensors")
    ship(tmp_path, monkeypatch)
    for name in [*platform_names(), *ablation_names()]:
        platform = get_platform(name)
        assert policies.make_policy("any", platform).platform == platform
        assert "any" in policies.default_policies(platform)
    assert "one" not in policies.default_policies(get_platform("24-inch"))
    with pytest.raises(ConfigurationError, match="one was made for the motion base 'paper', not '24-inch'"):
        policies.make_policy("one", get_platform("24-inch"))


def test_the_command_evaluates_it_on_another_machine(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    agent(TOLD, name="any").save("any.safetensors")
    drive(samples=101).to_csv("weave.csv")
    words = ["evaluate", "--policies", "any.safetensors", "--platform", "nads-1", "--maneuvers", "weave.csv"]
    assert main([*words, "--out", "out"]) == 0
    assert "any" in capsys.readouterr().out
    agent(name="one").save("one.safetensors")
    assert main([*words[:2], "one.safetensors", *words[3:], "--out", "other"]) == 2
    said = capsys.readouterr().err
    assert "was made for the motion base 'paper'" in said
    assert "such as 'learned-any'" in said


def test_it_runs_in_the_loop_on_any_machine():
    platform = get_platform("24-inch")
    machine = make_machine(agent(TOLD), platform)
    assert machine.now.platforms == [platform]
