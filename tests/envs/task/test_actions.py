"""What an action does, for each mode, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.platform import get_platform, platform_names
from motion_cueing.envs.platform.kernels.step import AXES
from motion_cueing.envs.platform.kinematics import legs_of_pose
from motion_cueing.envs.task import ActionOptions, DrivingSimulator, RandomizationOptions
from motion_cueing.envs.task.kernels.action import acceleration_scale, velocity_scale

from .tasks import drive

DT = 0.01


def env_with(**arguments) -> DrivingSimulator:
    env = DrivingSimulator(drives=[drive()], **arguments)
    env.reset(seed=0)
    return env


def applied(env: DrivingSimulator) -> np.ndarray:
    return env.batch.simulator.state["acceleration"][0].copy()


def rates(env: DrivingSimulator) -> np.ndarray:
    motion = env.batch.simulator.state["motion"][0]
    return np.concatenate([motion["rate"][:2], motion["velocity"], motion["beta_rate"], motion["rate"][8:]])


@pytest.mark.parametrize("name", platform_names())
def test_scale_is_the_largest_acceleration_the_fastest_leg_allows(name):
    platform = get_platform(name)
    scale, speed, step = acceleration_scale(platform), velocity_scale(platform), 1e-6
    for axis in range(2, 8):
        pose = np.zeros(9)
        pose[axis] = step
        ahead = legs_of_pose(platform.hexapod, pose[2:8])
        behind = legs_of_pose(platform.hexapod, -pose[2:8])
        gain = np.abs(np.array(ahead) - np.array(behind)).max() / (2.0 * step)
        assert scale[axis] == pytest.approx(platform.hexapod.acceleration / gain, rel=1e-6)
        assert speed[axis] == pytest.approx(platform.hexapod.velocity / gain, rel=1e-6)
    assert scale[0] == (platform.carriage.acceleration if platform.carriage else 0.0)
    assert scale[8] == (platform.turntable.acceleration if platform.turntable else 0.0)


def test_acceleration_is_a_share_of_the_scale():
    env = env_with(action=ActionOptions(authority=0.5))
    action = np.linspace(-0.4, 0.4, 9)
    env.step(action)
    assert np.allclose(applied(env), 0.5 * acceleration_scale(get_platform("paper")) * action, rtol=1e-6)
    assert np.allclose(env.action_of(applied(env)), action, atol=1e-6)


def test_jerk_integrates_to_an_acceleration_no_larger_than_the_scale():
    env = env_with(action=ActionOptions(mode="jerk", rise_time=0.1, authority=0.05))
    action = np.zeros(9)
    action[0] = 0.5
    for k in range(1, 31):
        env.step(action)
        assert applied(env)[0] == pytest.approx(min(0.5 * k * DT / 0.1, 1.0) * env.scale[0], rel=1e-6)
    assert not applied(env)[1:].any()


def test_velocity_is_reached_and_held_with_no_more_than_the_authority():
    env = env_with(action=ActionOptions(mode="velocity", authority=0.5))
    action, top = np.zeros(9), velocity_scale(get_platform("paper"))
    action[[0, 8]] = 0.05, -0.1
    for _ in range(60):
        env.step(action)
        assert np.all(np.abs(applied(env)) <= env.scale * (1.0 + 1e-9))
    assert np.allclose(rates(env), top * action, atol=1e-7)


def test_residual_of_zero_is_the_base_and_another_adds_to_it():
    policy = ClassicalWashout()
    env = env_with(action=ActionOptions(mode="residual", authority=0.01), base=ClassicalWashout())
    core, state, begins = env.batch.arrays.core, None, np.ones(1, dtype=bool)
    for k in range(40):
        wanted, state = policy.predict(core.view.copy(), state, begins)
        begins = np.zeros(1, dtype=bool)
        action = np.full(9, 0.5 * (k % 2))
        env.step(action)
        assert np.allclose(applied(env), wanted[0] + env.scale * action, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("mode", ["acceleration", "jerk", "velocity"])
def test_frozen_axes_do_not_move(mode):
    frozen = ("carriage_x", "turntable", "pitch")
    env = env_with(action=ActionOptions(mode=mode, frozen=frozen, authority=0.1))
    for _ in range(20):
        env.step(np.full(9, 0.2))
    still = np.array([axis in frozen for axis in AXES])
    assert not rates(env)[still].any()
    assert np.all(rates(env)[~still] != 0.0)


def test_repeated_action_is_held_and_its_reward_is_the_mean():
    held, single = env_with(action=ActionOptions(repeat=4)), env_with()
    rng = np.random.default_rng(0)
    for _ in range(10):
        action = rng.uniform(-0.1, 0.1, 9).astype(np.float32)
        observation, _, _, _, info = held.step(action)
        steps = [single.step(action) for _ in range(4)]
        assert np.array_equal(observation, steps[-1][0])
        for term in ("cue_error", "perceived_error", "false_cues", "tilt_rate", "stroke", "limits"):
            assert info[term] == pytest.approx(np.mean([step[4][term] for step in steps]))
        assert info["action_rate"] == steps[0][4]["action_rate"]


def test_gain_errors_of_actuators_scale_what_is_applied():
    env = env_with(randomization=RandomizationOptions(actuator_gain=0.2))
    env.step(np.full(9, 0.1))
    ratio = applied(env) / (0.1 * env.scale)
    assert np.all(np.abs(ratio - 1.0) <= 0.2 + 1e-6)
    assert len(set(ratio.round(9))) == 9
