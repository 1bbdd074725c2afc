"""Hyperparameters become arguments, or are refused in a sentence."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.noise import NormalActionNoise, OrnsteinUhlenbeckActionNoise
from stable_baselines3.common.type_aliases import TrainFreq
from torch import nn

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.train.algorithms.sb3.policy import CLASSES
from motion_cueing.train.algorithms.sb3.sb3 import arguments
from motion_cueing.train.config import load_config


@pytest.mark.parametrize("name", CLASSES)
def test_presets_hold_arguments_of_their_class(name):
    found = arguments(CLASSES[name], load_config(name).hyperparameters, 9)
    assert found.keys() <= inspect.signature(CLASSES[name]).parameters.keys()


def test_a_schedule_falls_linearly_to_zero():
    rate = arguments(PPO, {"learning_rate": "lin_3e-4"}, 9)["learning_rate"]
    assert [rate(x) for x in (1.0, 0.5, 0.0)] == [3e-4, 1.5e-4, 0.0]


def test_lists_numbers_and_names_become_what_the_class_takes():
    given = {"train_freq": [4, "step"], "policy_kwargs": {"net_arch": [7], "activation_fn": "silu"}, "tau": 1}
    found = arguments(SAC, given, 9)
    assert TrainFreq(*found["train_freq"]).frequency == 4
    assert found["policy_kwargs"] == {"net_arch": [7], "activation_fn": nn.SiLU}
    assert found["tau"] == 1.0


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("normal", NormalActionNoise), ("ornstein-uhlenbeck", OrnsteinUhlenbeckActionNoise)],
)
def test_noise_has_the_deviation_on_every_axis(kind, expected):
    found = arguments(TD3, {"noise_type": kind, "noise_std": 0.25}, 6)
    noise = found["action_noise"]
    assert isinstance(noise, expected)
    assert np.array_equal(noise._sigma, np.full(6, 0.25))
    assert not {"noise_type", "noise_std"} & found.keys()


@pytest.mark.parametrize(
    ("algorithm", "given", "message"),
    [
        (PPO, {"batchsize": 3}, "unknown field 'batchsize'. Did you mean batch_size"),
        (PPO, {"tau": 0.1}, "unknown field 'tau'"),
        (PPO, {"noise_std": 0.1}, "unknown field 'noise_std'"),
        (PPO, {"device": "cpu"}, "unknown field 'device'"),
        (PPO, {"n_steps": "many"}, "hyperparameters.n_steps: Input should be a valid integer"),
        (PPO, {"n_steps": 2.5}, "hyperparameters.n_steps:"),
        (PPO, {"learning_rate": "lin_fast"}, "expected a number after lin_, found 'fast'"),
        (PPO, {"learning_rate": "fast"}, "hyperparameters.learning_rate:"),
        (PPO, {"policy_kwargs": [1]}, "policy_kwargs: expected fields with values"),
        (PPO, {"policy_kwargs": {"net_arc": [8]}}, "unknown field 'net_arc'. Did you mean net_arch"),
        (PPO, {"policy_kwargs": {"activation_fn": "gelu"}}, "use one of tanh, relu, elu, silu"),
        (TD3, {"noise_type": "pink"}, "noise_type: 'pink'; use one of normal"),
        (TD3, {"noise_std": -1.0}, "noise_std: expected a number from 0"),
        (TD3, {"noise_std": "much"}, "noise_std: expected a number from 0"),
    ],
)
def test_a_wrong_one_is_named(algorithm, given, message):
    with pytest.raises(ConfigurationError) as caught:
        arguments(algorithm, given, 9)
    assert message in str(caught.value)
