"""The way back through policy and machine, against graphs of tensors and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.options import TaskOptions
from motion_cueing.envs.task.unroll import TaskUnroll
from motion_cueing.train.algorithms.apg.backpropagation import Rollout, clip_outliers
from motion_cueing.train.algorithms.apg.value import ValueBootstrap, ValueOptions
from motion_cueing.train.networks import (
    Actor,
    normalize_by_rollout,
    start_as_spring_damper,
)

N, ACTIONS = 3, 12


def actor(activation: str = "elu", hidden: tuple[int, ...] = (5, 4)) -> Actor:
    """A network with a standard of its own."""
    torch.manual_seed(1)
    made = Actor(7, 3, hidden, activation)
    made.set_normalization(torch.randn(7), torch.rand(7) + 0.5, torch.rand(3) + 0.2)
    return made


@pytest.fixture(scope="module")
def batch() -> Batch:
    """On random drives."""
    options = TaskOptions(
        observation={"memory": [1.0], "frame": "cab"},
        action={"frame": "cab", "repeat": 2},
        episode={"library": 3, "drive_duration": 8.0, "duration": 2.0, "random_start": True},
    )
    made = Batch(N, options)
    made.seed(np.ones(N, dtype=bool), [4, 5, 6])
    return made


def begun(batch: Batch) -> Actor:
    """An actor that does a little of everything."""
    torch.manual_seed(3)
    network = Actor(batch.layout.size, batch.action_size, (8,))
    start_as_spring_damper(network, batch)
    normalize_by_rollout(network, batch, 20)
    with torch.no_grad():
        network.head.weight += 0.05 * torch.randn_like(network.head.weight)
    return network


def test_observations_are_seen_relative_to_their_own_mean_and_deviation(batch):
    torch.manual_seed(3)
    network = Actor(batch.layout.size, batch.action_size, (8,))
    start_as_spring_damper(network, batch)
    batch.seed(np.ones(N, dtype=bool), [4, 5, 6])
    normalize_by_rollout(network, batch, 20)
    batch.seed(np.ones(N, dtype=bool), [4, 5, 6])
    batch.begin(np.ones(N, dtype=bool))
    batch.observe(np.ones(N, dtype=bool))
    seen = []
    for _ in range(20):
        seen.append(batch.arrays.observation.pull().copy())
        batch.write(network(torch.from_numpy(seen[-1])).detach().numpy())
        batch.step()
    standard = (np.concatenate(seen) - network.mean.numpy()) / network.deviation.numpy()
    np.testing.assert_allclose(standard.mean(axis=0), 0.0, atol=1e-3)
    moved = network.deviation.numpy() > 0.021
    np.testing.assert_allclose(standard.std(axis=0)[moved], 1.0, atol=1e-3)


@pytest.mark.parametrize("options", [None, ValueOptions(net_arch=(8,), horizon=0.2)])
def test_gradients_agree_with_finite_differences(batch, options):
    """Of the weighted whole of windows, with and without a value at their end, in the actor's weights."""
    network = begun(batch)
    unroll = TaskUnroll(batch, ACTIONS)
    ahead = ValueBootstrap(options, network, ACTIONS, batch.time_step)
    weights = np.array([1.0, 0.5, 2.0])
    batch.seed(np.ones(N, dtype=bool), [7, 8, 9])
    batch.begin(np.ones(N, dtype=bool))

    def whole() -> tuple[Rollout, float]:
        unroll.begin()
        drive = Rollout(unroll, network)
        return drive, float(ahead.cost(unroll.costs, drive.observations[-1]) @ weights)

    drive, _ = whole()
    gradients = drive.backward(ahead.weights(weights), ahead.gradient(drive.observations[-1], weights))
    torch.sum(network(drive.observations[:-1]) * gradients).backward()
    torch.manual_seed(5)
    direction = [torch.randn_like(p) for p in network.parameters()]
    found = sum(float((p.grad * d).sum()) for p, d in zip(network.parameters(), direction, strict=True))
    values = []
    for sign in (1.0, -2.0):
        with torch.no_grad():
            for p, d in zip(network.parameters(), direction, strict=True):
                p += sign * 1e-3 * d
        values.append(whole()[1])
    assert found != 0.0
    assert (values[0] - values[1]) / 2e-3 == pytest.approx(found, rel=2e-2)


def test_a_window_with_a_wild_gradient_does_not_drown_the_others():
    gradients = torch.ones(4, 3, 2)
    gradients[:, 1] *= 1e9
    gradients[:, 2] *= torch.nan
    found, left_out = clip_outliers(gradients, 2.0)
    norms = found.flatten(2).pow(2).sum(dim=(0, 2)).sqrt()
    assert norms[0] == pytest.approx(np.sqrt(8.0))
    assert norms[1] == pytest.approx(2.0 * np.sqrt(8.0))
    assert norms[2] == 0.0
    assert left_out == 1


def test_a_value_learns_what_a_steady_cost_comes_to():
    """A cost that is a function of what is seen, and stays: its discounted mean is the cost itself."""
    network = actor()
    ahead = ValueBootstrap(ValueOptions(net_arch=(16,), horizon=0.5, learning_rate=1e-2), network, 10, 0.05)
    torch.manual_seed(0)
    for _ in range(150):
        point = torch.randn(32, 7)
        ahead.learn(point.expand(11, 32, 7), np.tile(1.0 + point[:, 0].numpy() ** 2, (10, 1)))
    point = torch.randn(200, 7)
    expected = 1.0 + point[:, 0].numpy() ** 2
    found = ahead.cost(np.tile(expected, (10, 1)), point)
    assert np.corrcoef(found, expected)[0, 1] > 0.98
    assert np.abs(found - expected).mean() < 0.2


def test_targets_are_discounted_sums():
    """With lambda 1, against the sum written out; with lambda 0, a step and the next value."""
    network = actor()
    critic = ValueBootstrap(ValueOptions(net_arch=(8,)), network, 4, 0.1)._critic
    seen, costs = torch.randn(5, 2, 7), torch.rand(4, 2)
    values = critic(seen).detach()
    g = 0.9
    expected = sum((1 - g) * g**k * costs[k] for k in range(4)) + g**4 * values[4]
    np.testing.assert_allclose(critic.targets(seen, costs, g, 1.0)[0], expected, rtol=1e-5)
    np.testing.assert_allclose(
        critic.targets(seen, costs, g, 0.0), (1 - g) * costs + g * values[1:], rtol=1e-5
    )
