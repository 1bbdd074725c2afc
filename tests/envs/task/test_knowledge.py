"""Rows of controls and road: what they mean, and that they are refused where they are not known."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import motion_cueing.envs  # noqa: F401  (registers the environments)
from motion_cueing.envs.cues import GRAVITY, CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import get_maneuver, get_recording, random_drives
from motion_cueing.envs.road import RoadMap, Route
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.kernels.observation import ObservationOptions
from motion_cueing.envs.task.knowledge import KnownRows, MapErrors, controls_of, known_of
from motion_cueing.envs.task.options import EpisodeOptions, TaskOptions

TIMES = (0.5, 1.0, 2.0)
ALL = ObservationOptions(controls=True, road=TIMES)


def steady(speed=20.0, curvature=0.01, wheel=0.3, samples=400):
    """A drive round a circle with a wheel that does not move."""
    time = 0.01 * np.arange(samples)
    force = np.tile([0.0, speed**2 * curvature, -GRAVITY], (samples, 1))
    rate = np.tile([0.0, 0.0, speed * curvature], (samples, 1))
    channels = {
        "steering_wheel_rad": np.full(samples, wheel),
        "throttle": np.full(samples, 0.2),
        "brake": np.zeros(samples),
        "speed_m_s": np.full(samples, speed),
        "lateral_speed_m_s": np.full(samples, -0.4),
    }
    path = np.full(2000, curvature)
    route = Route.of_road(path, 25.0)
    road = RoadMap.of_route(route, 0.0 * path + 0.05, None, speed * time, channels["speed_m_s"])
    return CueTrace("circle", time, force, rate, channels=channels, road=road)


def seen(drive, options=ALL, errors=None):
    """Rows of a drive by name, in SI units."""
    task = TaskOptions(observation=options, episode=EpisodeOptions())
    if errors is not None:
        task = replace(task, randomization=replace(task.randomization, road=errors))
    batch = Batch(1, task, drives=[drive])
    everywhere = np.ones(1, dtype=bool)
    batch.seed(everywhere, [0])
    batch.begin(everywhere)
    batch.observe(everywhere)
    for _ in range(10):
        batch.write(np.zeros((1, batch.action_size)))
        batch.step()
    values = batch.arrays.observation.pull()[0]
    rows = {row.name: row for row in batch.layout.rows}
    return {name: values[where] * rows[name].scale for name, where in batch.layout.slices.items()}, batch


def test_rows_of_a_steady_turn():
    rows, _ = seen(steady())
    nominal = 0.3 / (16.0 * 2.75 * (1.0 + (20.0 / 25.0) ** 2))
    assert rows["steering_wheel"] == pytest.approx(0.3)
    assert rows["steering_wheel_rate"] == pytest.approx(0.0, abs=1e-6)
    assert rows["steered_yaw_rate"] == pytest.approx(20.0 * nominal, rel=1e-5)
    assert rows["steered_force"] == pytest.approx(400.0 * nominal, rel=1e-5)
    assert rows["pedals"] == pytest.approx([0.2, 0.0])
    assert rows["slip_angle"] == pytest.approx(np.arctan2(-0.4, 20.0), rel=1e-5)
    assert rows["speed"] == pytest.approx(20.0)
    assert rows["standing"] == pytest.approx(0.0)
    force = 400.0 * 0.01
    assert rows["road_force"] == pytest.approx([force / np.hypot(1.0, force / 6.0)] * 3, rel=1e-5)
    assert rows["road_curvature"] == pytest.approx([0.01] * 3)
    assert rows["road_grade"] == pytest.approx([0.05] * 3)
    assert rows["road_speed"] == pytest.approx([5.0] * 3)
    # From 20 m/s to sqrt(3 / 0.01) within the 10 m to the first place.
    assert rows["road_braking"] == pytest.approx([0.0, (400.0 - 300.0) / 20.0, 0.0], rel=1e-5)
    assert rows["road_known"] == 1.0
    assert rows["controls_known"] == 1.0


def test_a_turning_wheel_has_a_rate():
    drive = steady()
    ramp = 2.0 * drive.time
    rows = KnownRows(ALL)
    controls = controls_of(drive)._replace(wheel=ramp)
    values, _ = rows(controls, None, np.zeros(len(drive), dtype=bool))
    # Column 1; after many time constants the rate of a ramp is its slope.
    assert values[-1, 1] == pytest.approx(2.0, rel=0.06)


def test_rows_sample_by_sample_are_those_of_the_whole_drive():
    drive = random_drives(1, 20.0, 4)[0]
    rows, controls = KnownRows(ALL), controls_of(drive)
    ahead = drive.road.ahead(rows.distances(controls.speed))
    whole, _ = rows(controls, ahead, drive.road.known)
    state, one_by_one = None, []
    for k in range(300):
        here = slice(k, k + 1)
        part, state = rows(
            type(controls)(*(column[here] for column in controls)),
            type(ahead)(*(column[here] for column in ahead)),
            drive.road.known[here],
            state,
        )
        one_by_one.append(part[0])
    np.testing.assert_allclose(one_by_one, whole[:300], atol=1e-9)


def test_a_drive_without_what_is_seen_is_refused_in_one_sentence():
    recording = get_recording("commute")
    with pytest.raises(ConfigurationError, match="commute: the drive has no channel steering_wheel_rad, thr"):
        seen(recording)
    with pytest.raises(ConfigurationError, match="has no road"):
        seen(replace(get_maneuver("hill").drive(), road=None))
    nothing = replace(recording, channels={})
    with pytest.raises(ConfigurationError, match="has no channel speed_m_s"):
        seen(nothing, replace(ALL, allow_missing=True))


def test_what_is_missing_is_zero_and_said_so():
    rows, _ = seen(get_recording("commute"), replace(ALL, allow_missing=True))
    assert rows["controls_known"] == 0.0
    assert rows["road_known"] == 1.0
    assert not rows["pedals"].any()
    assert rows["speed"] > 5.0
    rows, _ = seen(replace(steady(), road=None), replace(ALL, allow_missing=True))
    assert rows["road_known"] == 0.0
    assert not rows["road_speed"].any()


def test_errors_are_drawn_for_each_drive_and_are_the_same_again():
    drives = [steady() for _ in range(20)]
    errors = MapErrors(scale=(0.8, 1.2), shift=5.0, missing=0.5, without_controls=0.5)
    rows = known_of(drives, ALL, errors, 3).reshape(20, 400, -1)
    np.testing.assert_array_equal(rows, known_of(drives, ALL, errors, 3).reshape(20, 400, -1))
    true = known_of(drives[:1], ALL, MapErrors(), 3)
    first, names = len(true[0]) - 5 - 3 * 5, slice(0, 10)
    curvature = rows[:, :, first + 3] / true[0, first + 3]
    known = rows[:, :, -1] == 1.0
    assert 0.8 <= curvature[known].min() < 0.85
    assert 1.15 < curvature[known].max() <= 1.2
    assert 0.05 < 1.0 - known.mean() < 0.5
    assert not rows[~known][:, first:].any()
    blind = ~rows[:, 0, 9].astype(bool)
    assert 3 <= blind.sum() <= 17
    assert not rows[blind][:, :, names].any()


def test_the_gymnasium_environment_offers_the_rows():
    env = gymnasium.make(
        "motion_cueing/DrivingSimulator-v0",
        drives=[steady()],
        task=TaskOptions(observation=ObservationOptions(controls=True, road=(0.5, 1.0))),
    )
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    plain = gymnasium.make("motion_cueing/DrivingSimulator-v0", drives=[steady()])
    # 10 of the controls, 2 of the speed, 5 for each time ahead and 5 for the road as a whole.
    assert env.observation_space.shape[0] - plain.observation_space.shape[0] == 10 + 2 + 5 * 2 + 5
