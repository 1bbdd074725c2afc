"""Training by analytic gradients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
import yaml

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.settings import from_dict
from motion_cueing.train.agents import Agent, Record
from motion_cueing.train.algorithms.apg.apg import ApgHyperparameters, ApgLearner
from motion_cueing.train.algorithms.apg.backpropagation import Rollout
from motion_cueing.train.config import TrainingConfig, load_config
from motion_cueing.train.registry import StopTraining

SMALL = {
    "n_envs": 3,
    "steps": 3 * 20 * 12,
    "task": {
        "observation": {"memory": [1.0], "frame": "cab"},
        "action": {"frame": "cab", "repeat": 5, "authority": 0.5},
        "episode": {"library": 2, "drive_duration": 6.0, "duration": 1.0, "random_start": True},
    },
    "hyperparameters": {"net_arch": [16]},
}


WINDOWS = {"window": 0.5, "value": {"lead": 2, "net_arch": [16], "batches": 2}, "hidden_rate": 0.05}


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> TrainingConfig:
    path = tmp_path_factory.mktemp("config") / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    return load_config("apg", path)


@pytest.fixture(params=["episodes", "windows"])
def either(request, config) -> TrainingConfig:
    """With windows as long as an episode and Adam, and with shorter ones, a value, and Muon."""
    if request.param == "episodes":
        return config
    return replace(config, hyperparameters={**config.hyperparameters, **WINDOWS})


def nothing() -> None:
    """A boundary where nothing is due."""


def cost(learner: ApgLearner) -> float:
    """Mean cost of the actor as it is, over the same episodes each time."""
    learner.batch.seed(np.ones(learner.batch.n, dtype=bool), list(range(100, 100 + learner.batch.n)))
    learner.batch.begin(np.ones(learner.batch.n, dtype=bool))
    learner._unroll.begin()
    Rollout(learner._unroll, learner.actor)
    return float(learner._unroll.costs.mean())


def test_a_training_lowers_the_cost(config):
    learner = ApgLearner(replace(config, steps=4 * config.steps))
    before = cost(learner)
    learner.learn(nothing)
    told = learner.scalars()
    assert learner.steps == 4 * config.steps
    assert cost(learner) < 0.9 * before
    assert told["train/skipped_rounds"] == 0.0
    assert {"terms/cue_error", "train/gradient_norm", "train/learning_rate"} <= told.keys()


def test_one_that_is_resumed_ends_with_the_same_bits(either):
    config = either
    whole = ApgLearner(config)
    whole.learn(nothing)

    first = ApgLearner(config)

    def stop() -> None:
        if first.steps >= config.steps // 2:
            raise StopTraining

    with pytest.raises(StopTraining):
        first.learn(stop)
    second = ApgLearner(config)
    state = first.state()
    if WINDOWS.items() <= config.hyperparameters.items():
        # As checkpoints of earlier versions name the parts.
        state |= {"descent": state.pop("optimizers"), "ahead": state.pop("value")}
    second.restore(state)
    second.learn(nothing)
    for a, b in zip(whole.network().weights, second.network().weights, strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_network_is_the_actor(config):
    learner = ApgLearner(config)
    observation = np.random.default_rng(0).normal(size=(50, learner.batch.layout.size)).astype(np.float32)
    with torch.no_grad():
        expected = learner.actor(torch.from_numpy(observation)).numpy()
    np.testing.assert_allclose(learner.network()(observation), expected, atol=1e-6)


def test_it_begins_as_a_spring_and_damper(config):
    """At rest and at neutral next to nothing is asked for; off neutral, the way back."""
    learner = ApgLearner(config)
    layout = learner.batch.layout
    still, moved = np.zeros((2, layout.size), dtype=np.float32)
    moved[layout.first("carriage")] = 0.5
    network = learner.network()
    assert np.abs(network(still)).max() < 1e-3
    assert network(moved)[0] * learner.batch.scale[0] == pytest.approx(-(0.3**2) * 5.0, abs=0.05)


def test_it_goes_on_from_an_agent(config, tmp_path):
    learner = ApgLearner(config)
    record = Record(
        algo="apg", seed=0, command="", steps=0, wall_time=0.0, hardware="", versions={}, created=""
    )
    path = tmp_path / "first.safetensors"
    Agent("first", config.task, learner.network(), record).save(path)
    second = ApgLearner(replace(config, seed=5, initial=str(path)))
    seen = np.random.default_rng(1).normal(size=(20, learner.batch.layout.size)).astype(np.float32)
    np.testing.assert_allclose(second.network()(seen), learner.network()(seen), atol=1e-5)
    other = replace(config.task, action=replace(config.task.action, repeat=4))
    with pytest.raises(ConfigurationError, match=r"its task\.action"):
        ApgLearner(replace(config, task=other, initial=str(path)))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"normalize": {"observation": True, "reward": False}}, "normalize"),
        ({"hyperparameters": {"learning_rat": 1e-3}}, "learning_rat"),
        ({"hyperparameters": {"activation_fn": "sine"}}, "activation_fn"),
    ],
)
def test_what_it_cannot_do_is_told(config, change, told):
    with pytest.raises(ConfigurationError, match=told):
        ApgLearner(replace(config, **change))


def test_hyperparameters_of_earlier_versions_are_read():
    assert from_dict(ApgHyperparameters, {"standardise": True}).standardize is True


def test_windows_go_on_where_they_ended(config):
    """Two windows of half an episode drive as one of the whole, with a policy that stays."""
    learner = ApgLearner(replace(config, hyperparameters={**config.hyperparameters, **WINDOWS}))
    learner._left[:] = 0
    learner._rounds = 1
    costs = []
    for _ in range(2):
        learner._next_window()
        Rollout(learner._unroll, learner.actor)
        costs.append(learner._unroll.costs)
    assert (learner._left == 0).all()
    whole = ApgLearner(config)
    whole.actor.load_state_dict(learner.actor.state_dict())
    whole._next_window()
    Rollout(whole._unroll, whole.actor)
    np.testing.assert_allclose(np.concatenate(costs), whole._unroll.costs, rtol=1e-12)


def test_a_window_that_does_not_go_into_an_episode_is_refused(config):
    with pytest.raises(ConfigurationError, match=r"window 0\.3 must be a whole part"):
        ApgLearner(replace(config, hyperparameters={"window": 0.3}))
