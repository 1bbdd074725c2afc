"""Every example runs as its docstring says."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import numpy as np
import pytest
import torch

from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.evaluation import measure, rollout
from motion_cueing.train.agents import Agent

from .repository import ROOT

pytestmark = pytest.mark.slow

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
TINY = {
    "train_with_stable_baselines3": ["1", "braking"],
    "cleanrl_style_ppo": [
        "--steps=48", "--num-envs=3", "--num-steps=8", "--epochs=2", "--minibatch=10", "--maneuver=braking",
    ],
}  # fmt: skip
"""Arguments of trainings that take seconds."""


def lines_of(example, cwd, *arguments) -> list[str]:
    """What an example prints."""
    words = [sys.executable, str(example), *arguments]
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("example", [e for e in EXAMPLES if e.stem not in TINY], ids=lambda path: path.stem)
def test_it_runs_and_prints(example, tmp_path):
    assert lines_of(example, tmp_path)


@pytest.mark.parametrize("name", sorted(TINY))
def test_a_trained_agent_is_held_against_the_washout(name, tmp_path):
    lines = lines_of(ROOT / "examples" / f"{name}.py", tmp_path, *TINY[name])
    found = {line.split()[0]: float(line.split()[-1]) for line in lines if " J = " in line}
    (file,) = tmp_path.glob("*.safetensors")
    agent = Agent.load(file)
    assert set(found) == {"classical", agent.name}
    # Three decimals are printed.
    cues = get_maneuver("braking").drive()
    assert found[agent.name] == pytest.approx(measure(rollout(agent, cues)).cue_error, abs=6e-4)
    assert agent.record.steps == {"cleanrl_style_ppo": 48, "train_with_stable_baselines3": 64 * 128}[name]


def test_policies_are_compared_best_first(tmp_path):
    lines = lines_of(ROOT / "examples" / "compare_policies.py", tmp_path, "braking")
    table = {line.split()[0]: float(line.split()[-1]) for line in lines if " J = " in line}
    assert set(table) == {"no-motion", "classical", "carriage-on-springs"}
    assert list(table.values()) == sorted(table.values())
    assert table["classical"] < table["no-motion"]


def test_a_controller_of_ones_own_beats_standing_still(tmp_path):
    lines = lines_of(ROOT / "examples" / "own_controller.py", tmp_path, "braking")
    assert lines[0].split()[:3] == ["maneuver", "policy", "J"]
    rows = [line.split() for line in lines[1:]]
    found = {policy: (float(error), float(sensed)) for _, policy, error, sensed, *_ in rows}
    assert set(found) == {"no-motion", "classical", "tilt-and-shove"}
    assert found["tilt-and-shove"] < found["no-motion"]
    assert found["tilt-and-shove"][1] < found["no-motion"][1]
    assert found["no-motion"][0] == pytest.approx(7.41, abs=0.02)


@pytest.fixture(scope="module")
def ppo():
    """The example of a plain loop, as a module."""
    place = ROOT / "examples" / "cleanrl_style_ppo.py"
    spec = importlib.util.spec_from_file_location("cleanrl_style_ppo", place)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


class Clock:
    """Two environments whose observation is the time in the episode; they are cut off, and fail, at 3."""

    def __init__(self) -> None:
        self.time = np.zeros(2)

    def step(self, action):
        self.time += 1.0
        ends = self.time == 3.0
        truncated, terminated = ends & [True, False], ends & [False, True]
        final = np.full(2, None, dtype=object)
        for i in np.flatnonzero(ends):
            final[i] = np.array([self.time[i]], dtype=np.float32)
        self.time[ends] = 0.0
        info = {"final_obs": final} if ends.any() else {}
        return self.time[:, None].astype(np.float32), np.array([1.0, 2.0]), terminated, truncated, info


def test_the_plain_loop_values_what_was_cut_off_and_not_what_failed(ppo):
    args = ppo.Args(num_steps=4, reward_scale=0.5)
    agent = ppo.ActorCritic(1, 1)
    played, after = ppo.play(Clock(), agent, torch.zeros(2, 1), args)
    value = args.gamma * agent.value(torch.tensor([[3.0]])).item()
    expected = np.zeros((4, 2))
    expected[2, 0] = value
    assert value != 0.0
    np.testing.assert_allclose(played.future.numpy(), expected, rtol=1e-6)
    assert played.observation[:, :, 0].tolist() == [[0, 0], [1, 1], [2, 2], [0, 0]]
    assert played.ended.tolist() == [[False, False], [False, False], [True, True], [False, False]]
    assert played.reward[0].tolist() == [0.5, 1.0]
    assert after.tolist() == [[1.0], [1.0]]


def test_the_plain_loop_estimates_advantages_as_their_definition_does(ppo):
    args = ppo.Args(gamma=0.9, gae_lambda=0.8)
    rng = np.random.default_rng(0)
    reward, future, value = rng.normal(size=(3, 6))
    ended = np.array([False, True, False, False, True, False])
    future[~ended] = 0.0
    after = 0.3

    def error(k):
        following = future[k] if ended[k] else args.gamma * (value[k + 1] if k < 5 else after)
        return reward[k] + following - value[k]

    # The sum of (gamma lambda)^j times the error j steps on, up to the end of the episode or the rollout.
    expected = [sum(0.72**j * error(k + j) for j in range(last - k + 1))
                for k, last in enumerate([1, 1, 4, 4, 4, 5])]  # fmt: skip
    nothing = torch.zeros(6, 1)
    columns = (torch.tensor(c)[:, None] for c in (reward, future, ended, value))
    found = ppo.advantages(ppo.Rollout(nothing, nothing, nothing, *columns), torch.tensor([after]), args)
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-6)
