"""Noise on what a policy sees: its size, its place, when it begins anew, and what stays the policy's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout, Policy, as_policy
from motion_cueing.baselines.interface import Machines
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.simulator.kernels.observation import read
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import Rollout, rollout
from motion_cueing.evaluation.studies.disturbances import NoisySensors, SensorNoise
from motion_cueing.train.agents import Agent

from .bends import PAPER, bend


class Seer:
    """Keeps what it sees; stands still; has nothing of a policy but ``predict``."""

    def __init__(self):
        self.seen = []

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.seen.append(np.array(observation))
        return np.zeros((len(observation), 9)), None


class Counter(Policy):
    """Counts its answers, as a solver counts its solves."""

    name = "counter"

    def __init__(self):
        self.calls = 0

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.calls += 1
        return np.zeros((len(observation), 9)), None

    @property
    def statistics(self):
        return {"solves": str(self.calls)}


class Informed(Policy):
    """Must know the drive."""

    def for_drive(self, cues):
        return Counter()


def noise_seen(policy, noise, n=1, steps=1):
    """(steps, n, size) noise on the observations of a policy in n drives side by side."""
    plain, noisy = (
        Rollout(one, Machines([bend()] * n, [PAPER])) for one in (policy, NoisySensors(policy, noise))
    )
    differences = []
    for _ in zip(range(steps), plain.steps(), noisy.steps(), strict=False):
        differences.append(noisy.observation - plain.observation)
    return np.array(differences), noisy.interface.slices


def test_the_noise_is_new_in_every_step_and_the_same_in_every_drive_and_for_every_policy():
    noise = SensorNoise(force=0.2, rate=0.03, seed=4)
    plain, first, second = Seer(), Seer(), Seer()
    rollout(plain, bend(), PAPER)
    for seer in (first, second):
        behind = NoisySensors(seer, noise)
        rollout(behind, bend(), PAPER)
        rollout(behind, bend(), PAPER)
    n = len(plain.seen)
    found = np.array(first.seen) - np.array([*plain.seen, *plain.seen])
    draws = np.random.default_rng(4)
    for k in range(n):
        in_car, in_cab = draws.normal(scale=0.2, size=(2, 1, 3))
        np.testing.assert_allclose(read(found[k], "reference_force"), in_car, atol=1e-12)
        np.testing.assert_allclose(read(found[k], "simulator_force"), in_cab, atol=1e-12)
        draws.normal(scale=0.03, size=(2, 1, 3))
    np.testing.assert_allclose(found[n:], found[:n], atol=1e-12)
    np.testing.assert_array_equal(first.seen, second.seen)


def test_what_a_policy_counts_is_shown_from_behind_the_noise():
    steps = len(bend()) - 1
    for policy in (Counter(), Informed()):
        record = rollout(NoisySensors(policy, SensorNoise()), bend(), PAPER)
        assert record.metadata["solves"] == str(steps)
        assert record.policy == "counter"


def test_a_policy_of_another_time_step_is_refused_behind_the_noise_too():
    behind = NoisySensors(ClassicalWashout(dt=0.02), SensorNoise())
    with pytest.raises(ConfigurationError, match=r"time step is 0\.02 s"):
        rollout(behind, bend(), PAPER)


def test_noise_has_its_size_and_is_on_cues_alone():
    seen, _ = noise_seen(Seer(), SensorNoise(force=0.2, rate=0.03, seed=4), n=40, steps=50)
    seen = seen.reshape(2000, -1)
    for name, size in (
        ("reference_force", 0.2),
        ("simulator_force", 0.2),
        ("reference_rate", 0.03),
        ("simulator_rate", 0.03),
    ):
        assert np.std(read(seen, name)) == pytest.approx(size, rel=0.05)
    for name in ("carriage", "beta", "legs", "acceleration"):
        assert not read(seen, name).any()


def test_policies_that_know_their_drives_get_the_same_noise_side_by_side():
    noise = SensorNoise(seed=2)
    seen, _ = noise_seen(Informed(), noise, n=2, steps=3)
    bare, _ = noise_seen(Seer(), noise, n=2, steps=3)
    assert seen.any()
    np.testing.assert_array_equal(seen, bare)


def test_no_noise_is_no_change():
    quiet = SensorNoise(force=0.0, rate=0.0)
    for policy in (ClassicalWashout(), make_policy("learned-preview", PAPER)):
        plain, behind = rollout(policy, bend(), PAPER), rollout(NoisySensors(policy, quiet), bend(), PAPER)
        np.testing.assert_array_equal(plain.action, behind.action)
        assert behind.policy == plain.policy


def still(task):
    """A policy that stands still in an environment."""
    return as_policy(Seer(), task)


def test_an_agents_differences_are_as_noisy_as_its_cues():
    seen, slices = noise_seen(still(make_policy("learned-preview", PAPER).task), SensorNoise(), n=50)
    rows = seen[0]
    for kind in ("force", "rate"):
        in_car, in_cab, error = (
            rows[:, slices[name]] for name in (f"reference_{kind}", f"simulator_{kind}", f"{kind}_error")
        )
        assert in_car.any()
        np.testing.assert_allclose(in_car - in_cab, error, atol=1e-6)


def test_rows_that_a_model_gives_have_the_cars_noise_alone():
    agent = make_policy("learned-preview", PAPER)
    task = replace(agent.task, observation=replace(agent.task.observation, simulator_cue="model"))
    modeled = Agent("modeled", task, agent.network, agent.record)
    assert rollout(NoisySensors(modeled, SensorNoise()), bend(), PAPER).policy == "modeled"
    seen, slices = noise_seen(still(task), SensorNoise(), n=50)
    rows = seen[0]
    for kind in ("force", "rate"):
        assert not rows[:, slices[f"simulator_{kind}"]].any()
        in_car = rows[:, slices[f"reference_{kind}"]]
        assert in_car.any()
        np.testing.assert_allclose(rows[:, slices[f"{kind}_error"]], in_car, atol=1e-6)
