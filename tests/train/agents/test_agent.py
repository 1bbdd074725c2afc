"""The network against the formulas in float64, and what does not fit together."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines.washout import ClassicalWashout, ScheduledWashout
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.train.agents import Agent, Network

from . import RECORD, agent, network

EXACT = {
    "tanh": np.tanh,
    "relu": lambda x: np.where(x > 0.0, x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.exp(np.minimum(x, 0.0)) - 1.0),
    "silu": lambda x: x / (1.0 + np.exp(-x)),
}


def exact(net: Network, observation) -> np.ndarray:
    """The network by its definition, in float64."""
    x = np.asarray(observation, dtype=np.float64)
    if net.mean is not None:
        x = np.clip((x - net.mean) / np.sqrt(net.variance + 1e-8), -net.clip, net.clip)
    hidden = x
    for weight, bias in zip(net.weights[:-1], net.biases[:-1], strict=True):
        hidden = EXACT[net.activation](hidden @ weight.T.astype(np.float64) + bias)
    if net.skip:
        hidden = np.hstack([hidden, x])
    out = hidden @ net.weights[-1].T.astype(np.float64) + net.biases[-1]
    return np.tanh(out) if net.squash == "tanh" else np.clip(out, -1.0, 1.0)


@pytest.mark.parametrize("activation", list(EXACT))
@pytest.mark.parametrize(
    ("squash", "skip", "normalized"), [("clip", True, True), ("tanh", False, True), ("clip", False, False)]
)
def test_it_computes_its_definition(activation, squash, skip, normalized):
    net = network((20, 32, 24, 5), activation=activation, squash=squash, skip=skip, normalized=normalized)
    observation = np.random.default_rng(1).normal(scale=3.0, size=(200, 20)).astype(np.float32)
    found, expected = net(observation), exact(net, observation)
    assert found.dtype == np.float32
    assert found.shape == (200, 5)
    assert np.abs(found - expected).max() < 3e-6
    assert np.std(found) > 0.0


def test_one_row_a_vector_and_a_batch_agree():
    net = network((20, 32, 24, 5), skip=True)
    batch = np.random.default_rng(2).normal(size=(7, 20)).astype(np.float32)
    for k in range(7):
        row, vector = net(batch[k : k + 1]), net(batch[k])
        assert row.shape == (1, 5)
        assert vector.shape == (5,)
        assert np.array_equal(row[0], vector)
        assert np.allclose(net(batch)[k], vector, atol=1e-6)


def test_normalization_is_clipped_and_exact_where_an_entry_hardly_varies():
    weights, biases = (np.eye(2) / 20.0,), (np.zeros(2),)
    mean = np.array([0.981 + 1e-9, 0.0])
    net = Network(weights, biases, mean=mean, variance=np.array([1e-10, 1.0]), clip=5.0)
    observation = np.array([[0.981, 100.0], [0.9811, -100.0]], dtype=np.float32)
    assert np.allclose(net(observation), exact(net, observation), atol=1e-6)
    assert np.allclose(net(observation)[:, 1], [0.25, -0.25])
    assert abs(net(observation)[0, 0]) < 0.01


def test_activations_bear_large_numbers():
    for activation in EXACT:
        net = Network((np.eye(1), np.eye(1)), (np.zeros(1), np.zeros(1)), activation=activation)
        with np.errstate(all="raise"):
            assert np.isfinite(net(np.array([[1e4], [-1e4]]))).all()


def test_its_arrays_are_its_own():
    weight = np.ones((1, 2), dtype=np.float32)
    net = Network((weight,), (np.zeros(1),))
    weight[...] = 7.0
    assert net.weights[0].tolist() == [[1.0, 1.0]]
    with pytest.raises(ValueError, match="read-only"):
        net.weights[0][0, 0] = 2.0


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"weights": ()}, "0 weights and 2 biases"),
        ({"weights": (np.ones((3, 4)), np.ones((2, 5)))}, "weights 1 take 5 inputs, expected 3"),
        ({"weights": (np.ones((3, 4)), np.ones(3))}, "weights 1 has shape"),
        ({"weights": (np.ones((3, 4)), np.full((2, 3), np.nan))}, "weights 1 is not finite"),
        ({"weights": ("a", np.ones((2, 3)))}, "weights 0 is not an array of numbers"),
        ({"biases": (np.ones(3), np.ones(3))}, r"biases 1 have shape \(3,\), expected \(2,\)"),
        ({"skip": True}, "weights 1 take 3 inputs, expected 7"),
        ({"activation": "gelu"}, "activation must be one of tanh, relu, elu, silu, found 'gelu'"),
        ({"squash": "none"}, "squash must be one of clip, tanh"),
        ({"mean": np.zeros(4)}, "mean and variance together"),
        ({"mean": np.zeros(3), "variance": np.ones(3)}, r"mean has shape \(3,\), expected \(4,\)"),
        ({"mean": np.zeros(4), "variance": -np.ones(4)}, "variance must not be negative"),
        ({"clip": 0.0}, "clip must be positive"),
    ],
)
def test_a_network_that_does_not_fit_together_is_refused(change, told):
    whole = {"weights": (np.ones((3, 4)), np.ones((2, 3))), "biases": (np.ones(3), np.ones(2))}
    Network(**whole)
    with pytest.raises(DataError, match=told):
        Network(**{**whole, **change})


def test_an_agent_needs_a_network_of_its_tasks_size():
    good = agent()
    with pytest.raises(DataError, match=r"random: its network has \d+ entries of observation, its task \d+"):
        replace(good, task=TaskOptions(observation=ObservationOptions(preview=4)))
    with pytest.raises(DataError, match="8 entries of action, its task 9"):
        replace(good, network=network((good.layout.size, 8)))
    with pytest.raises(ConfigurationError, match="name must not be empty"):
        replace(good, name="")


def test_a_base_is_there_where_the_mode_needs_one():
    residual = TaskOptions(action=ActionOptions(mode="residual"))
    gains = TaskOptions(action=ActionOptions(mode="gains"))
    assert agent().base_policy is None
    assert type(agent(residual, "est1").base_policy) is ClassicalWashout
    assert agent(residual, "est1").base_policy.parameters.name == "est1"
    scheduled = agent(gains, "classical").base_policy
    assert isinstance(scheduled, ScheduledWashout)
    assert agent(gains, "classical").action_size == len(scheduled.gain_names)
    with pytest.raises(ConfigurationError, match="'residual' needs a base"):
        agent(residual)
    with pytest.raises(ConfigurationError, match="'acceleration' has no use for a base"):
        agent(TaskOptions(), "classical")


def test_predict_checks_what_it_sees():
    one = agent()
    size = one.layout.size
    action, state = one.predict(np.zeros((4, size)), state="kept")
    assert action.shape == (4, 9)
    assert state == "kept"
    assert np.allclose(one.predict(np.zeros(size))[0], action[0], atol=1e-6)
    with pytest.raises(DataError, match=rf"shape \(1, 52\), expected \(n, {size}\)"):
        one.predict(np.zeros((1, 52)))
    with pytest.raises(DataError, match="not finite"):
        one.predict(np.full((1, size), np.nan))


def test_on_another_machine():
    assert agent().platform.name == "paper"
    assert agent().on("24-inch").platform.name == "24-inch"
    with pytest.raises(ConfigurationError, match="platform"):
        agent().on("no such machine")


def test_it_is_copied_and_pickled():
    one = agent(TaskOptions(action=ActionOptions(mode="residual")), "classical")
    seen = np.ones((1, one.layout.size))
    assert one.base_policy is not None
    for other in (copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
        assert isinstance(other, Agent)
        assert np.array_equal(other.predict(seen)[0], one.predict(seen)[0])
        assert other.record == RECORD
