"""The unrolled batch against the batch itself, and its gradients against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.task import TaskOptions
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.kernels.reward import TERMS
from motion_cueing.envs.task.unroll import TaskUnroll

from .tasks import drive

N, ACTIONS = 3, 8
SEEN = {"memory": (0.5, 4.0), "preview": 2, "frame": "cab", "perceived": True, "true_motion": True}
WEIGHTS = {"perceived_error": 0.3, "false_cues": 0.1, "tilt_rate": 0.5, "stroke": 1.0, "action_rate": 0.5}


def batch(mode: str = "acceleration", felt: str = "machine", **options) -> Batch:
    """Three episodes under way, the machines somewhere in their travel."""
    task = TaskOptions(
        observation={**SEEN, "simulator_cue": felt},
        action={"mode": mode, "frame": "cab", "repeat": 3, "authority": 0.3},
        reward={"weights": WEIGHTS, "stroke_margin": 0.2},
        episode={"duration": 2.0, "random_start": True, "platform_offset": 0.3},
        **options,
    )
    made = Batch(N, task, drives=[drive(samples=601)])
    everywhere = np.ones(N, dtype=bool)
    made.seed(everywhere, list(range(N)))
    made.begin(everywhere)
    made.observe(everywhere)
    return made


class LinearPolicy:
    """tanh of a linear map of the observation, and its derivatives by hand."""

    def __init__(self, size: int) -> None:
        self.weights = 0.01 * np.random.default_rng(1).normal(size=(size, 9))

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        return np.tanh(observation.astype(np.float64) @ self.weights)

    def back(self, observation: np.ndarray, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradients with respect to the weights and the observation."""
        inner = gradient * (1.0 - self(observation) ** 2)
        return observation.T.astype(np.float64) @ inner, inner @ self.weights.T


def play(unroll: TaskUnroll, policy: LinearPolicy) -> np.ndarray:
    unroll.begin()
    for k in range(unroll.actions):
        unroll.act(k, policy(unroll.observe(k)).astype(np.float32))
    return unroll.costs.mean(axis=0)


def gradient(unroll: TaskUnroll, policy: LinearPolicy, weights: np.ndarray) -> np.ndarray:
    seen = [np.zeros(0)] * unroll.actions
    unroll.begin()
    for k in range(unroll.actions):
        seen[k] = unroll.observe(k).copy()
        unroll.act(k, policy(seen[k]).astype(np.float32))
    unroll.weigh(np.tile(weights / unroll.actions, (unroll.actions, 1)))
    total = np.zeros_like(policy.weights)
    for k in reversed(range(unroll.actions)):
        of_weights, of_observation = policy.back(seen[k], unroll.back_through_act(k).astype(np.float64))
        total += of_weights
        unroll.back_through_observe(k, of_observation.astype(np.float32))
    return total


@pytest.mark.parametrize("mode", ["acceleration", "jerk", "velocity"])
def test_it_plays_as_the_batch_does(mode):
    made = batch(mode)
    unroll = TaskUnroll(made, ACTIONS)
    policy = LinearPolicy(made.layout.size)
    costs = play(unroll, policy)
    rewards, terms = np.zeros(N), np.zeros(len(TERMS))
    for k in range(ACTIONS):
        observation = made.arrays.observation.pull().copy()
        np.testing.assert_array_equal(observation, unroll._seen[k].numpy())
        made.write(policy(observation))
        made.step()
        rewards += made.arrays.reward.pull()
        terms += made.arrays.terms.pull().mean(axis=0)
    np.testing.assert_allclose(costs, -rewards / ACTIONS, rtol=1e-12)
    of_state = [name not in ("action_rate", "failure") for name in TERMS]
    np.testing.assert_allclose(unroll.terms[of_state], (terms / ACTIONS)[of_state], rtol=1e-12, atol=1e-15)


def gradient_that_agrees(unroll: TaskUnroll, policy: LinearPolicy) -> np.ndarray:
    """The gradient in the policy's weights, checked along a direction against finite differences."""
    weights = np.array([1.0, 0.5, 2.0])
    found = gradient(unroll, policy, weights)
    direction = np.random.default_rng(2).normal(size=policy.weights.shape)
    # Small: a limit that is met a time step earlier or later makes the cost jump.
    step, middle = 1e-5, policy.weights
    values = []
    for sign in (1.0, -1.0):
        policy.weights = middle + sign * step * direction
        values.append(play(unroll, policy) @ weights)
    assert (values[0] - values[1]) / (2.0 * step) == pytest.approx(np.sum(found * direction), rel=5e-3)
    return found


@pytest.mark.parametrize("mode", ["acceleration", "jerk", "velocity"])
def test_gradients_through_policy_and_machine_agree_with_finite_differences(mode):
    unroll = TaskUnroll(batch(mode), ACTIONS)
    assert gradient_that_agrees(unroll, LinearPolicy(unroll.batch.layout.size)).any()


def test_gradients_where_actuators_lag_and_the_model_tells_what_is_felt():
    slow = {"natural_frequency": (30.0, 90.0), "dead_time": (0.0, 0.03)}
    unroll = TaskUnroll(batch(felt="model", randomization=slow), ACTIONS)
    assert gradient_that_agrees(unroll, LinearPolicy(unroll.batch.layout.size)).any()


def test_gradients_at_rest_are_finite():
    """A machine that stands still, where roots and norms have no derivative."""
    unroll = TaskUnroll(Batch(1, TaskOptions(), drives=[drive()]), 4)
    everywhere = np.ones(1, dtype=bool)
    unroll.batch.seed(everywhere, [0])
    unroll.batch.begin(everywhere)
    unroll.begin()
    for k in range(4):
        unroll.observe(k)
        unroll.act(k, np.zeros((1, 9), dtype=np.float32))
    unroll.weigh(np.full((4, 1), 0.25))
    for k in reversed(range(4)):
        found = unroll.back_through_act(k)
        assert np.isfinite(found).all()
        unroll.back_through_observe(k, np.ones((1, unroll.batch.layout.size), dtype=np.float32))
    assert np.abs(found).max() > 0.0


def test_what_has_no_gradient_is_refused():
    stacked = Batch(1, TaskOptions(observation={"stack": 2}), drives=[drive()])
    with pytest.raises(ConfigurationError, match=r"observation\.stack"):
        TaskUnroll(stacked, 2)
