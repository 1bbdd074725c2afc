"""Linear washouts as the beginning of agents, and the search for the best one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.train.algorithms.apg.apg import ApgLearner
from motion_cueing.train.algorithms.linear.linear import (
    LinearLearner,
    LinearWashout,
    coordinates,
    gains,
    washout_at,
)
from motion_cueing.train.config import TrainingConfig, load_config
from motion_cueing.train.registry import StopTraining

SMALL = {
    "n_envs": 2,
    "steps": 2 * 6 * 40 * 8,
    "task": {
        "observation": {"memory": [0.5, 2.0], "frame": "cab"},
        "action": {"frame": "cab", "repeat": 5, "authority": 0.5},
        "episode": {
            "random": {"urban": 0.0, "rural": 0.0, "highway": 0.0, "track": 1.0},
            "library": 2,
            "drive_duration": 10.0,
            "duration": 2.0,
            "random_start": True,
        },
    },
    "hyperparameters": {"net_arch": [8], "population": 6},
}


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> TrainingConfig:
    path = tmp_path_factory.mktemp("config") / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    return load_config("linear", path)


def nothing() -> None:
    """A boundary where nothing is due."""


@given(st.lists(st.floats(-2.0, 2.0), min_size=16, max_size=16))
def test_coordinates_and_gains_are_each_others_inverse(values):
    point = np.array(values)
    np.testing.assert_allclose(coordinates(washout_at(point), 2), point, atol=1e-12)


def test_shares_that_are_not_given_are_zero():
    point = coordinates(LinearWashout(tilt_shares=(0.5,)), 3)
    assert washout_at(point).tilt_shares == (0.5, 0.0, 0.0)
    assert washout_at(point).carriage_shares == (0.0, 0.0, 0.0)


@settings(max_examples=25)
@given(st.integers(0, 2**31))
def test_the_gains_are_the_equations(config, seed):
    """Against the module's equations, entry by entry, in SI units."""
    rng = np.random.default_rng(seed)
    w = washout_at(rng.uniform(-1.0, 1.0, size=16))
    layout = layout_of(config.task.observation, "acceleration", 9)
    scale = rng.uniform(1.0, 20.0, size=9)
    seen = rng.normal(size=layout.frame)
    rows = {row.name: seen[layout.first(row.name) :][: row.size] * row.scale for row in layout.rows}
    told = gains(w, layout, scale) @ seen * scale
    last, error, memory = (
        rows["last_action"] * scale,
        rows["force_error"],
        rows["memory"].reshape(2, 6) * 10.0,
    )
    lead = w.leak + w.force_gain
    for k in range(2):
        spring = -2.0 * w.carriage_damping * w.carriage_frequency * rows["carriage_rate"][k]
        spring -= w.carriage_frequency**2 * rows["carriage"][k]
        kept = (1.0 - w.leak) * last[k] + w.force_gain * error[k]
        assert told[k] == pytest.approx(kept + lead * (np.dot(w.carriage_shares, memory[:, k]) + spring))
    for k, (frequency, gain) in enumerate(
        [(w.hexapod_frequency, w.hexapod_gain)] * 2 + [(w.heave_frequency, w.heave_gain)]
    ):
        spring = -2.0 * frequency * rows["velocity"][k] - frequency**2 * rows["displacement"][k]
        kept = (1.0 - w.leak) * last[2 + k] + gain * error[k]
        assert told[2 + k] == pytest.approx(kept + (w.leak + gain) * spring)
    for axis, force, sign in ((0, 1, -1.0), (1, 0, 1.0)):
        lasts = w.tilt_share * rows["reference_force"][force] + np.dot(w.tilt_shares, memory[:, force])
        angle = sign * lasts / 9.81 - rows["beta"][axis]
        assert told[5 + axis] == pytest.approx(w.rate_gain * rows["rate_error"][axis] + w.stiffness * angle)
    assert told[8] == pytest.approx(w.yaw_gain * rows["rate_error"][2])


def test_an_axis_that_does_not_move_gets_nothing(config):
    layout = layout_of(config.task.observation, "acceleration", 9)
    scale = np.array([0.0, 0.0, *np.ones(7)])
    matrix = gains(LinearWashout(), layout, scale)
    assert not matrix[:2].any()
    assert np.isfinite(matrix).all()


def test_a_search_finds_better_gains_than_it_began_with(config):
    learner = LinearLearner(config)
    began = coordinates(learner.given.start, 2)
    before = learner._evaluate([began] * 6)[0]
    learner.learn(nothing)
    assert learner._evaluate([learner._best] * 6)[0] == pytest.approx(learner._least)
    assert learner._least < before - 0.02
    assert learner.steps == config.steps


def test_the_agent_does_what_the_gains_say(config):
    learner = LinearLearner(config)
    learner.learn(nothing)
    seen = np.random.default_rng(0).normal(size=(20, learner.batch.layout.size)).astype(np.float32)
    matrix = gains(learner.washout, learner.batch.layout, learner.batch.scale)
    np.testing.assert_allclose(learner.network()(seen), np.tanh(seen @ matrix.T), atol=1e-5)


def test_one_that_is_resumed_ends_with_the_same_bits(config):
    whole = LinearLearner(config)
    whole.learn(nothing)
    first = LinearLearner(config)

    def stop() -> None:
        if first.steps >= config.steps // 2:
            raise StopTraining

    with pytest.raises(StopTraining):
        first.learn(stop)
    second = LinearLearner(config)
    second.restore(first.state())
    second.learn(nothing)
    np.testing.assert_array_equal(second._best, whole._best)


def test_the_gradient_goes_on_from_it(config):
    """Silent hidden layers learn, too."""
    learner = LinearLearner(config)
    given = {"net_arch": [8]}
    other = ApgLearner(replace(config, algo="apg", hyperparameters=given, steps=2 * 40 * 3))
    other.actor.load(learner.network())
    before = other.network().weights[0].copy()
    other.learn(nothing)
    assert np.abs(other.network().weights[0] - before).max() > 0.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"task": {"action": {"frame": "machine"}}}, "must be cab"),
        ({"task": {"episode": {"duration": None, "random_start": False}}}, r"task\.episode\.duration"),
        ({"hyperparameters": {"start": {"leak": -1.0}}}, "leak"),
        ({"hyperparameters": {"start": {"tilt_shares": [1.0] * 9}}}, "tilt_shares has 9 entries"),
    ],
)
def test_what_it_cannot_do_is_refused(tmp_path, fields, message):
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(fields), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=message):
        LinearLearner(load_config("linear", path))
