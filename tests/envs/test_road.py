"""What is known of the road ahead, against geometry worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import DataError
from motion_cueing.envs.maneuvers import get_maneuver, get_recording, load_drives, random_drives
from motion_cueing.envs.maneuvers.roads import KINDS
from motion_cueing.envs.road import NO_STOP, RoadMap, Route


def road_of(curvature, speed=10.0, samples=200, dt=0.1):
    """A map of a road that a car drives along at one speed."""
    station = speed * dt * np.arange(samples)
    zero = np.zeros_like(curvature)
    route = Route.of_road(curvature, 20.0)
    return RoadMap.of_route(route, zero, None, station, np.full(samples, speed))


def test_curvature_ahead_is_that_of_the_place():
    # Curvature grows by 1e-4 a meter, so that it names the place.
    road = road_of(0.5e-4 * np.arange(1000))
    ahead = road.ahead(np.tile([0.0, 7.3, 40.0], (200, 1)))
    expected = 1e-4 * (road.station[:, None] + [0.0, 7.3, 40.0])
    np.testing.assert_allclose(ahead.curvature, expected, atol=1e-12)
    assert (ahead.speed_limit == 20.0).all()


def test_after_its_end_the_road_goes_straight_on():
    road = road_of(np.full(100, 0.01))
    ahead = road.ahead(np.tile([0.0, 60.0], (200, 1)))
    assert ahead.curvature[0].tolist() == [0.01, 0.0]


def test_a_stop_is_where_the_car_stands_and_is_over_when_it_leaves():
    speed = np.concatenate((np.full(30, 5.0), np.zeros(20), np.full(30, 5.0)))
    station = np.cumsum(0.1 * speed)
    route = Route.of_road(np.zeros(200), 20.0)
    road = RoadMap.of_route(route, np.zeros(200), None, station, speed)
    np.testing.assert_allclose(road.stop_distance[:30], station[30] - station[:30])
    assert not road.stop_distance[30:50].any()
    assert (road.stop_distance[50:] == NO_STOP).all()
    assert (road.unannounced().stop_distance == NO_STOP).all()
    unknown = RoadMap.of_route(replace(route, stops=False), np.zeros(200), None, station, speed)
    assert (unknown.stop_distance == NO_STOP).all()


def test_errors_of_the_map():
    road = road_of(0.5e-4 * np.arange(1000))
    distance = np.zeros((200, 1))
    true, larger = road.ahead(distance).curvature, road.wrong(scale=1.2).ahead(distance).curvature
    np.testing.assert_allclose(larger, 1.2 * true)
    # What lies 10 m farther ahead on a wrong map is found 10 m later.
    shifted = road.wrong(shift=10.0).ahead(distance + 10.0).curvature
    np.testing.assert_allclose(shifted, true, atol=1e-12)
    straight = road.unmapped(np.arange(1000) < 100)
    assert (straight.ahead(distance).curvature[:, 0] == 0.0)[:49].all()
    np.testing.assert_array_equal(straight.ahead(distance).curvature[51:], true[51:])
    gone = np.arange(200) < 50
    assert (road.missing(gone).known == ~gone).all()


def test_a_lane_change_is_on_no_map_and_cones_are_known_to_the_scenario():
    distance = np.zeros((1, 1))
    change = get_maneuver("lane-change").drive()
    assert not change.road.ahead(np.tile(distance, (len(change), 1))).curvature.any()
    slalom = get_maneuver("slalom").drive()
    here = np.tile(distance, (len(slalom), 1))
    lateral = slalom.channels["lateral_acceleration_m_s2"]
    known = slalom.channels["speed_m_s"] ** 2 * slalom.road.ahead(here).curvature[:, 0]
    assert np.corrcoef(known, lateral)[0, 1] > 0.9
    assert not slalom.road.unannounced().ahead(here).curvature.any()


@pytest.mark.parametrize("kind", KINDS)
def test_random_drives_know_their_road(kind):
    drives = random_drives(3, 30.0, 5, kind, drives=load_drives("broad"))
    for drive in drives:
        here = drive.road.ahead(np.zeros((len(drive), 1)))
        rate, speed = drive.angular_velocity[:, 2], drive.channels["speed_m_s"]
        missed = rate - speed * here.curvature[:, 0]
        # Cones and what nobody knows apart, the road explains the yaw rate.
        if not drive.road.cones.any() and kind in ("urban", "rural", "hilly", "circuit", "rough"):
            assert missed.std() < 0.7 * rate.std() + 0.01
        emergency = kind == "limit"
        assert not emergency or (drive.road.stop_distance == NO_STOP).all()


@pytest.mark.parametrize("name", ["city-drive", "commute"])
def test_a_recorded_road_is_its_own_path_smoothed(name):
    drive = get_recording(name)
    here = drive.road.ahead(np.zeros((len(drive), 1)))
    rate, speed = drive.angular_velocity[:, 2], drive.channels["speed_m_s"]
    missed = rate - speed * here.curvature[:, 0]
    assert 0.0 < missed.std() < 0.6 * rate.std()
    assert (drive.road.stop_distance == NO_STOP).all()


def test_resampling_keeps_the_road():
    drive = get_maneuver("roundabout").drive()
    slower = drive.resampled(0.02)
    # What the road is there, every second sample.
    fine, coarse = (one.road.ahead(np.full((len(one), 1), 5.0)).curvature for one in (drive, slower))
    np.testing.assert_allclose(coarse, fine[::2][: len(coarse)], atol=1e-6)


def test_a_road_of_another_length_is_refused():
    drive = get_maneuver("hill").drive()
    with pytest.raises(DataError, match=r"road has \d+ samples, expected 3"):
        CueTrace("x", drive.time[:3], drive.specific_force[:3], drive.angular_velocity[:3], road=drive.road)
