"""Noise on what a policy sees: its size, its place, when it begins anew, and what stays the policy's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE, read
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import rollout
from motion_cueing.evaluation.studies.disturbances import SensorNoise, with_noise
from motion_cueing.train.agents import Agent

from .studies import PAPER, bend


class Seer:
    """Keeps what it sees; stands still."""

    def __init__(self):
        self.seen = []

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.seen.append(np.array(observation))
        return np.zeros((len(observation), 9)), len(self.seen)


class Stateless(Seer):
    """The same without a memory, as an agent is."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return super().predict(observation)[0], None


class Counter(Stateless):
    """Counts its answers, as a solver counts its solves."""

    name = "counter"

    @property
    def notes(self):
        return {"solves": str(len(self.seen))}


class Told:
    """Is told the drive."""

    name = "told"

    def for_drive(self, cues):
        return Counter()


def looked(policy, rows, steps=1):
    state = None
    for _ in range(steps):
        _, state = policy.predict(rows, state, None)


@pytest.mark.parametrize("kind", [Seer, Stateless])
def test_the_noise_is_new_in_every_step_and_the_same_for_every_policy(kind):
    noise = SensorNoise(force=0.2, rate=0.03, seed=4)
    plain, first, second = Seer(), kind(), kind()
    rollout(plain, bend(), PAPER)
    for seer in (first, second):
        behind = with_noise(seer, noise)
        rollout(behind, bend(), PAPER)
        rollout(behind, bend(), PAPER)
    n = len(plain.seen)
    found = np.array(first.seen) - np.array([*plain.seen, *plain.seen])
    draws = np.random.default_rng(4)
    for k in range(n):
        wanted, felt = draws.normal(scale=0.2, size=(2, 1, 3))
        np.testing.assert_allclose(read(found[k], "reference_force"), wanted, atol=1e-12)
        np.testing.assert_allclose(read(found[k], "simulator_force"), felt, atol=1e-12)
        draws.normal(scale=0.03, size=(2, 1, 3))
    # A second drive has the noise of the first, and another policy has the same.
    np.testing.assert_allclose(found[n:], found[:n], atol=1e-12)
    np.testing.assert_array_equal(first.seen, second.seen)


@pytest.mark.parametrize("kind", [Seer, Stateless])
def test_noise_begins_anew_where_any_drive_begins(kind):
    seer, row = kind(), np.zeros((2, OBSERVATION_SIZE))
    behind = with_noise(seer, SensorNoise())
    state = None
    for begins in ([True, True], [False, False], [False, True], [False, False]):
        _, state = behind.predict(row, state, np.array(begins))
    assert (seer.seen[0] != seer.seen[1]).any()
    np.testing.assert_array_equal(seer.seen[2:], seer.seen[:2])


def test_what_a_policy_counts_is_told_from_behind_the_noise():
    steps = len(bend()) - 1
    for policy in (Counter(), Told()):
        record = rollout(with_noise(policy, SensorNoise()), bend(), PAPER)
        assert record.metadata["solves"] == str(steps)
        assert record.policy == "counter"


def test_a_policy_of_another_time_step_is_refused_behind_the_noise_too():
    behind = with_noise(ClassicalWashout(dt=0.02), SensorNoise())
    with pytest.raises(ConfigurationError, match=r"time step is 0\.02 s"):
        rollout(behind, bend(), PAPER)


def test_noise_has_its_size_is_on_cues_alone_and_is_the_same_in_every_drive():
    noise = SensorNoise(force=0.2, rate=0.03, seed=4)
    seers = [Seer(), Seer()]
    for seer in seers:
        looked(with_noise(seer, noise), np.zeros((2000, OBSERVATION_SIZE)))
    np.testing.assert_array_equal(seers[0].seen[0], seers[1].seen[0])
    seen = seers[0].seen[0]
    for name, size in (
        ("reference_force", 0.2),
        ("simulator_force", 0.2),
        ("reference_rate", 0.03),
        ("simulator_rate", 0.03),
    ):
        assert np.std(read(seen, name)) == pytest.approx(size, rel=0.05)
    for name in ("carriage", "beta", "legs", "acceleration"):
        assert not read(seen, name).any()
    seer = Stateless()
    behind = with_noise(seer, noise)
    looked(behind, np.zeros((1, OBSERVATION_SIZE)), steps=3)
    looked(behind, np.zeros((1, OBSERVATION_SIZE)), steps=1)
    assert (seer.seen[0] != seer.seen[1]).any()
    np.testing.assert_array_equal(seer.seen[0], seer.seen[3])


def test_no_noise_is_no_change():
    quiet = SensorNoise(force=0.0, rate=0.0)
    for policy in (ClassicalWashout(), make_policy("learned-preview", PAPER)):
        plain, behind = rollout(policy, bend(), PAPER), rollout(with_noise(policy, quiet), bend(), PAPER)
        np.testing.assert_array_equal(plain.action, behind.action)
        assert behind.policy == plain.policy


def test_an_agents_differences_are_as_noisy_as_its_cues():
    agent = make_policy("learned-preview", PAPER)
    behind = with_noise(agent, SensorNoise())
    rows = behind._noisy(np.zeros((50, agent.layout.size)))
    slices = agent.layout.slices
    for kind in ("force", "rate"):
        wanted, felt, error = (
            rows[:, slices[n]] for n in (f"wanted_{kind}", f"felt_{kind}", f"{kind}_error")
        )
        np.testing.assert_allclose(wanted - felt, error, atol=1e-7)


def test_a_policy_that_is_told_the_drive_has_noisy_sensors_too():
    seer = with_noise(Told(), SensorNoise(force=1.0)).for_drive(bend())
    looked(seer, np.zeros((1, OBSERVATION_SIZE)))
    assert seer._policy.seen[0].any()


def test_what_a_model_tells_an_agent_has_no_noise_but_the_cars():
    agent = make_policy("learned-preview", PAPER)
    task = replace(agent.task, observation=replace(agent.task.observation, felt="model"))
    modeled = Agent("modeled", task, agent.network, agent.record)
    rows = with_noise(modeled, SensorNoise())._noisy(np.zeros((50, agent.layout.size)))
    slices = agent.layout.slices
    for kind in ("force", "rate"):
        assert not rows[:, slices[f"felt_{kind}"]].any()
        wanted = rows[:, slices[f"wanted_{kind}"]]
        assert wanted.any()
        np.testing.assert_allclose(rows[:, slices[f"{kind}_error"]], wanted, atol=1e-7)
