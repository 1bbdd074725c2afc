"""The Stable-Baselines3 environment against a loop of single environments, and its library's own checks."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from motion_cueing.envs.errors import ActionError, ConfigurationError
from motion_cueing.envs.task import DrivingSimulator, EpisodeOptions
from motion_cueing.envs.task.kernels.reward import TERMS
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

from ..envs.task.tasks import SHORT, drive, options

N = 3


@pytest.mark.parametrize("name", ["defaults", "stack", "residual", "gains", "frozen", "termination"])
def test_stable_baselines_checker_finds_nothing_to_warn_of(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(DrivingSimulator(**options(name)))


@pytest.mark.parametrize("name", ["defaults", "stack", "residual", "termination"])
def test_batch_is_stable_baselines_loop_of_single_environments(name):
    batch = DrivingSimulatorVecEnv(N, **options(name))
    loop = DummyVecEnv([lambda: Monitor(DrivingSimulator(**options(name)))] * N)
    for envs in (batch, loop):
        envs.seed(7)
    assert np.array_equal(batch.reset(), loop.reset())
    rng, ends = np.random.default_rng(0), 0
    for _ in range(210):
        action = rng.uniform(-1.0, 1.0, (N, 9)).astype(np.float32)
        seen, expected = batch.step(action), loop.step(action)
        for got, wanted in zip(seen[:3], expected[:3], strict=True):
            assert np.array_equal(got, wanted)
        for i in np.flatnonzero(seen[2]):
            ends += 1
            got, wanted = seen[3][i], expected[3][i]
            assert np.array_equal(got["terminal_observation"], wanted["terminal_observation"])
            assert got["TimeLimit.truncated"] == wanted["TimeLimit.truncated"]
            assert got["episode"]["l"] == wanted["episode"]["l"]
            assert got["episode"]["r"] == pytest.approx(wanted["episode"]["r"], rel=1e-5)
    assert ends >= N


def test_terms_of_an_episode_are_the_means_of_its_steps():
    batch, single = DrivingSimulatorVecEnv(1, episode=SHORT), DrivingSimulator(episode=SHORT)
    batch.seed(2)
    batch.reset()
    single.reset(seed=2)
    action, infos, done = np.full(9, 0.1, dtype=np.float32), [], False
    while not done:
        *_, done, told = batch.step(action[None])
        infos.append(single.step(action)[4])
    for term in TERMS:
        assert told[0]["terms"][term] == pytest.approx(np.mean([info[term] for info in infos]))


def test_failure_is_not_told_as_the_end_of_time():
    episode = EpisodeOptions(library=1, drive_duration=20.0, terminate_on_failure=True)
    envs = DrivingSimulatorVecEnv(1, episode=episode)
    envs.reset()
    action, done = np.zeros((1, 9), dtype=np.float32), False
    action[0, 0] = 1.0
    while not done:
        *_, done, infos = envs.step(action)
    assert infos[0]["TimeLimit.truncated"] is False
    assert infos[0]["terms"]["failure"] > 0.0


def test_options_choose_drives_for_all_or_none():
    envs = DrivingSimulatorVecEnv(2, drives=[drive("a"), drive("b")])
    envs.set_options([{"drive": "b"}, {"drive": "a"}])
    envs.reset()
    assert list(envs.batch.simulator.drive_of) == [1, 0]
    envs.set_options([{"drive": "b"}, {}])
    with pytest.raises(ConfigurationError, match="every environment or for none"):
        envs.reset()


def test_attributes_and_methods_are_those_of_the_whole_batch():
    envs = DrivingSimulatorVecEnv(2, episode=SHORT)
    assert envs.get_attr("render_mode") == [None, None]
    envs.set_attr("note", 3)
    assert envs.get_attr("note", indices=[1]) == [3]
    assert envs.env_method("action_of", np.zeros(9))[1].shape == (9,)
    assert envs.env_is_wrapped(Monitor) == [True, True]
    assert envs.env_is_wrapped(VecNormalize) == [False, False]
    with pytest.raises(ConfigurationError, match="indices must be None"):
        envs.set_attr("note", 4, indices=0)
    with pytest.raises(ActionError, match="not finite"):
        envs.step(np.full((2, 9), np.nan))


def test_an_agent_learns_on_it_and_is_evaluated():
    envs = VecNormalize(DrivingSimulatorVecEnv(4, episode=SHORT))
    agent = PPO("MlpPolicy", envs, n_steps=32, batch_size=64, n_epochs=1, seed=0, device="cpu")
    agent.learn(256)
    assert len(agent.ep_info_buffer) >= 4
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mean, _ = evaluate_policy(agent, envs, n_eval_episodes=2)
    assert np.isfinite(mean)
    envs.close()


def test_a_group_shares_what_is_drawn_and_rewards_are_relative_to_the_others():
    episode = {"library": 6, "drive_duration": 3.0, "duration": 1.0}
    single = [DrivingSimulator("cueing", episode=episode, reward={"against_base": False}) for _ in range(6)]
    envs = DrivingSimulatorVecEnv(6, "cueing", episode=episode, group=3)
    envs.seed(11)
    first = envs.reset()
    alone = np.array([one.reset(seed=11 + i // 3)[0] for i, one in enumerate(single)])
    # The base policy's network adds up in another order in a batch.
    assert np.allclose(first, alone, rtol=0.0, atol=1e-5)
    assert np.array_equal(first[0], first[2])
    assert not np.array_equal(first[0], first[3])
    rng, returns = np.random.default_rng(0), np.zeros(6)
    for _ in range(12):
        action = rng.uniform(-1.0, 1.0, (6, 4)).astype(np.float32)
        reward = envs.step(action)[1]
        own = np.array([one.step(one_action)[1] for one, one_action in zip(single, action, strict=True)])
        for i in range(6):
            others = [k for k in range(6) if k // 3 == i // 3 and k != i]
            assert reward[i] == pytest.approx(own[i] - own[others].mean(), rel=1e-3, abs=1e-4)
        returns += own
    done, action = np.zeros(6, dtype=bool), np.zeros((6, 4), dtype=np.float32)
    while not done.any():
        reward, done, infos = envs.step(action)[1:]
        returns += [one.step(one_action)[1] for one, one_action in zip(single, action, strict=True)]
    # The group begins and ends together, and its returns are those of the environments themselves.
    assert done.all()
    assert [info["episode"]["r"] for info in infos] == pytest.approx(returns.tolist(), rel=1e-3)
    with pytest.raises(ConfigurationError, match="num_envs 6 must be a multiple of group 4"):
        DrivingSimulatorVecEnv(6, "cueing", group=4)


def test_staggered_first_episodes_end_one_after_another_and_the_next_are_whole():
    episode = {"library": 2, "drive_duration": 3.0, "duration": 1.2}
    envs = DrivingSimulatorVecEnv(6, "cueing", episode=episode, group=2, stagger=True)
    envs.reset()
    ends = []
    for k in range(1, 46):
        for i in np.flatnonzero(envs.step(np.zeros((6, 4), dtype=np.float32))[2]):
            ends.append((k, int(i)))
    # 120 time steps are 15 actions of 8: first a third, two thirds and all of them.
    assert ends == sorted((k, i) for i in range(6) for k in range(5 * (1 + i // 2), 46, 15) if k <= 45)


def test_the_drives_share_is_that_of_an_analysis_of_variance():
    episode = {"library": 6, "drive_duration": 3.0, "duration": 1.0}
    envs = DrivingSimulatorVecEnv(6, "cueing", episode=episode, group=3)
    assert envs.take_drive_share() is None
    envs.seed(11)
    envs.reset()
    rng, rewards = np.random.default_rng(0), []
    for k in range(10):
        envs.step(rng.uniform(-1.0, 1.0, (6, 4)).astype(np.float32))
        rewards.append(envs.batch.arrays.reward.pull().astype(float).reshape(2, 3))
        if k == 4:
            # Goes on from here in other environments.
            between = envs.snapshot()
            envs = DrivingSimulatorVecEnv(6, "cueing", episode=episode, group=3)
            envs.restore(between)
    groups = np.concatenate(rewards)
    # Mean squares between and within 20 groups of 3.
    square_between = 3.0 * ((groups.mean(axis=1) - groups.mean()) ** 2).sum() / 19.0
    square_within = ((groups - groups.mean(axis=1, keepdims=True)) ** 2).sum() / 40.0
    common = (square_between - square_within) / 3.0
    share = envs.take_drive_share()
    assert share == pytest.approx(common / (common + square_within), rel=1e-4)
    assert 0.0 < share < 1.0
    assert envs.take_drive_share() is None


def test_without_groups_there_is_no_drives_share():
    envs = DrivingSimulatorVecEnv(2, "cueing", episode={"library": 2, "drive_duration": 3.0, "duration": 1.0})
    envs.reset()
    envs.step(np.zeros((2, 4), dtype=np.float32))
    assert envs.take_drive_share() is None
