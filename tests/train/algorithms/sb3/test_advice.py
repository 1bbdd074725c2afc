"""Warnings before a training whose configuration will hardly learn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.task.episode import platform_of
from motion_cueing.envs.task.options import load_task
from motion_cueing.train.algorithms.sb3.advice import travel_time
from motion_cueing.train.config import load_config
from motion_cueing.train.registry import ALGORITHMS


def advice(algo: str, task: dict | None = None, **fields) -> list[str]:
    config = load_config(algo, task=load_task("cueing", **(task or {})), **fields)
    return ALGORITHMS[algo].advice(config)


LONG = {"policy": "MlpPolicy", "gamma": 0.999, "gae_lambda": 0.99, "n_steps": 8, "batch_size": 8}


def test_a_sound_configuration_is_not_commented():
    assert advice("ppo", hyperparameters=LONG) == []
    assert advice("sac", hyperparameters={"gamma": 0.995}) == []
    # A critic that knows how machines differ bridges a short trace.
    critic = {**LONG, "policy": "GroupCriticPolicy", "gae_lambda": 0.5}
    assert advice("ppo", n_envs=8, group=8, hyperparameters=critic) == []
    assert ALGORITHMS["apg"].advice(load_config("apg")) == []


def test_a_gaussian_wider_than_the_bound_is_told_and_a_hopeless_one_refused():
    # Beyond one deviation lie 32 %, beyond half of one 62 %.
    wide = {**LONG, "policy_kwargs": {"log_std_init": math.log(2.0)}}
    (sentence,) = advice("ppo", hyperparameters=wide)
    assert "log_std_init 0.693: 62 % of actions lie beyond task.action.bound 1 at first" in sentence
    hopeless = {**LONG, "policy_kwargs": {"log_std_init": 3.0}}
    with pytest.raises(ConfigurationError, match=r"96 % of actions lie beyond"):
        advice("ppo", hyperparameters=hopeless)
    # A bound of several deviations, and noise that depends on the state, whose width is not known.
    bound = {"action": {"bound": 10.0}}
    assert advice("ppo", task=bound, hyperparameters={**wide, "policy_kwargs": {"log_std_init": 1.0}}) == []
    assert advice("ppo", hyperparameters={**hopeless, "use_sde": True}) == []


def test_the_noise_that_is_annealed_counts_and_one_that_cannot_be_is_refused():
    (sentence,) = advice("ppo", hyperparameters={**LONG, "annealed_std": [2.0, 0.1]})
    assert "62 % of actions lie beyond" in sentence
    with pytest.raises(ConfigurationError, match="annealed_std"):
        advice("ppo", hyperparameters={**LONG, "annealed_std": 0.5})


@pytest.mark.parametrize(
    ("algo", "hyperparameters", "words"),
    [
        # 0.08 s an action: 1 / (1 - 0.97 * 0.95) = 12.7 of them, and 1 / (1 - 0.9) = 10.
        ("ppo", {"gamma": 0.97, "gae_lambda": 0.95}, "gamma and gae_lambda credit an action for 1.0 s"),
        ("ppo", {}, "gamma and gae_lambda credit an action for 1.3 s"),
        ("sac", {"gamma": 0.9}, "gamma credits an action for 0.8 s"),
    ],
)
def test_a_horizon_shorter_than_the_travels_time_is_told(algo, hyperparameters, words):
    config = load_config(algo, task=load_task("cueing"))
    values = {"policy_kwargs": {}, **hyperparameters}
    (sentence,) = ALGORITHMS[algo].advice(
        type(config)(algo=algo, task=config.task, hyperparameters=values, n_envs=8)
    )
    assert words in sentence


def simulated_travel_time(acceleration: float, speed: float, brake: float | None, end: float) -> float:
    """By steps of a millisecond: until the carriage is there, or would come to a stop there."""
    position = rate = time = 0.0
    while True:
        stop = 0.0 if brake is None else rate * rate / (2.0 * brake)
        if position + stop >= end:
            return time
        rate = min(rate + 1e-3 * acceleration, speed)
        position += 1e-3 * rate
        time += 1e-3


@pytest.mark.parametrize("largest", [0.1, 0.4, 5.0])
@pytest.mark.parametrize("braking", [None, 0.3])
@pytest.mark.parametrize("charged", [0.0, 15.0])
def test_the_travels_time_is_that_of_a_simulation(largest, braking, charged):
    weights = {"stroke": charged}
    reward = {"stroke_braking": braking, "stroke_margin": 0.5, "weights": weights}
    task = load_task("cueing", reward=reward, action={"largest": [largest] * 9})
    carriage = platform_of(task).carriage
    assert carriage is not None
    end = min(abs(x) for x in (*carriage.travel_x, *carriage.travel_y))
    brake = None if braking is None or not charged else braking * carriage.acceleration
    expected = simulated_travel_time(largest, carriage.velocity, brake, 0.5 * end if charged else end)
    assert travel_time(task) == pytest.approx(expected, abs=0.02)


def test_without_a_carriage_under_the_action_there_is_no_such_time():
    assert travel_time(load_task("cueing", action={"axes": ["roll", "pitch"]})) is None
    assert travel_time(load_task("cueing", action={"frozen": ["carriage_x", "carriage_y"]})) is None
    velocity = load_task("cueing", action={"mode": "velocity", "base": None}, reward={"against_base": False})
    assert np.isfinite(travel_time(velocity))


def test_full_accelerations_without_a_controller_are_told():
    task = {"action": {"mode": "acceleration", "base": None, "largest": None, "authority": 1.0}}
    reward = {"reward": {"against_base": False, "stroke_margin": 0.0}}
    found = advice("ppo", task={**task, **reward}, hyperparameters=LONG)
    assert len(found) == 1
    assert "full accelerations and no controller below" in found[0]
    gentle = {"action": {**task["action"], "authority": 0.03}}
    assert advice("ppo", task={**gentle, **reward}, hyperparameters=LONG) == []
