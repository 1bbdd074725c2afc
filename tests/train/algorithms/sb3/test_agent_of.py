"""Models become agents, in memory and from files."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.envs import IdentityEnv

from motion_cueing.envs import ENVIRONMENT_ID
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.task.options import load_task
from motion_cueing.train.agents import Agent
from motion_cueing.train.algorithms.sb3.policy import CLASSES, agent_of
from motion_cueing.train.algorithms.sb3.saved import algorithm_in, load_model, load_statistics

from .models import ID, NAME, Spaces, actions, learned, seen


@pytest.mark.parametrize("algo", CLASSES)
def test_a_saved_model_acts_as_an_agent(algo, tmp_path):
    model = learned(algo)
    model.save(tmp_path / "model.zip")
    model.get_vec_normalize_env().save(tmp_path / "statistics.pkl")
    assert algorithm_in(tmp_path / "model.zip") == algo
    loaded, statistics = load_model(tmp_path / "model.zip"), load_statistics(tmp_path / "statistics.pkl")
    agent = agent_of(loaded, ID, "mine", statistics)
    assert agent.task == load_task(NAME)
    assert (agent.record.algo, agent.record.seed, agent.record.steps) == (algo, 3, model.num_timesteps)
    agent.save(tmp_path / "mine.safetensors")
    observations = seen(model)
    found, _ = Agent.load(tmp_path / "mine.safetensors").predict(observations)
    np.testing.assert_allclose(found, actions(model, observations), rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("task", [ID, f"motion_cueing.envs:{ID}", NAME, load_task(NAME)])
def test_an_environment_has_an_id_a_name_and_options(task):
    assert agent_of(learned("ppo"), task, "mine").task == load_task(NAME)


def test_an_environment_has_a_file_and_the_raw_one_all_defaults(tmp_path):
    path = tmp_path / "task.yaml"
    path.write_text(f"preset: {NAME}\nepisode: {{duration: 7.0}}\n")
    assert agent_of(learned("ppo"), path, "mine").task.episode.duration == 7.0
    with pytest.raises(DataError, match="its network has 177 entries of observation, its task"):
        agent_of(learned("ppo"), ENVIRONMENT_ID, "mine")


@pytest.mark.parametrize("normalized", [False, True])
def test_a_model_in_memory_brings_its_normalization(normalized):
    model = learned("ppo", normalized)
    agent = agent_of(model, NAME, "mine")
    assert (agent.network.mean is not None) == normalized
    observations = seen(model)
    np.testing.assert_allclose(agent.predict(observations)[0], actions(model, observations), atol=1e-5)


def test_another_epsilon_is_that_of_the_wrapper():
    model = learned("ppo")
    model.get_vec_normalize_env().epsilon = 0.5
    observations = seen(model)
    np.testing.assert_allclose(
        agent_of(model, NAME, "mine").predict(observations)[0], actions(model, observations), atol=1e-5
    )


def test_a_normalization_that_is_missing_is_asked_for(tmp_path):
    learned("ppo").save(tmp_path / "model.zip")
    with pytest.raises(DataError, match="trained in VecNormalize; give its statistics too"):
        agent_of(load_model(tmp_path / "model.zip"), ID, "mine")


@pytest.mark.parametrize(
    ("task", "base", "error", "message"),
    [
        ("cueing", None, DataError, "entries of observation, its task .*; give it the observation options"),
        ("cueing-previw", None, ConfigurationError, "Did you mean cueing-preview"),
        (load_task(NAME, action={"bound": 2.0}), None, DataError, "actions end at 1, its task's at 2"),
        (load_task(NAME, action={"axes": ["roll"]}), None, DataError, "entries of .*, its task"),
        (NAME, "optimum", ConfigurationError, "base optimum: an agent's file cannot hold it"),
    ],
)
def test_an_environment_that_does_not_fit_is_refused(task, base, error, message):
    with pytest.raises(error, match=message):
        agent_of(learned("ppo"), task, "mine", base=base)


@pytest.mark.parametrize("action", [spaces.Discrete(3), spaces.Box(np.float32([-1, 0]), np.float32([1, 1]))])
def test_actions_without_one_bound_are_refused(action):
    env = Spaces(load_task(NAME))
    env.action_space = action
    with pytest.raises(DataError, match=r"the model's actions are .*; those of an agent are a vector"):
        agent_of(PPO("MlpPolicy", env), NAME, "mine")


def test_files_that_hold_something_else_are_refused(tmp_path):
    path = tmp_path / "model.zip"
    for read in (load_model, load_statistics):
        with pytest.raises(DataError, match="there is no such file"):
            read(path)
    path.write_bytes(b"PK\x03\x04")
    with pytest.raises(DataError, match="no model of Stable-Baselines3, or broken"):
        load_model(path)
    with pytest.raises(DataError, match="no statistics of VecNormalize"):
        load_statistics(path)
    A2C("MlpPolicy", IdentityEnv(), n_steps=8).save(path)
    with pytest.raises(DataError, match="a model of none of ppo, trpo"):
        load_model(path)
    with pytest.raises(UnknownNameError, match="unknown algorithm 'pppo'"):
        load_model(path, "pppo")
    learned("ppo").policy.save(path)
    with pytest.raises(DataError, match="no model of Stable-Baselines3, or broken"):
        load_model(path)
    learned("sac", steps=0).save(path)
    with pytest.raises(DataError, match="cannot be loaded as a model of ppo"):
        load_model(path, "ppo")
