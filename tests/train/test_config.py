"""Configurations of a training: presets, merging, and what they refuse."""

from __future__ import annotations

import inspect
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from motion_cueing.baselines.washout import load_washout
from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.envs.maneuvers import drive_seeds, maneuver_names, recording_names
from motion_cueing.envs.maneuvers.sampling import load_drives
from motion_cueing.envs.settings import load, save
from motion_cueing.envs.task import ActionOptions, TaskOptions
from motion_cueing.envs.task.episode import library_of
from motion_cueing.envs.task.options import load_task
from motion_cueing.train.config import (
    Choice,
    TrainingConfig,
    load_config,
    merge,
    recipe_names,
    validation_task,
)
from motion_cueing.train.registry import algorithm_names, preset_of

from . import tiny


@pytest.mark.parametrize("name", algorithm_names())
def test_no_preset_trains_or_validates_on_what_is_evaluated(name):
    config = load_config(name)
    evaluated = {*maneuver_names(), *recording_names()}
    assert config.task.episode.drives == ()
    text = preset_of(name).read_text(encoding="utf-8")
    assert not {word for word in evaluated if word in text}
    small = {"library": 2, "drive_duration": 1.0}
    episode = load_config(name, task={**yaml.safe_load(text).get("task", {}), "episode": small}).task.episode
    trained = {drive.name for drive in library_of(episode, config.task.randomization)}
    assert len(trained) == 2
    assert not trained & evaluated


@pytest.mark.parametrize("name", recipe_names())
def test_no_shipped_agent_was_trained_or_validated_on_what_is_evaluated(name):
    config = load_config(None, Path(name))
    assert config.task.episode.drives == ()
    assert not set(config.task.episode.random.cars) & set(load_drives("held-out").cars)
    assert config.validation.seed != config.task.episode.library_seed


@pytest.mark.parametrize("drive", [*maneuver_names(), *recording_names()])
def test_a_drive_for_evaluation_is_refused(drive, tmp_path):
    with pytest.raises(ConfigurationError, match=f"task.episode.drives names {drive}: .*never trained on"):
        tiny.config(tmp_path, "ppo", task={"episode": {"drives": [drive]}})


def test_validation_drives_that_are_trained_on_are_refused(tmp_path):
    with pytest.raises(ConfigurationError, match=r"validation\.seed 4 gives drives that are trained on"):
        tiny.config(tmp_path, "ppo", task={"episode": {"library_seed": 4}}, validation={"seed": 4})


def test_validation_is_whole_random_drives_without_randomization(tmp_path):
    randomized = {"force_noise": 0.1, "actuator_gain": 0.1}
    config = tiny.config(tmp_path, "ppo", task={"randomization": randomized})
    task = validation_task(config)
    assert task.randomization.force_noise == task.randomization.actuator_gain == 0.0
    assert task.episode.duration is None
    assert task.episode.drives == ()
    assert task.observation == config.task.observation
    assert not set(drive_seeds(2, task.episode.library_seed)) & set(drive_seeds(2, 0))


@pytest.mark.parametrize("name", algorithm_names())
def test_a_preset_round_trips_through_yaml_and_is_its_own_configuration(name, tmp_path):
    config = load_config(name)
    save(config, tmp_path / "config.yaml")
    assert load(TrainingConfig, tmp_path / "config.yaml") == config
    assert load_config(None, tmp_path / "config.yaml") == config


@pytest.mark.parametrize("name", ["ppo", "trpo", "recurrent-ppo", "sac", "td3", "tqc", "crossq"])
def test_algorithms_of_stable_baselines_learn_the_task_for_it(name):
    config, known = load_config(name), load_task("cueing-preview")
    # In groups rewards are relative to each other's; else they are against the base.
    assert config.task.observation == replace(known.observation, against_base=config.group == 1)
    assert replace(config.task.episode, library=known.episode.library) == known.episode
    assert replace(config.task.action, bound=1.0) == known.action
    assert config.n_envs % config.group == 0
    assert (config.group > 1) == (name in ("ppo", "trpo"))
    assert not config.normalize.observation
    assert config.threads == 1


def test_a_task_is_changed_field_by_field_or_begun_anew(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("task: {action: {repeat: 10}}\n")
    known = load_config("ppo").task
    assert load_config("ppo", file).task == replace(known, action=replace(known.action, repeat=10))
    file.write_text("task: {preset: cueing}\n")
    assert load_config("ppo", file).task == load_task("cueing")
    file.write_text("task: {preset: null, action: {repeat: 10}}\n")
    assert load_config("ppo", file).task == TaskOptions(action=ActionOptions(repeat=10))
    file.write_text("hyperparameters: {policy: MlpPolicy, n_steps: 8}\n")
    assert load_config("ppo", file).hyperparameters == {"policy": "MlpPolicy", "n_steps": 8}
    file.write_text("hyperparameters: {n_steps: 8}\n")
    assert load_config("ppo", file).hyperparameters == {**load_config("ppo").hyperparameters, "n_steps": 8}
    file.write_text("n_envs: 6\ngroup: 4\n")
    with pytest.raises(ConfigurationError, match="n_envs 6 must be a multiple of group 4"):
        load_config("ppo", file)


def test_arguments_go_before_the_file_and_the_file_before_the_preset(tmp_path):
    path = tiny.config_file(tmp_path, "sac", steps=111, seed=7)
    config = load_config("sac", path, steps=222, seed=None)
    assert (config.steps, config.seed) == (222, 7)
    assert config.hyperparameters["batch_size"] == 16
    assert config.hyperparameters["buffer_size"] == 240
    assert config.validation.best == load_config("sac").validation.best
    assert set(config.search) == {"hyperparameters.gamma"}


def test_mappings_are_merged_and_all_else_is_replaced():
    below = {"a": {"b": 1, "c": [1, 2]}, "d": 3}
    assert merge(below, {"a": {"c": [3]}, "e": {}}) == {"a": {"b": 1, "c": [3]}, "d": 3, "e": {}}
    assert below["a"]["c"] == [1, 2]


def test_a_washout_file_under_the_agent_is_kept_in_the_configuration(tmp_path):
    washout = tmp_path / "mine.yaml"
    save(load_washout("est1"), washout)
    config = tiny.config(tmp_path, "ppo", base=str(washout), task={"action": {"mode": "residual"}})
    assert config.base == load_washout("est1")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"n_env": 3}, "unknown field 'n_env'. Did you mean n_envs"),
        ({"steps": 0}, "'steps'"),
        ({"seed": -1}, "'seed'"),
        ({"normalize": {"obs": True}}, "unknown field 'normalize.obs'"),
        ({"task": {"action": {"repeat": 0}}}, "'task.action.repeat'"),
        ({"validation": {"best": "speed"}}, "'validation.best'"),
        ({"algo": "sac"}, "it is for algo sac, but --algorithm is ppo"),
        ({"search": {"steps": {"low": 3}}}, "give either choices, or low and high"),
    ],
)
def test_a_wrong_field_is_named(fields, message, tmp_path):
    with pytest.raises(ConfigurationError) as caught:
        tiny.config(tmp_path, "ppo", **fields)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "give either"),
        ({"choices": (1,), "low": 0.0, "high": 1.0}, "give either"),
        ({"low": 2.0, "high": 1.0}, "low must be below high"),
        ({"low": 0.0, "high": 1.0, "log": True}, "log needs a low above 0"),
    ],
)
def test_a_choice_that_is_none_is_refused(fields, message):
    with pytest.raises(ConfigurationError, match=message):
        Choice(**fields)


@pytest.mark.parametrize("text", ["a: [1", "- 1\n- 2", "\x00"])
def test_a_file_that_is_no_configuration_is_refused(text, tmp_path):
    (tmp_path / "broken.yaml").write_text(text)
    with pytest.raises((DataError, ConfigurationError), match=r"broken\.yaml"):
        load_config("ppo", tmp_path / "broken.yaml")


def test_an_unknown_algorithm_is_told_with_the_near_ones():
    with pytest.raises(UnknownNameError, match=r"unknown algorithm 'pp'\. Did you mean ppo"):
        load_config("pp")
    with pytest.raises(ConfigurationError, match="--algorithm is missing; use one of ppo"):
        load_config(None)


def test_every_field_is_in_the_docstring():
    documented = inspect.getdoc(TrainingConfig)
    assert [n for n in TrainingConfig.__dataclass_fields__ if f"{n}: " not in documented] == []
