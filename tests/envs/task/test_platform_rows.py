"""Environments whose platforms differ, and policies whose observation describes the platform."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform, platform_names
from motion_cueing.envs.platform.kinematics import axis_reach
from motion_cueing.envs.platform.randomization import PlatformRanges
from motion_cueing.envs.task import (
    DrivingSimulator,
    DrivingSimulatorVector,
    RandomizationOptions,
    TaskOptions,
)
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.kernels.action import acceleration_scale, velocity_scale
from motion_cueing.envs.task.kernels.observation import MACHINE
from motion_cueing.envs.task.unroll import TaskUnroll

from .tasks import drive
from .test_unroll import LinearPolicy, gradient_that_agrees

pytestmark = pytest.mark.slow

BUILD = PlatformRanges(
    travel=(0.3, 1.1),
    size=(0.4, 1.1),
    shape=(0.9, 1.1),
    rates=(0.5, 1.5),
    limited_turntable=0.5,
    without_carriage=0.6,
    without_turntable=0.5,
)
N = 6


def task(mode: str = "acceleration", **given) -> TaskOptions:
    """Episodes under way on machines somewhere in their travel, each told its own."""
    return TaskOptions(
        **{
            "observation": {"machine": True, "frame": "cab", "memory": (1.0,)},
            "action": {"mode": mode, "frame": "cab", "repeat": 2, "authority": 0.3},
            "reward": {"stroke_margin": 0.2, "weights": {"stroke": 1.0, "tilt_rate": 0.5}},
            "episode": {"duration": 2.0, "random_start": True, "platform_offset": 0.4},
            "randomization": RandomizationOptions(platform=BUILD, platforms=4),
        }
        | given
    )


def begun(options: TaskOptions, seeds: list[int]) -> Batch:
    batch = Batch(len(seeds), options, drives=[drive(samples=601)])
    everywhere = np.ones(len(seeds), dtype=bool)
    batch.seed(everywhere, seeds)
    batch.begin(everywhere)
    batch.observe(everywhere)
    return batch


@pytest.mark.parametrize("name", platform_names())
def test_rows_are_the_platforms_own_numbers(name):
    env = DrivingSimulator(platform=name, drives=[drive()], observation={"machine": True})
    observation, _ = env.reset(seed=0)
    rows = {r.name: r.scale * observation[env.batch.layout.slices[r.name]].astype(float) for r in MACHINE}
    machine = get_platform(name)
    speed, acceleration = velocity_scale(machine), acceleration_scale(machine)
    carriage, turntable = machine.carriage, machine.turntable
    expected = {
        "displacement_reach": axis_reach(machine.hexapod)[:3].ravel(),
        "beta_reach": axis_reach(machine.hexapod)[3:].ravel(),
        "hexapod_top_speed": speed[2:8],
        "hexapod_top_acceleration": acceleration[2:8],
        **{r.name: np.zeros(r.size) for r in MACHINE if r.name.startswith(("carriage", "turntable"))},
    }
    if carriage is not None:
        expected["carriage_travel"] = np.abs([*carriage.travel_x, *carriage.travel_y])
        expected["carriage_top_speed"] = carriage.velocity
        expected["carriage_top_acceleration"] = carriage.acceleration
    if turntable is not None:
        expected["turntable_kind"] = [1.0, turntable.travel is None]
        expected["turntable_travel"] = np.abs(turntable.travel or (2.0 * np.pi, 2.0 * np.pi))
        expected["turntable_top_speed"] = turntable.velocity
        expected["turntable_top_acceleration"] = turntable.acceleration
    assert rows.keys() == expected.keys()
    for row, values in expected.items():
        np.testing.assert_allclose(rows[row], values, rtol=1e-6, err_msg=row)
    constant = np.concatenate([observation[env.batch.layout.slices[r.name]] for r in MACHINE])
    assert np.abs(constant).max() < 5.0
    later, *_ = env.step(np.full(9, 0.5))
    again = np.concatenate([later[env.batch.layout.slices[r.name]] for r in MACHINE])
    np.testing.assert_array_equal(constant, again)


@pytest.mark.parametrize("frame", ["machine", "cab"])
def test_travel_used_is_the_share_of_the_way_to_the_end_ahead(frame):
    seen = {"machine": True, "frame": frame}
    env = DrivingSimulator(
        platform="nads-1", drives=[drive()], observation=seen, episode={"platform_offset": 0.7}
    )
    observation, _ = env.reset(seed=5)
    for _ in range(20):
        observation, *_ = env.step(np.linspace(0.3, -0.3, 9))
    setpoint = env.batch.simulator.state["setpoint"][0]
    x, y = setpoint["position"][:2] / 9.75
    heading = (setpoint["position"][8] + setpoint["beta"][2]) * (frame == "cab")
    turned = np.exp(-1j * heading) * (x + 1j * y)
    used = observation[env.batch.layout.slices["travel_used"]]
    expected = [turned.real, turned.imag, setpoint["position"][8] / np.radians(330.0)]
    np.testing.assert_allclose(used, expected, rtol=1e-5)
    assert np.abs(used).min() > 0.01


def test_an_endless_turntable_and_a_missing_carriage_use_no_travel():
    for name in ("paper", "dim-hexapod"):
        env = DrivingSimulator(platform=name, drives=[drive()], observation={"machine": True})
        env.reset(seed=0)
        for _ in range(5):
            observation, *_ = env.step(np.ones(9))
        used = observation[env.batch.layout.slices["travel_used"]]
        assert abs(used[2]) < 1e-6
        assert bool(used[:2].any()) == (name == "paper")


@pytest.mark.parametrize("mode", ["acceleration", "jerk", "velocity"])
def test_each_environment_is_the_one_of_its_machine_bit_for_bit(mode):
    many = begun(task(mode), list(range(N)))
    alone = []
    for i, which in enumerate(many.simulator.platform_of.tolist()):
        machine = many.simulator.platforms[which]
        alone.append(begun(task(mode, platform=machine, randomization=RandomizationOptions()), [i]))
    assert len(set(many.simulator.platform_of.tolist())) > 2
    rng = np.random.default_rng(0)
    for _ in range(30):
        action = rng.uniform(-1.0, 1.0, (N, 9)).astype(np.float32)
        many.write(action)
        many.step()
        for i, one in enumerate(alone):
            one.write(action[i : i + 1])
            one.step()
            np.testing.assert_array_equal(many.commanded[i], one.commanded[0])
            np.testing.assert_array_equal(many.arrays.observation.pull()[i], one.arrays.observation.pull()[0])
            assert many.arrays.reward.pull()[i] == one.arrays.reward.pull()[0]


def test_the_scale_is_each_machines_own():
    options = task(action={"authority": 0.5})
    envs = DrivingSimulatorVector(N, options, drives=[drive(samples=601)])
    envs.reset(seed=0)
    batch = envs.batch
    own = [0.5 * acceleration_scale(batch.simulator.platforms[k]) for k in batch.simulator.platform_of]
    np.testing.assert_array_equal(envs.scale, own)
    action = np.where(envs.scale > 0.0, 0.25, 0.0)
    np.testing.assert_allclose(envs.action_of(0.25 * envs.scale), action, rtol=1e-6)
    one = DrivingSimulator(options, drives=[drive(samples=601)])
    for seed in range(N):
        one.reset(seed=seed)
        np.testing.assert_array_equal(one.scale, own[seed])
        np.testing.assert_allclose(one.action_of(0.25 * one.scale), action[seed], rtol=1e-6)
    machines = [0.5 * acceleration_scale(machine) for machine in batch.simulator.platforms]
    for axis, usual in enumerate(batch.usual_scale):
        moving = [scale[axis] for scale in machines if scale[axis] > 0.0]
        assert usual == (np.median(moving) if moving else 0.0)


def test_largest_is_the_same_on_every_machine_that_has_the_axis():
    largest = tuple(float(k) for k in range(1, 10))
    batch = begun(task(action={"largest": largest, "authority": 0.01}), list(range(N)))
    has = (
        np.array([acceleration_scale(batch.simulator.platforms[k]) for k in batch.simulator.platform_of])
        > 0.0
    )
    assert not has.all()
    np.testing.assert_allclose(batch.scale, np.where(has, 0.01 * np.array(largest), 0.0), rtol=1e-12)
    batch.write(np.full((N, 9), 0.5))
    batch.step()
    np.testing.assert_allclose(batch.commanded, 0.5 * batch.scale, rtol=1e-6)
    with pytest.raises(ConfigurationError, match="largest"):
        task(action={"largest": (1.0, 2.0)})


def test_an_episode_can_be_given_its_machine():
    batch = begun(task(), [0] * 4)
    batch.begin(np.array([True, False, True, True]), machine=[3, 3, 1, 0])
    first = batch.simulator.platform_of[1]
    assert batch.simulator.platform_of.tolist() == [3, first, 1, 0]


def test_the_same_seed_draws_the_same_machines_and_another_others():
    first, again, other = (begun(task(episode={"library_seed": s}), [0]) for s in (1, 1, 2))
    assert first.simulator.platforms == again.simulator.platforms
    assert not set(first.simulator.platforms) & set(other.simulator.platforms)
    # What is drawn of the dynamics does not depend on the builds.
    lag = {"natural_frequency": (20.0, 40.0), "platforms": 4}
    with_build = begun(task(randomization={"platform": {"size": (0.5, 1.0)}, **lag}), [0])
    without = begun(task(randomization=lag), [0])
    pairs = zip(with_build.simulator.platforms, without.simulator.platforms, strict=True)
    assert all(a.hexapod.dynamics == b.hexapod.dynamics for a, b in pairs)


@pytest.mark.parametrize("mode", ["acceleration", "jerk"])
def test_gradients_through_two_machines_agree_with_finite_differences(mode):
    batch = begun(task(mode, randomization=RandomizationOptions(platform=BUILD, platforms=2)), [0, 1, 3])
    assert len(set(batch.simulator.platform_of.tolist())) == 2
    found = gradient_that_agrees(TaskUnroll(batch, 8), LinearPolicy(batch.layout.size))
    told = batch.layout.slices["hexapod_top_speed"]
    assert np.abs(found[told]).max() > 0.0
