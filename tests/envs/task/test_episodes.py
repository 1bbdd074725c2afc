"""Where episodes begin and end, in which drive, on which machine."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import RandomDrives, drive_seeds, get_maneuver, get_recording, random_drive
from motion_cueing.envs.platform import get_platform, platform_names
from motion_cueing.envs.platform.kinematics import legs_of_pose
from motion_cueing.envs.task import (
    DrivingSimulator,
    DrivingSimulatorVector,
    EpisodeOptions,
    RandomizationOptions,
)
from motion_cueing.envs.task.episode import draw, key_of, library_of, pose_scale, start_poses, uniform, words

from .tasks import drive


def length_of(env: DrivingSimulator) -> int:
    steps, truncated = 0, False
    while not truncated:
        *_, truncated, _ = env.step(np.zeros(9))
        steps += 1
    return steps


def test_episode_is_the_whole_drive_from_its_first_cue_to_its_last():
    cues = drive(samples=101)
    env = DrivingSimulator(drives=[cues])
    env.reset(seed=0)
    assert length_of(env) == 100
    assert np.array_equal(env.batch.simulator.state["reference_cue"]["force"][0], cues.specific_force[-1])


def test_random_start_is_anywhere_that_leaves_the_duration():
    episode = EpisodeOptions(duration=0.5, random_start=True)
    env = DrivingSimulator(drives=[drive(samples=81)], episode=episode)
    starts = []
    for k in range(200):
        starts.append(round(env.reset(seed=0 if k == 0 else None)[1]["time"] * 100))
        if k < 5:
            assert length_of(env) == 50
    assert set(starts) == set(range(31))


def test_duration_longer_than_the_drive_is_the_drive():
    env = DrivingSimulator(
        drives=[drive(samples=51)], episode=EpisodeOptions(duration=9.0, random_start=True)
    )
    assert env.reset(seed=0)[1]["time"] == 0.0
    assert length_of(env) == 50


def test_named_drives_are_the_packages_own():
    env = DrivingSimulator(episode=EpisodeOptions(drives=("braking", "commute")))
    for cues, expected in zip(
        env.batch.drives, (get_maneuver("braking").drive(), get_recording("commute")), strict=True
    ):
        assert cues.name == expected.name
        assert np.array_equal(cues.specific_force, expected.specific_force)
    assert {env.reset()[1]["drive"] for _ in range(30)} == {0, 1}


def test_random_drives_are_those_of_their_seeds():
    env = DrivingSimulator(episode=EpisodeOptions(library=3, drive_duration=2.0, library_seed=5))
    for cues, seed in zip(env.batch.drives, drive_seeds(3, 5), strict=True):
        assert np.array_equal(cues.specific_force, random_drive(seed, 2.0).specific_force)


def test_every_car_drives_every_maneuver_and_friction_changes_the_drive():
    episode = EpisodeOptions(drives=("step-steer",), random=RandomDrives(cars=("sedan", "volvo-v40")))
    grip = DrivingSimulator(episode=episode).batch.drives
    slip = DrivingSimulator(episode=episode, randomization={"friction": (0.6, 0.7)}).batch.drives
    assert [cues.source.split(",")[0] for cues in grip] == ["sedan", "volvo-v40"]
    for a, b in zip(grip, slip, strict=True):
        assert np.abs(a.specific_force - b.specific_force).max() > 1e-3


@pytest.mark.parametrize(
    ("episode", "friction", "message"),
    [
        ({"drives": ["slalom"]}, 0.6, r"friction 0\.\d\d came \d+\.\d m off the path of slalom"),
        ({"library": 40, "drive_duration": 30.0}, 0.25, "m off the path of .*-.*: raise randomization"),
    ],
)
def test_car_that_leaves_its_path_is_refused(episode, friction, message):
    arguments = {"episode": episode, "randomization": {"friction": (friction, friction)}}
    with pytest.raises(ConfigurationError, match=message):
        DrivingSimulator(**arguments)


def test_a_random_drive_whose_car_leaves_its_path_is_drawn_anew():
    """Of these sixteen, the sixth came 5.7 m off its path."""
    cones = RandomDrives(urban=0, rural=0, highway=0, cones=1, cars=("volvo-v40",))
    episode = EpisodeOptions(library=16, library_seed=1, drive_duration=40.0, random=cones)
    seeds = drive_seeds(16, 1)
    first = [random_drive(seed, 40.0, drives=cones) for seed in seeds]
    drives = library_of(episode, RandomizationOptions())
    same = [np.array_equal(a.specific_force, b.specific_force) for a, b in zip(drives, first, strict=True)]
    assert [k for k, equal in enumerate(same) if not equal] == [5]
    assert max(np.abs(cues.channels["path_offset_m"]).max() for cues in drives) < 1.0
    again = random_drive(drive_seeds(8 * 16, 1)[16 + 5], 40.0, drives=cones)
    assert np.array_equal(drives[5].specific_force, again.specific_force)


def test_open_loop_steering_has_no_path_to_leave():
    drives = DrivingSimulator(episode={"drives": ["step-steer"]}).batch.drives
    assert np.abs(drives[0].channels["path_offset_m"]).max() > 1.0


def test_recording_too_slow_is_resampled():
    env = DrivingSimulator(drives=[drive(samples=21, dt=0.05)])
    assert env.batch.drives[0].dt == pytest.approx(0.01)
    assert len(env.batch.drives[0]) == 101


def test_drives_and_machines_are_drawn_evenly():
    env = DrivingSimulatorVector(
        600,
        drives=[drive(str(k), samples=3) for k in range(3)],
        randomization=RandomizationOptions(natural_frequency=(10.0, 50.0), platforms=2),
    )
    env.reset(seed=0)
    # Six sigma of a binomial count.
    assert np.all(np.abs(np.bincount(env.batch.simulator.drive_of) - 200) < 6 * np.sqrt(600 * 2 / 9))
    assert np.all(np.abs(np.bincount(env.batch.simulator.platform_of) - 300) < 6 * np.sqrt(600 / 4))


def test_machines_have_drawn_lags_and_dead_times_within_their_ranges():
    ranges = RandomizationOptions(natural_frequency=(20.0, 40.0), dead_time=(0.01, 0.05), platforms=5)
    platforms = DrivingSimulator(drives=[drive()], randomization=ranges).batch.simulator.platforms
    frequencies = [p.hexapod.dynamics.natural_frequency for p in platforms]
    delays = [p.carriage.dynamics.dead_time for p in platforms]
    assert len(set(frequencies)) == len(set(delays)) == 5
    assert all(20.0 <= value <= 40.0 for value in frequencies)
    assert all(0.01 <= value <= 0.05 for value in delays)


@pytest.mark.parametrize("name", platform_names())
def test_start_poses_lie_within_their_share_of_the_travel(name):
    platform = get_platform(name)
    keys = np.array([key_of(seed) for seed in range(300)], dtype=np.uint64)
    poses = start_poses(draw(keys, np.zeros(300, dtype=np.int64)), pose_scale(platform), 0.9)
    least, most = platform.hexapod.extension
    for pose in poses:
        legs = np.array(legs_of_pose(platform.hexapod, pose[2:8]))
        assert np.abs(legs).max() <= 0.9 * min(-least, most) + 1e-9
    if platform.carriage is None:
        assert not poses[:, :2].any()
    else:
        limit = 0.9 * platform.carriage.travel_x[1]
        assert 0.9 * limit < np.abs(poses[:, 0]).max() <= limit
    if platform.turntable is None:
        assert not poses[:, 8].any()


def test_offset_machine_begins_where_it_was_put():
    env = DrivingSimulator(drives=[drive()], episode=EpisodeOptions(platform_offset=0.5))
    env.reset(seed=3)
    state = env.batch.simulator.state[0]
    assert 0.0 < np.abs(state["motion"]["position"][:2]).max() <= 0.5 * 13.72
    assert not state["motion"]["rate"].any()


def test_numbers_drawn_are_uniform_and_uncorrelated_between_neighbors():
    keys = np.array([key_of(seed) for seed in range(2000)], dtype=np.uint64)
    first, second = (uniform(words(keys, np.full(2000, e), 8)) for e in (0, 1))
    assert first.min() >= 0.0
    assert first.max() < 1.0
    for values in (first, second):
        counts = np.bincount((10 * values).astype(int).ravel(), minlength=10)
        assert np.sum((counts - 1600.0) ** 2 / 1600.0) < 33.7  # 0.9999 quantile of chi-square, 9 degrees
    for a, b in ((first, second), (first[1:], first[:-1]), (first[:, 1:], first[:, :-1])):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 5.0 / np.sqrt(a.size)
