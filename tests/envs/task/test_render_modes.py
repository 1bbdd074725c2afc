"""``render_mode``: frames of what is simulated, films by Gymnasium, a window that can be closed."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import RecordVideo
from gymnasium.wrappers.vector import RecordVideo as RecordVideoOfBatch

import motion_cueing.envs
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.rendering import CueHistory, Renderer, append_state, motion_of
from motion_cueing.envs.task import DrivingSimulator, DrivingSimulatorVector

from .tasks import SHORT, drive

pytestmark = pytest.mark.slow

ID = motion_cueing.envs.ENVIRONMENT_ID
SIZE = (480, 270)
PUSH = np.full(9, 0.4, dtype=np.float32)
"""An action that moves everything."""
LENGTH = 41
"""Samples of an episode."""


def single(mode: str | None = "rgb_array", **more: Any) -> DrivingSimulator:
    return DrivingSimulator(
        **{"render_mode": mode, "render_size": SIZE, "drives": [drive(samples=LENGTH)]} | more
    )


def film(path: Path) -> tuple[dict[str, Any], list[np.ndarray]]:
    """What an mp4 says of itself, and its frames."""
    reader = imageio_ffmpeg.read_frames(str(path))
    about = next(reader)
    width, height = about["size"]
    return about, [np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3) for data in reader]


def difference(a: np.ndarray, b: np.ndarray) -> int:
    """Pixels that differ by more than a codec's noise."""
    return int(np.sum(np.abs(a.astype(int) - b).max(axis=-1) > 40))


def test_a_frame_is_that_of_the_renderer():
    env = single()
    env.reset(seed=0)
    simulator, history = env.batch.simulator, CueHistory("weave", "agent", 0.01)
    append_state(history, 0.0, simulator.state[0])
    for k in range(1, 31):
        env.step(0.3 * PUSH)
        append_state(history, 0.01 * k, simulator.state[0])
    expected = Renderer(env.batch.platform, SIZE).frame(motion_of(simulator.state[0]), history)
    np.testing.assert_array_equal(env.render(), expected)


def test_frames_are_of_the_size_asked_for():
    env = single(render_size=None)
    env.reset(seed=0)
    assert env.render().shape == (540, 960, 3)
    assert env.render().dtype == np.uint8


def test_a_frame_is_good_for_three_steps_and_no_longer():
    env = single()
    env.reset(seed=0)
    frames = [env.render()]
    for _ in range(6):
        env.step(PUSH)
        frames.append(env.render())
    distinct = [frames[0], frames[3], frames[6]]
    for k, frame in enumerate(frames):
        assert frame is distinct[k // 3]
    assert not np.array_equal(distinct[0], distinct[1])
    assert not np.array_equal(distinct[1], distinct[2])
    with pytest.raises(ValueError, match="read-only"):
        frames[0][0, 0] = 0


def test_a_new_episode_is_drawn_at_once_and_from_its_beginning():
    env = single()
    env.reset(seed=0)
    first = env.render()
    for _ in range(4):
        env.step(PUSH)
    env.render()
    env.reset()
    np.testing.assert_array_equal(env.render(), first)


def test_steps_beyond_the_end_are_drawn_as_the_end():
    env = single()
    env.reset(seed=0)
    for _ in range(LENGTH + 5):
        env.step(0.0 * PUSH)
    assert env.render().any()


def test_looking_changes_nothing():
    def episode(mode: str | None) -> bytes:
        env = single(mode, render_size=None if mode is None else SIZE)
        seen = [env.reset(seed=3)[0]]
        for _ in range(20):
            observation, reward, *_ = env.step(PUSH)
            seen += [observation, np.float64(reward)]
            if mode == "rgb_array":
                env.render()
        env.close()
        return b"".join(part.tobytes() for part in seen)

    assert episode(None) == episode("rgb_array") == episode("human")


@pytest.mark.parametrize(("repeat", "rate"), [(1, 100.0), (2, 50.0), (3, 100.0 / 3.0), (8, 12.5)])
def test_one_frame_a_step_is_true_speed(repeat, rate):
    arguments = {"action": {"repeat": repeat}, "episode": SHORT}
    assert gymnasium.make(ID, **arguments).metadata["render_fps"] == pytest.approx(rate)
    assert gymnasium.make_vec(ID, 2, **arguments).metadata["render_fps"] == pytest.approx(rate)
    assert DrivingSimulator.metadata["render_fps"] == DrivingSimulatorVector.metadata["render_fps"] == 100.0


def test_gymnasiums_recorder_makes_an_mp4_of_an_episode(tmp_path):
    env = gymnasium.make(ID, render_mode="rgb_array", render_size=SIZE, drives=[drive(samples=LENGTH)])
    env = RecordVideo(env, str(tmp_path / "films"), episode_trigger=lambda episode: episode == 0)
    env.reset(seed=0)
    truncated = False
    while not truncated:
        *_, truncated, _ = env.step(PUSH)
    last = env.render()
    env.close()
    (file,) = (tmp_path / "films").glob("*.mp4")
    about, frames = film(file)
    assert about["size"] == SIZE
    assert about["fps"] == pytest.approx(100.0)
    assert len(frames) == LENGTH
    assert difference(frames[0], frames[-1]) > 1000
    assert difference(frames[-1], last) < 0.1 * difference(frames[0], last)


def test_gymnasiums_recorder_makes_an_mp4_of_a_batch(tmp_path):
    envs = gymnasium.make_vec(
        ID, num_envs=2, render_mode="rgb_array", render_size=SIZE, drives=[drive(samples=LENGTH)]
    )
    first = {"video_length": 10, "step_trigger": lambda step: step == 0}
    envs = RecordVideoOfBatch(envs, str(tmp_path / "films"), **first)
    envs.reset(seed=0)
    for _ in range(15):
        envs.step(np.stack([PUSH, -PUSH]))
    envs.close()
    (file,) = (tmp_path / "films").glob("*.mp4")
    about, frames = film(file)
    assert about["size"] == (2 * SIZE[0], SIZE[1])
    assert difference(frames[0], frames[-1]) > 1000
    assert difference(*np.split(frames[-1], 2, axis=1)) > 1000


@pytest.mark.parametrize("autoreset_mode", list(AutoresetMode))
def test_frames_of_a_batch_are_those_of_single_environments(autoreset_mode):
    drives = [drive("a", LENGTH), drive("b", 21)]
    envs = DrivingSimulatorVector(
        2, drives=drives, autoreset_mode=autoreset_mode, render_mode="rgb_array", render_size=SIZE
    )
    loop = [single(drives=drives), single(drives=drives)]
    for i, env in enumerate(loop):
        env.reset(seed=i, options={"drive": i})
    envs.reset(seed=0, options={"drive": [0, 1]})
    ended = np.zeros(2, dtype=bool)
    # All autoreset modes agree until the first end; afterwards b waits, begins anew, or begins anew at once.
    for k in range(20):
        *_, truncated, _ = envs.step(np.stack([PUSH, -PUSH]))
        for env, action in zip(loop, (PUSH, -PUSH), strict=True):
            env.step(action)
        ended |= truncated
        if k in (0, 9, 18):
            for frame, env in zip(envs.render(), loop, strict=True):
                np.testing.assert_array_equal(frame, env.render())
    assert list(ended) == [False, True]
    envs.step(np.stack([PUSH, -PUSH]))
    loop[0].step(PUSH)
    frames = envs.render()
    np.testing.assert_array_equal(frames[0], loop[0].render())
    names = [view.cues.maneuver for view in envs._pictures._views]
    where = [drives[i].name for i in envs.batch.simulator.drive_of]
    assert names == where


def test_make_imports_the_package_by_itself_and_without_a_render_mode_draws_nothing_and_needs_no_pygame():
    code = (
        "import gymnasium, sys, warnings\n"
        f"e = gymnasium.make('motion_cueing.envs:{ID}', episode=dict(library=1, drive_duration=1.0))\n"
        "e.reset(seed=0); e.step(e.action_space.sample())\n"
        "with warnings.catch_warnings(record=True) as told:\n"
        "    warnings.simplefilter('always')\n"
        "    assert e.unwrapped.render() is None\n"
        "print(type(e.unwrapped).__name__, 'give render_mode' in str(told[0].message))\n"
        "print([m for m in ('pygame', 'torch', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-2:] == ["DrivingSimulator True", "[]"]


def test_without_pygame_the_extra_is_named():
    code = (
        "import sys; sys.modules['pygame'] = None\n"
        "from motion_cueing.envs.task import DrivingSimulator\n"
        "episode = dict(library=1, drive_duration=1.0)\n"
        "DrivingSimulator(episode=episode).reset(seed=0)\n"
        "try: DrivingSimulator(episode=episode, render_mode='rgb_array')\n"
        "except ImportError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "rendering needs pygame-ce: pip install 'motion-cueing-gym[render]'" in done.stdout


@pytest.mark.parametrize("kind", [DrivingSimulator, DrivingSimulatorVector])
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"render_mode": "ansi"}, "render_mode 'ansi' is none of human, rgb_array"),
        ({"render_mode": "rgb_array", "render_size": (64, 36)}, "size must be at least"),
        ({"render_size": SIZE}, "render_size is of no use without a render_mode"),
    ],
)
def test_wrong_ways_of_looking_are_named(kind, wrong, message):
    with pytest.raises(ConfigurationError, match=message):
        kind(episode=SHORT, **wrong)


def test_a_pickled_environment_draws_the_same():
    env = single()
    copy = pickle.loads(pickle.dumps(env))
    for each in (env, copy):
        each.reset(seed=1)
        each.step(PUSH)
    np.testing.assert_array_equal(copy.render(), env.render())


class TestWindow:
    """The mode "human"."""

    @pytest.fixture
    def shown(self, monkeypatch) -> list[tuple[np.ndarray, float]]:
        """Frames that come to a window, with the rate they are shown at; shown without waiting."""
        seen: list[tuple[np.ndarray, float]] = []
        show = Renderer.show

        def noted(self: Renderer, frame: np.ndarray, rate: float) -> None:
            seen.append((frame, rate))
            show(self, frame, 1e6)

        monkeypatch.setattr(Renderer, "show", noted)
        return seen

    def test_steps_show_themselves_at_the_pace_of_the_drive(self, shown):
        env = single("human")
        env.reset(seed=0)
        for _ in range(30):
            env.step(PUSH)
        assert env.render() is None
        assert pygame.display.get_surface().get_size() == SIZE
        assert len(shown) == 11  # the beginning, and each third step
        assert [rate for _, rate in shown] == pytest.approx([100.0 / 3.0] * 11)
        assert not np.array_equal(shown[0][0], shown[-1][0])
        env.close()
        assert not pygame.display.get_init()

    def test_a_batch_shows_its_first_environment(self, shown):
        envs = DrivingSimulatorVector(
            3, drives=[drive(samples=LENGTH)], render_mode="human", render_size=SIZE
        )
        alone = single()
        envs.reset(seed=0)
        alone.reset(seed=0)
        for _ in range(3):
            envs.step(np.stack([PUSH, -PUSH, 0.0 * PUSH]))
            alone.step(PUSH)
        assert envs.render() is None
        np.testing.assert_array_equal(shown[-1][0], alone.render())
        envs.close()
        assert not pygame.display.get_init()

    def test_a_window_that_the_user_closes_stays_closed_and_the_episode_goes_on(self, shown):
        env = single("human")
        env.reset(seed=0)
        pygame.event.post(pygame.event.Event(pygame.QUIT))
        steps, truncated = 0, False
        while not truncated:
            *_, truncated, _ = env.step(PUSH)
            steps += 1
        assert steps == LENGTH - 1
        assert len(shown) == 2  # the beginning, and the frame that met the click
        assert not pygame.display.get_init()
        env.reset()
        env.step(PUSH)
        assert env.render() is None
        assert len(shown) == 2
        env.close()
        env.close()


def test_each_environment_shows_its_own_machine():
    builds = {"platforms": 2, "platform": {"size": (0.4, 1.0), "without_carriage": 0.5}}
    looks = {"render_mode": "rgb_array", "render_size": SIZE, "drives": [drive(samples=LENGTH)]}
    envs = DrivingSimulatorVector(4, randomization=builds, **looks)
    envs.reset(seed=0)
    frames, simulator = envs.render(), envs.batch.simulator
    assert set(simulator.platform_of.tolist()) == {0, 1}
    for i, which in enumerate(simulator.platform_of.tolist()):
        alone = single(platform=simulator.platforms[which])
        alone.reset(seed=i)
        np.testing.assert_array_equal(frames[i], alone.render())
