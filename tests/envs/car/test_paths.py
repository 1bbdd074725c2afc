"""Paths and schedules against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import fresnel

from motion_cueing.envs.car.plans import DT, STEP, Change, Hold, Path, Schedule, bend, clothoids, smooth_steps
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.maneuvers.roads import Style, along_path, speed_limit


@given(st.floats(-0.08, 0.08))
def test_constant_curvature_is_a_circle(curvature):
    path = Path.of_curvature(np.full(400, curvature))
    s = STEP * np.arange(400)
    x = s if abs(curvature) < 1e-9 else np.sin(curvature * s) / curvature
    y = 0.5 * curvature * s**2 if abs(curvature) < 1e-9 else (1.0 - np.cos(curvature * s)) / curvature
    np.testing.assert_allclose(path.x, x, atol=1e-6)
    np.testing.assert_allclose(path.y, y, atol=1e-6)


def test_clothoid_is_the_fresnel_integral():
    length, top = 60.0, 0.02
    path = Path.of_curvature(clothoids([(0.0, 0.0), (length, top)], length))
    scale = np.sqrt(np.pi * length / top)
    s, c = fresnel(STEP * np.arange(len(path)) / scale)
    np.testing.assert_allclose(path.x, scale * c, atol=5e-4)
    np.testing.assert_allclose(path.y, scale * s, atol=5e-4)


@given(st.floats(8.0, 500.0), st.floats(0.05, 4.0), st.floats(5.0, 60.0), st.booleans())
def test_bend_turns_by_its_angle(radius, angle, transition, left):
    curvature = bend((-1.0 if left else 1.0) / radius, angle, transition)
    heading = Path.of_curvature(np.concatenate((np.zeros(2), curvature, np.zeros(2)))).heading
    assert heading[-1] == pytest.approx(-angle if left else angle, rel=1e-9)
    assert np.abs(curvature).max() < 1.25 / radius


def test_path_through_offsets_has_their_curvature():
    x = np.linspace(0.0, 200.0, 401)
    path = Path.of_offset(x, 2.0 * np.sin(x / 20.0))
    slope, second = 0.1 * np.cos(path.x / 20.0), -0.005 * np.sin(path.x / 20.0)
    inner = slice(10, -10)
    np.testing.assert_allclose(path.curvature[inner], (second / (1.0 + slope**2) ** 1.5)[inner], atol=1e-5)
    np.testing.assert_allclose(np.hypot(np.diff(path.x), np.diff(path.y)), STEP, atol=1e-4)


def test_climbing_path_is_shorter_on_the_map():
    path = Path.of_curvature(np.zeros(101), 0.1)
    assert path.x[-1] == pytest.approx(50.0 * np.cos(0.1), rel=1e-12)
    np.testing.assert_allclose(path.grade, 0.1)


def test_smooth_steps_meet_their_knots():
    values = smooth_steps(np.array([0.0, 10.0, 15.0, 20.0, 99.0]), [10.0, 20.0], [1.0, 3.0])
    np.testing.assert_allclose(values, [1.0, 1.0, 2.0, 3.0, 3.0])


def test_path_of_one_point_or_nan_is_refused():
    with pytest.raises(DataError, match="at least 2 points"):
        Path.of_curvature(np.array([0.0, np.nan, 0.0]))


@given(st.floats(0.0, 40.0), st.floats(0.0, 40.0), st.floats(0.2, 8.0), st.floats(0.5, 20.0))
def test_speed_change_ends_at_its_speed_within_its_acceleration(start, end, acceleration, jerk):
    schedule = Schedule.of(start, [Change(end, acceleration, jerk), Hold(0.1)])
    assert schedule.speed[-1] == pytest.approx(end, abs=1e-9)
    slope = np.diff(schedule.speed) / DT
    assert np.abs(slope).max(initial=0.0) <= acceleration * (1 + 1e-6) + 1e-9
    assert np.abs(np.diff(slope)).max(initial=0.0) / DT <= jerk * (1 + 1e-6) + 1e-6


def test_speed_change_takes_the_time_of_its_trapezoid():
    schedule = Schedule.of(10.0, [Change(20.0, 2.0, 4.0)])
    assert DT * (len(schedule) - 1) == pytest.approx(10.0 / 2.0 + 2.0 / 4.0, abs=DT)


@pytest.mark.parametrize("phase", [Hold(-1.0), Change(10.0, 0.0), Change(10.0, -1.0), Change(-5.0, 1.0)])
def test_impossible_phases_are_refused(phase):
    with pytest.raises(ConfigurationError):
        Schedule.of(5.0, [phase])


STYLE = Style(accelerate=1.5, brake=2.5, lateral=2.0)


def test_planned_speed_keeps_every_limit():
    curvature = np.concatenate((np.zeros(400), bend(0.05, 1.5, 8.0), np.zeros(400)))
    limit = speed_limit(curvature, np.full(len(curvature), 20.0), STYLE)
    schedule = along_path(limit, STYLE, [], None)
    at = np.interp(schedule.distance, STEP * np.arange(len(curvature)), np.abs(curvature))
    assert (at * schedule.speed**2).max() < 1.2 * STYLE.lateral
    assert schedule.acceleration.max() <= 1.01 * STYLE.accelerate
    assert schedule.acceleration.min() >= -1.01 * STYLE.brake
    assert schedule.speed.max() == pytest.approx(20.0)


def test_planned_stop_is_where_and_as_long_as_asked():
    schedule = along_path(np.full(1000, 15.0), STYLE, [(500, 6.0)], None)
    standing = schedule.speed == 0.0
    assert DT * standing.sum() == pytest.approx(6.0, abs=1.5)
    assert np.median(schedule.distance[standing]) == pytest.approx(250.0, abs=1.0)


def test_path_shorter_than_the_drive_is_refused():
    with pytest.raises(DataError, match="ends after"):
        along_path(np.full(100, 10.0), STYLE, [], 60.0)
