"""Every example runs as its docstring says."""

from __future__ import annotations

import importlib
import importlib.util
import subprocess
import sys

import numpy as np
import pytest
import torch

from motion_cueing.baselines import make_policy
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.options import load_task
from motion_cueing.envs.task.vector import DrivingSimulatorVector
from motion_cueing.evaluation import measure, rollout
from motion_cueing.train.agents import Agent

from .repository import ROOT

pytestmark = pytest.mark.slow

PLACE = ROOT / "examples"
TRAININGS = {
    "cleanrl_style_ppo": None,
    "train_with_sbx": "sbx",
    "train_with_skrl": "skrl",
    "train_with_stable_baselines3": None,
    "train_with_torchrl": "torchrl",
}
"""Examples of training, with the library and extra that each needs beyond the extra ``train``."""
SHARED = "comparison"
"""What those examples share; it is none itself."""
EXAMPLES = sorted(path for path in PLACE.glob("*.py") if path.stem not in {*TRAININGS, SHARED})


def need(library: str | None) -> None:
    """Skip the test where a library is not installed."""
    if library is not None and importlib.util.find_spec(library) is None:
        pytest.skip(f"needs the extra {library}")


def lines_of(example, cwd, *arguments) -> list[str]:
    """What an example prints."""
    words = [sys.executable, str(example), *arguments]
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_it_runs_and_prints(example, tmp_path):
    assert lines_of(example, tmp_path)


@pytest.fixture(scope="module")
def unseen():
    """The first two of the drives that no training has seen."""
    return Batch(1, load_task("cueing-preview", episode={"library": 2, "library_seed": 1_000_000})).drives


@pytest.mark.parametrize("name", sorted(TRAININGS))
def test_a_trained_agent_is_held_against_its_washout(name, unseen, tmp_path):
    need(TRAININGS[name])
    words = [
        "--steps=128",
        "--num-envs=8",
        "--rollout=16",
        "--library=2",
        "--drives=2",
        "--seed=3",
        "--out=mine.safetensors",
    ]
    lines = lines_of(PLACE / f"{name}.py", tmp_path, *words)
    found = {line.split()[0]: float(line.split()[-1]) for line in lines if " J = " in line}
    agent = Agent.load(tmp_path / "mine.safetensors")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.safetensors"]
    assert found.keys() == {"linear-washout", "mine"}
    for policy in (agent, make_policy("linear-washout", agent.platform)):
        errors = [measure(rollout(policy, cues)).cue_error for cues in unseen]
        # The batch scores where actions end, a rollout everywhere; three decimals are printed.
        assert found[policy.name] == pytest.approx(np.mean(errors), rel=2e-3)
    assert agent.task == load_task("cueing-preview", episode={"library": 2})
    assert (agent.record.steps, agent.record.seed) == (128, 3)


@pytest.fixture
def example(monkeypatch):
    """Loads an example as a module."""
    monkeypatch.syspath_prepend(PLACE)
    yield importlib.import_module
    for path in PLACE.glob("*.py"):
        sys.modules.pop(path.stem, None)


def test_policies_are_compared_best_first(example, capsys):
    example("compare_policies").main("braking")
    lines = capsys.readouterr().out.splitlines()
    table = {line.split()[0]: float(line.split()[-1]) for line in lines if " J = " in line}
    assert set(table) == {"no-motion", "classical", "carriage-on-springs"}
    assert list(table.values()) == sorted(table.values())
    assert table["classical"] < table["no-motion"]


def test_a_controller_of_ones_own_beats_standing_still(example, capsys):
    example("own_controller").main("braking")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["maneuver", "policy", "J"]
    rows = [line.split() for line in lines[1:]]
    found = {policy: (float(error), float(sensed)) for _, policy, error, sensed, *_ in rows}
    assert set(found) == {"no-motion", "classical", "tilt-and-shove"}
    assert found["tilt-and-shove"] < found["no-motion"]
    assert found["tilt-and-shove"][1] < found["no-motion"][1]
    assert found["no-motion"][0] == pytest.approx(7.41, abs=0.02)


@pytest.fixture
def ppo(example):
    """The example of a plain loop."""
    return example("cleanrl_style_ppo")


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
    args = ppo.Args(rollout=4)
    agent = ppo.ActorCritic(1, 1)
    played, after = ppo.play(Clock(), agent, torch.zeros(2, 1), args)
    value = args.gamma * agent.value(torch.tensor([[3.0]])).item()
    expected = np.zeros((4, 2))
    expected[2, 0] = value
    assert value != 0.0
    np.testing.assert_allclose(played.future.numpy(), expected, rtol=1e-6)
    assert played.observation[:, :, 0].tolist() == [[0, 0], [1, 1], [2, 2], [0, 0]]
    assert played.ended.tolist() == [[False, False], [False, False], [True, True], [False, False]]
    assert played.reward[0].tolist() == [1.0, 2.0]
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


def test_torchrl_values_the_last_observation_of_an_episode_and_begins_the_next(example):
    need("torchrl")
    import tensordict
    from torchrl.envs.utils import check_env_specs

    task = load_task("cueing-preview", episode={"library": 2, "drive_duration": 8.0, "duration": 0.32})
    torchrl = example("train_with_torchrl")
    env = torchrl.Cueing(2, task, seed=5)
    check_env_specs(env)
    env = torchrl.Cueing(2, task, seed=5)
    actions = torch.from_numpy(np.random.default_rng(0).uniform(-1, 1, (6, 2, 4)).astype(np.float32))
    batch = DrivingSimulatorVector(2, task, autoreset_mode="SameStep")
    observation, _ = batch.reset(seed=5)
    now = env.reset()
    for action in actions:
        np.testing.assert_array_equal(now["observation"].numpy(), observation)
        played, now = env.step_and_maybe_reset(now.update(tensordict.TensorDict({"action": action}, [2])))
        observation, reward, _, truncated, info = batch.step(action.numpy())
        last = np.stack(info["final_obs"]) if truncated.all() else observation
        np.testing.assert_array_equal(played["next", "observation"].numpy(), last)
        np.testing.assert_allclose(played["next", "reward"][:, 0].numpy(), reward, rtol=1e-6)
        assert played["next", "truncated"][:, 0].tolist() == truncated.tolist()
