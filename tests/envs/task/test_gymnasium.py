"""Gymnasium's contract: registration, checkers, seeding, pickling, errors."""

from __future__ import annotations

import copy
import importlib.metadata
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import motion_cueing.envs
from motion_cueing.envs.errors import ActionError, ConfigurationError, UnknownNameError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import from_dict, save, to_dict
from motion_cueing.envs.task import DrivingSimulator, DrivingSimulatorVector, TaskOptions

from .tasks import EVERY_OPTION, SHORT, drive, options

pytestmark = pytest.mark.slow

ID = motion_cueing.envs.ENVIRONMENT_ID


def test_registering_twice_changes_nothing_and_warns_of_nothing():
    before = gymnasium.registry[ID]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        importlib.reload(motion_cueing.envs)
    assert gymnasium.registry[ID] is before


def test_make_vec_gives_the_native_batch():
    envs = gymnasium.make_vec(ID, num_envs=3, episode=SHORT)
    assert isinstance(envs, DrivingSimulatorVector)
    assert envs.num_envs == 3
    assert envs.observation_space.shape == (3, 67)


def test_gymnasiums_wrappers_of_batches_accept_it():
    envs = gymnasium.make_vec(
        ID, num_envs=2, autoreset_mode=AutoresetMode.SAME_STEP, render_mode=None, episode=SHORT
    )
    assert envs.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    envs = RecordEpisodeStatistics(envs)
    envs.reset(seed=0)
    for _ in range(40):
        *_, truncated, info = envs.step(np.zeros((2, 9), dtype=np.float32))
    assert truncated.all()
    assert list(info["episode"]["l"]) == [40, 40]


DRAWN = ("defaults", "builds", "dim hexapod", "24-inch", "nads-1")
"""Options that a picture depends on: those of the machine."""


@pytest.mark.parametrize("name", EVERY_OPTION)
def test_gymnasiums_checker_finds_nothing_to_warn_of(name):
    env = gymnasium.make(ID, **options(name)).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=name not in DRAWN)


@pytest.mark.parametrize("name", EVERY_OPTION)
def test_observations_stay_in_their_space_whatever_the_actions(name):
    env = DrivingSimulator(**options(name))
    env.action_space.seed(1)
    observation, _ = env.reset(seed=1)
    for _ in range(60):
        assert observation in env.observation_space
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert np.isfinite(reward)
        if terminated or truncated:
            observation, _ = env.reset()


@pytest.mark.parametrize("name", EVERY_OPTION)
def test_same_seed_same_bits(name):
    def episode():
        env = DrivingSimulator(**options(name))
        env.action_space.seed(3)
        seen = [env.reset(seed=3)[0]]
        for k in range(70):
            observation, reward, *_ = env.step(env.action_space.sample())
            seen += [observation, np.float64(reward)]
            if k % 30 == 29:
                seen.append(env.reset()[0])
        return b"".join(part.tobytes() for part in seen)

    assert episode() == episode()


def test_other_seeds_and_later_episodes_differ():
    env = DrivingSimulator(episode=SHORT)
    first = [env.reset(seed=seed)[0] for seed in range(8)] + [env.reset()[0] for _ in range(8)]
    assert len({observation.tobytes() for observation in first}) == 16


def test_pickled_environment_is_the_same():
    env = DrivingSimulator(episode=SHORT, drives=[drive()])
    copy = pickle.loads(pickle.dumps(env))
    assert copy.task == env.task
    assert np.array_equal(copy.reset(seed=4)[0], env.reset(seed=4)[0])


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize(
    ("name", "steps"), [("stack", 0), ("residual", 30), ("gains", 30), ("actuators", 90)]
)
def test_a_copy_in_mid_episode_goes_on_with_the_same_bits(name, steps, copied):
    env = DrivingSimulator(**options(name))
    env.action_space.seed(2)
    env.reset(seed=4)
    for _ in range(steps):
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
    other = copied(env)
    for _ in range(60):
        action = env.action_space.sample()
        seen, expected = other.step(action), env.step(action)
        assert np.array_equal(seen[0], expected[0])
        assert seen[1:] == expected[1:]
        if expected[2] or expected[3]:
            assert np.array_equal(other.reset()[0], env.reset()[0])


@pytest.mark.parametrize("kind", [DrivingSimulator, lambda **given: DrivingSimulatorVector(2, **given)])
def test_a_state_can_be_gone_back_to(kind):
    env, other = kind(episode=SHORT), kind(episode=SHORT)
    env.reset(seed=1)
    action = np.full(env.action_space.shape, 0.2, dtype=np.float32)
    for _ in range(10):
        env.step(action)
    state = env.get_state()
    first = [env.step(action)[0] for _ in range(60)]
    other.set_state(state)
    assert all(np.array_equal(other.step(action)[0], seen) for seen in first)
    env.set_state(state)
    assert all(np.array_equal(env.step(action)[0], seen) for seen in first)


def test_an_unknown_option_of_reset_is_refused():
    with pytest.raises(ConfigurationError, match=r"reset: unknown option 'foo'\. Known: drive\."):
        DrivingSimulator(episode=SHORT).reset(options={"foo": 1})
    with pytest.raises(ConfigurationError, match=r"reset: unknown option 'mask'\. Did you mean reset_mask"):
        DrivingSimulatorVector(2, episode=SHORT).reset(options={"mask": 1})


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_an_unknown_argument_is_a_type_error_as_libraries_expect_that_try_some_out(make):
    with pytest.raises(TypeError, match="got an unexpected keyword argument 'frameskip'"):
        make(ID, frameskip=1)
    with pytest.raises(ConfigurationError, match=r"argument 'rendermode'\. Did you mean render_mode"):
        make(ID, rendermode="human")


def test_a_batch_answers_for_each_of_its_environments():
    envs = DrivingSimulatorVector(2, episode=SHORT)
    assert envs.get_attr("task") == (envs.task, envs.task)
    scale = DrivingSimulator(episode=SHORT).scale
    assert [one.tolist() for one in envs.call("scale")] == [scale.tolist()] * 2
    assert envs.call("action_of", scale)[1].tolist() == [1.0] * 9
    with pytest.raises(ConfigurationError, match=r"use reset\(\) of the vector environment"):
        envs.call("reset")


def test_a_platform_can_be_a_file(tmp_path):
    save(get_platform("nads-1"), tmp_path / "mine.yaml")
    task = TaskOptions(platform=str(tmp_path / "mine.yaml"))
    assert task.platform == get_platform("nads-1")
    assert from_dict(TaskOptions, to_dict(task)) == task
    with pytest.raises(ConfigurationError, match=r"'platform': .*other\.yaml: cannot be read"):
        TaskOptions(platform=str(tmp_path / "other.yaml"))


def test_the_version_is_that_of_the_distribution():
    assert motion_cueing.envs.__version__ == importlib.metadata.version("motion-cueing-gym")


def test_drive_can_be_chosen_by_index_and_by_name():
    env = DrivingSimulator(drives=[drive("a"), drive("b"), drive("c")])
    assert env.reset(seed=0, options={"drive": "b"})[1]["drive"] == 1
    assert env.reset(options={"drive": 2})[1]["drive"] == 2
    with pytest.raises(UnknownNameError, match="unknown drive 'd'"):
        env.reset(options={"drive": "d"})
    with pytest.raises(UnknownNameError, match="unknown drive '3'"):
        env.reset(options={"drive": 3})
    envs = DrivingSimulatorVector(2, drives=[drive("a"), drive("b")])
    assert list(envs.reset(seed=0, options={"drive": ["b", "a"]})[1]["drive"]) == [1, 0]


@pytest.mark.parametrize(
    "action", [np.full(9, np.nan), np.full(9, np.inf), np.zeros(8), np.zeros((2, 9)), np.float64(0.0)]
)
def test_action_that_is_not_nine_finite_numbers_is_refused_and_nothing_moves(action):
    env = DrivingSimulator(episode=SHORT)
    env.reset(seed=0)
    before = env.batch.simulator.state.copy()
    with pytest.raises(ActionError, match=r"shape|finite"):
        env.step(action)
    assert np.array_equal(env.batch.simulator.state, before)


def test_action_outside_the_box_is_clipped_and_counted():
    def step(action):
        env = DrivingSimulator(episode=SHORT)
        env.reset(seed=0)
        return env.step(np.array(action, dtype=np.float32))

    wild = step([2.0, -3.0, 1.0, -1.0, 0.5, 0.0, 0.0, 0.0, 1.5])
    tame = step([1.0, -1.0, 1.0, -1.0, 0.5, 0.0, 0.0, 0.0, 1.0])
    assert wild[4].pop("clipped") == 3
    assert tame[4].pop("clipped") == 0
    assert np.array_equal(wild[0], tame[0])
    assert wild[1:] == tame[1:]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"reward": {"weigths": {}}}, "unknown field 'reward.weigths'. Did you mean weights"),
        ({"platform": "papr"}, "unknown platform 'papr'. Did you mean paper"),
        ({"episode": {"drives": ["brakin"]}}, "unknown drive 'brakin'. Did you mean braking"),
        ({"episode": {"random_start": True}}, "random_start needs a duration"),
        ({"action": {"authority": 1.5}}, "action.authority"),
        ({"action": {"frozen": ["turntabel"]}}, "unknown axis 'turntabel'. Did you mean turntable"),
        ({"action": {"mode": "residual"}}, "'residual' needs base="),
        ({"action": {"mode": "gains"}}, "'gains' needs base="),
        ({"base": object()}, "base= is of no use"),
        ({"randomization": {"dead_time": [0.2, 0.1]}}, "dead_time must be a range"),
        ({"render_mode": "ansi"}, "render_mode 'ansi' is none of"),
        ({"vestibular": "nobody"}, "unknown vestibular model"),
    ],
)
def test_wrong_options_are_named(wrong, message):
    with pytest.raises(ConfigurationError, match=message.replace(".", r"\.")):
        DrivingSimulator(**wrong)


def test_options_are_those_of_the_task_with_fields_replaced():
    task = TaskOptions(platform="nads-1", episode=SHORT)
    env = DrivingSimulator(task, observation={"preview": 2})
    assert env.task.platform == "nads-1"
    assert env.task.observation.preview == 2
    assert env.task.episode == SHORT
