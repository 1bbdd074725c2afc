"""Policies on the environment's own observation, and what the reward says of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.baselines.washout import HighPass, load_washout
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import get_maneuver, maneuver_names
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE
from motion_cueing.envs.task import DrivingSimulator, DrivingSimulatorVector, RewardWeights
from motion_cueing.envs.task.kernels.reward import N_TERMS, TERMS
from motion_cueing.evaluation import rollout

from .tasks import drive

# EST1 begins off the middle; from neutral, where an episode begins, it needs stronger high-passes.
CENTERED = replace(
    load_washout("est1"),
    hps=(HighPass(2, 0.12),) * 2,
    hpi=(HighPass(1, 0.15), HighPass(1, 0.15), HighPass(2, 2.0)),
    start_carriage=(0.0, 0.0),
)
POLICIES = {
    "no-motion": NoMotion(),
    "classical": ClassicalWashout("classical"),
    "est1": ClassicalWashout("est1"),
    "est1-centered": ClassicalWashout(CENTERED),
    "brk": ClassicalWashout("brk"),
}


def headline(state: np.ndarray) -> np.ndarray:
    """(n,) |df|^2 / 0.6^2 + |dw|^2 / (3 deg/s)^2 of every environment."""
    force = (state["simulator_cue"]["force"] - state["reference_cue"]["force"]) / 0.6
    rate = (state["simulator_cue"]["rate"] - state["reference_cue"]["rate"]) / math.radians(3.0)
    return np.sum(force**2 + rate**2, axis=1)


def scores(policy, drives: list[CueTrace]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """J, mean reward and mean terms of the reward of a policy on each drive."""
    n = len(drives)
    env = DrivingSimulatorVector(n, drives=drives, autoreset_mode=AutoresetMode.DISABLED)
    observation, _ = env.reset(seed=0, options={"drive": list(range(n))})
    state, begins = None, np.ones(n, dtype=bool)
    lengths = np.array([len(drive) for drive in drives])
    costs, rewards = headline(env.batch.simulator.state), np.zeros(n)
    terms = np.zeros((n, N_TERMS))
    for k in range(1, lengths.max()):
        seen = observation[:, :OBSERVATION_SIZE]
        acceleration, state = policy.predict(seen, state, begins, deterministic=True)
        observation, reward, *_ = env.step(env.action_of(acceleration))
        going, begins = k < lengths, np.zeros(n, dtype=bool)
        costs += going * headline(env.batch.simulator.state)
        rewards += going * reward
        terms += going[:, None] * env.batch.arrays.terms.pull()
    return costs / lengths, rewards / (lengths - 1), terms / (lengths - 1)[:, None]


@pytest.fixture(scope="module")
def suite() -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    drives = [get_maneuver(name).drive() for name in maneuver_names()]
    return {name: scores(policy, drives) for name, policy in POLICIES.items()}


@pytest.mark.slow
def test_default_reward_ranks_policies_as_the_headline_metric_does(suite):
    for i, maneuver in enumerate(maneuver_names()):
        by_cost = sorted(suite, key=lambda name: suite[name][0][i])
        by_reward = sorted(suite, key=lambda name: -suite[name][1][i])
        assert by_cost == by_reward, maneuver
    by_cost = sorted(suite, key=lambda name: suite[name][0].mean())
    by_reward = sorted(suite, key=lambda name: -suite[name][1].mean())
    assert by_cost == by_reward
    assert len({round(float(costs.mean()), 6) for costs, *_ in suite.values()}) == len(POLICIES)


def test_default_reward_is_the_headline_metric_and_little_more(suite):
    """A hundredth at most wherever a policy keeps off the limits, which the rest charges for."""
    weights = RewardWeights()
    charged = np.array([getattr(weights, name) for name in TERMS])
    at_limits = [TERMS.index(name) for name in ("stroke", "limits", "tilt_rate")]
    checked = 0
    for name, (costs, rewards, terms) in suite.items():
        assert np.allclose(-rewards, terms @ charged, rtol=1e-5)
        assert np.all(-rewards > 0.99 * costs)
        # The paper's own EST1 meets limits from neutral; the others keep off them nearly everywhere.
        limited = (terms * charged)[:, at_limits].sum(axis=1) > 0.005 * costs
        limited &= name == "est1"
        assert np.all((-rewards < 1.01 * costs)[~limited]), name
        checked += np.sum(~limited)
    assert checked > 0.75 * len(suite) * len(maneuver_names())


@pytest.mark.parametrize("name", ["classical", "est2", "brk"])
def test_washout_on_the_observation_moves_as_in_a_rollout(name):
    policy, cues = ClassicalWashout(name), drive(samples=601)
    expected = rollout(policy, cues, start=np.zeros(9))
    env = DrivingSimulator(drives=[cues])
    observation, _ = env.reset(seed=0)
    state, begins, k = None, np.ones(1, dtype=bool), 0
    truncated = False
    while not truncated:
        acceleration, state = policy.predict(observation[None, :OBSERVATION_SIZE], state, begins)
        observation, _, _, truncated, _ = env.step(env.action_of(acceleration[0]))
        begins, k = np.zeros(1, dtype=bool), k + 1
        motion = env.batch.simulator.state["motion"][0]
        assert np.allclose(motion["position"][:2], expected.carriage[k], atol=1e-4)
        assert np.allclose(motion["position"][2:8], expected.legs[k], atol=1e-4)
        assert np.isclose(motion["position"][8], expected.turntable[k], atol=1e-4)
        felt = env.batch.simulator.state["simulator_cue"][0]
        assert np.allclose(felt["force"], expected.f_simulator[k], atol=1e-3)
        assert np.allclose(felt["rate"], expected.w_simulator[k], atol=1e-4)
    assert k == len(cues) - 1
