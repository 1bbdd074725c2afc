"""The Stable-Baselines3 environment's pictures: its own checks, its recorder, its window."""

from __future__ import annotations

import warnings

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import VecVideoRecorder

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.task import DrivingSimulator
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

from ..envs.task.tasks import SHORT, drive

pytestmark = pytest.mark.slow

SIZE = (480, 270)
PUSH = np.full(9, 0.4, dtype=np.float32)


def batch(mode: str | None) -> DrivingSimulatorVecEnv:
    return DrivingSimulatorVecEnv(
        2, drives=[drive(samples=31)], render_mode=mode, render_size=None if mode is None else SIZE
    )


@pytest.mark.parametrize("mode", ["human", "rgb_array"])
def test_stable_baselines_checker_finds_nothing_to_warn_of_in_pictures(mode):
    env = DrivingSimulator(episode=SHORT, render_mode=mode)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=False)


def test_frames_are_those_of_single_environments_side_by_side():
    envs, alone = batch("rgb_array"), DrivingSimulator(
        drives=[drive(samples=31)], render_mode="rgb_array", render_size=SIZE
    )  # fmt: skip
    envs.seed(5)
    envs.reset()
    alone.reset(seed=5)
    for _ in range(12):
        envs.step(np.stack([PUSH, -PUSH]))
        alone.step(PUSH)
    first, second = envs.get_images()
    np.testing.assert_array_equal(first, alone.render())
    np.testing.assert_array_equal(envs.render(), np.concatenate([first, second]))
    assert not np.array_equal(first, second)


def test_stable_baselines_recorder_makes_an_mp4(tmp_path):
    envs = VecVideoRecorder(batch("rgb_array"), str(tmp_path), lambda step: step == 0, 40)
    envs.reset()
    for _ in range(45):  # over the end of an episode
        envs.step(np.stack([PUSH, -PUSH]))
    envs.close()
    (file,) = tmp_path.glob("*.mp4")
    reader = imageio_ffmpeg.read_frames(str(file))
    about = next(reader)
    frames = [np.frombuffer(data, dtype=np.uint8) for data in reader]
    assert about["size"] == (SIZE[0], 2 * SIZE[1])
    assert about["fps"] == pytest.approx(100.0)
    assert len(frames) == 41
    assert np.sum(np.abs(frames[27].astype(int) - frames[0]) > 40) > 1000


def test_window_is_opened_and_closed():
    envs = batch("human")
    envs.reset()
    for _ in range(4):
        envs.step(np.stack([PUSH, -PUSH]))
    assert envs.render() is None
    assert pygame.display.get_surface().get_size() == SIZE
    assert envs.get_images() == [None, None]
    envs.close()
    assert not pygame.display.get_init()


def test_without_a_render_mode_there_are_no_frames():
    envs = batch(None)
    envs.reset()
    assert envs.get_images() == [None, None]
    with pytest.warns(UserWarning, match="no `render_mode` was passed"):
        assert envs.render() is None
    envs.close()


def test_a_wrong_mode_is_refused():
    with pytest.raises(ConfigurationError, match="render_mode 'ansi' is none of"):
        batch("ansi")
