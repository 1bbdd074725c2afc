"""Policies of an environment are driven as they would be in it, and recorded as any other."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.baselines.washout import ScheduledWashout
from motion_cueing.envs.errors import ActionError, ConfigurationError
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.simulator.kernels.observation import OBSERVATION_SIZE, read
from motion_cueing.envs.task import (
    ActionOptions,
    EpisodeOptions,
    ObservationOptions,
    RandomizationOptions,
    TaskOptions,
)
from motion_cueing.envs.task.environment import normalized
from motion_cueing.envs.task.kernels.action import acceleration_scale
from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.evaluation import Trajectory, rollout

from ..envs.task.tasks import drive

SCALE = acceleration_scale(get_platform("paper"))


class InTask:
    """A policy of accelerations in an environment."""

    def __init__(self, inner, task=None) -> None:
        self.inner, self.task, self.name = inner, task or TaskOptions(), "in-task"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        acceleration, state = self.inner.predict(observation[:, :OBSERVATION_SIZE], state, episode_start)
        return normalized(acceleration, SCALE), state


class Still:
    """Nothing, on top of a base policy; keeps what it sees."""

    def __init__(self, task, base_policy=None, size=9) -> None:
        self.task, self.base_policy, self.size, self.seen = task, base_policy, size, []

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.seen.append(observation[0])
        return np.zeros((1, self.size)), state


class Springs:
    """Feedback without memory; its answer is held for some steps."""

    def __init__(self, hold=1) -> None:
        self.hold = hold

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        calls, held = state or (0, None)
        if calls % self.hold == 0:
            held = np.zeros((1, 9))
            held[:, :2] = 0.5 * read(observation, "reference_force")[:, :2] - read(
                observation, "carriage_rate"
            )
        return held, (calls + 1, held)


def assert_same(one: Trajectory, other: Trajectory) -> None:
    """The same motion, cues and actions; policies in an environment see and act in float32."""
    for name in (field.name for field in fields(Trajectory)):
        if name in ("maneuver", "policy", "metadata", "limits", "step_time", "legs_rate"):
            continue
        a, b = getattr(one, name), getattr(other, name)
        same = a == b if isinstance(a, str) else np.allclose(a, b, atol=1e-3, rtol=0.0)
        assert same, name


def in_mode(mode, repeat=1) -> TaskOptions:
    return TaskOptions(action=ActionOptions(mode=mode, repeat=repeat))


def test_a_washout_in_the_environment_moves_as_outside_of_it():
    cues = drive()
    expected = rollout(ClassicalWashout(), cues)
    assert np.abs(expected.carriage).max() > 0.01
    found = rollout(InTask(ClassicalWashout()), cues)
    assert_same(found, expected)
    assert np.isnan(found.step_time[0])
    assert np.all(found.step_time[1:] > 0.0)


def test_it_begins_at_the_pose_it_likes_or_is_given():
    start = np.array([0.5, -0.4, 0.02, 0.0, 0.03, 0.0, 0.0, 0.0, 0.2])
    expected = rollout(ClassicalWashout(), drive(), start=start)
    assert_same(rollout(InTask(ClassicalWashout()), drive(), start=start), expected)
    policy = InTask(ClassicalWashout())
    policy.start = start
    found = rollout(policy, drive())
    assert np.allclose(found.carriage[0], start[:2])
    assert_same(found, expected)


def test_every_time_step_of_a_held_action_is_recorded():
    cues = drive(samples=302)
    expected = rollout(Springs(hold=7), cues)
    found = rollout(InTask(Springs(), in_mode("acceleration", 7)), cues)
    assert_same(found, expected)
    assert np.abs(np.diff(found.action[1:8, 0])).max() == 0.0
    assert found.action[7, 0] != found.action[8, 0]
    assert np.array_equal(np.flatnonzero(np.isfinite(found.step_time)), np.arange(1, 302, 7))


@pytest.mark.parametrize("repeat", [1, 5])
@pytest.mark.parametrize("mode", ["residual", "gains"])
def test_no_correction_of_a_base_leaves_it_as_it_is(mode, repeat):
    kind, size = (ScheduledWashout, 6) if mode == "gains" else (ClassicalWashout, 9)
    policy = Still(in_mode(mode, repeat), kind("classical"), size)
    assert_same(rollout(policy, drive()), rollout(ClassicalWashout("classical"), drive()))


def test_a_preview_shows_what_comes():
    task = TaskOptions(observation=ObservationOptions(preview=3, preview_spacing=0.5))
    policy, cues = Still(task), drive()
    found = rollout(policy, cues)
    rows = layout_of(task.observation, "acceleration", 9).slices["preview"]
    seen = np.array(policy.seen)[:, rows].reshape(-1, 3, 6)
    assert len(seen) == len(cues) - 1
    for k, ahead in ((0, 50), (1, 100), (2, 150)):
        truth = found.f_reference[ahead:, :2] / 10.0
        assert np.allclose(seen[: len(truth) - 1, k, :2], truth[:-1], atol=1e-5)


def test_nothing_is_random_whatever_it_was_trained_with():
    wild = TaskOptions(
        randomization=RandomizationOptions(
            actuator_gain=0.3, sensor_gain=0.3, force_noise=1.0, dead_time=(0.0, 0.1), platforms=2
        ),
        episode=EpisodeOptions(
            platform_offset=0.8, duration=1.0, random_start=True, terminate_on_failure=True
        ),
    )
    cues = drive()
    assert_same(rollout(InTask(ClassicalWashout(), wild), cues), rollout(ClassicalWashout(), cues))


def test_another_machine_is_refused_unless_forced():
    policy, other = InTask(ClassicalWashout()), get_platform("nads-1")
    with pytest.raises(ConfigurationError, match="made for the motion base 'paper', not 'nads-1'"):
        rollout(policy, drive(), platform=other)
    assert rollout(policy, drive(samples=5), platform=get_platform("paper")).platform == "paper"
    policy.task = replace(policy.task, platform=other)
    assert rollout(policy, drive(samples=5)).platform == "nads-1"


def test_another_perception_is_refused_where_it_is_seen():
    telban = get_vestibular_model("telban")
    policy = Still(TaskOptions(vestibular="telban", observation=ObservationOptions(perceived=True)))
    with pytest.raises(ConfigurationError, match="senses with the vestibular model 'telban'"):
        rollout(policy, drive())
    assert rollout(policy, drive(samples=5), vestibular=telban).metadata["vestibular"] == "telban"
    blind = Still(TaskOptions(vestibular="telban"))
    assert rollout(blind, drive(samples=5)).metadata["vestibular"] == "zacharias"


def test_what_does_not_fit_is_refused():
    with pytest.raises(ConfigurationError, match=r"time step is 0\.01 s, the rollout's 0\.002 s"):
        rollout(Still(TaskOptions()), drive(), dt=0.002)
    with pytest.raises(ActionError, match=r"step 1 has shape \(1, 8\), expected \(1, 9\)"):
        rollout(Still(TaskOptions(), size=8), drive())
    with pytest.raises(ConfigurationError, match="'residual' needs base="):
        rollout(Still(in_mode("residual")), drive())
