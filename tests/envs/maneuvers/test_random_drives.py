"""Random drives: deterministic, different, calm at first, and within what drivers do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.maneuvers import RandomDrives, drive_seeds, random_drive, random_drives

ROADS = ("urban", "rural", "highway")
KINDS = (*ROADS, "track", "hilly", "strip", "cones")


@pytest.fixture(scope="module")
def batches():
    return {kind: random_drives(24, 60.0, seed=3, kind=kind) for kind in KINDS}


@pytest.mark.slow
def test_rows_of_a_batch_are_the_single_drives(batches):
    seeds = drive_seeds(24, 3)
    for row in (0, 7, 23):
        single = random_drive(seeds[row], 60.0, kind="urban")
        np.testing.assert_array_equal(single.specific_force, batches["urban"][row].specific_force)
        np.testing.assert_array_equal(single.angular_acceleration, batches["urban"][row].angular_acceleration)


def test_same_seed_same_drive_and_another_seed_another():
    one, same, other = random_drive(5, 30.0), random_drive(5, 30.0), random_drive(6, 30.0)
    np.testing.assert_array_equal(one.specific_force, same.specific_force)
    assert np.abs(one.specific_force - other.specific_force).max() > 0.1


def test_all_drives_of_a_batch_differ(batches):
    ends = {tuple(trace.specific_force[-1]) for kind in KINDS for trace in batches[kind]}
    assert len(ends) == 24 * len(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_each_begins_calm_and_lasts_as_long_as_asked(batches, kind):
    for trace in batches[kind]:
        assert trace.duration == pytest.approx(60.0)
        np.testing.assert_allclose(trace.specific_force[:200], [[0.0, 0.0, -GRAVITY]] * 200, atol=0.02)


@pytest.mark.parametrize(
    ("kind", "side", "along"),
    [
        ("urban", 3.9, 3.6),
        ("rural", 3.9, 3.2),
        ("highway", 2.2, 2.3),
        ("track", 7.5, 7.0),
        ("hilly", 3.2, 4.0),
        ("strip", 4.5, 8.0),
        ("cones", 9.0, 6.0),
    ],
)
def test_accelerations_are_those_of_drivers(batches, kind, side, along):
    force = np.concatenate([trace.specific_force for trace in batches[kind]])
    speed = np.concatenate([trace.channels["speed_m_s"] for trace in batches[kind]])
    assert 0.4 * side < np.abs(force[:, 1]).max() < side
    assert 0.3 * along < np.abs(force[:, 0]).max() < along
    assert speed.min() > -0.2
    assert speed.max() < (44.0 if kind == "strip" else 38.0)


def test_urban_drives_are_livelier_than_highway_ones(batches):
    def spread(kind):
        return np.concatenate([trace.specific_force[:, :2] for trace in batches[kind]]).std()

    assert spread("urban") > 1.5 * spread("highway")


def test_urban_drives_stop_and_turn_both_ways(batches):
    speed = np.concatenate([trace.channels["speed_m_s"] for trace in batches["urban"]])
    side = np.concatenate([trace.specific_force[:, 1] for trace in batches["urban"]])
    assert 0.02 < np.mean(np.abs(speed) < 0.1) < 0.4
    assert side.max() > 2.0
    assert side.min() < -2.0


@settings(max_examples=15)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(2.0, 40.0),
    st.sampled_from(ROADS),
    st.sampled_from(["bmw-320i", "volvo-v40"]),
)
def test_any_seed_can_be_driven(seed, duration, kind, car):
    trace = random_drive(seed, duration, kind, get_car(car))
    assert trace.duration == pytest.approx(duration, abs=0.006)
    assert np.abs(trace.channels["path_offset_m"]).max() < 0.6
    assert np.abs(trace.specific_force[:, :2]).max() < 5.0


def test_the_track_is_fiercer_than_any_road_and_the_car_stays_on_it(batches):
    def spread(kind):
        return np.concatenate([trace.specific_force[:, :2] for trace in batches[kind]]).std()

    assert spread("track") > 1.3 * max(spread(kind) for kind in ROADS)
    offsets = [np.abs(trace.channels["path_offset_m"]).max() for trace in batches["track"]]
    assert max(offsets) < 1.0


def test_the_hills_are_steeper_than_any_other_road(batches):
    def spread(kind):
        return np.concatenate([trace.specific_force[:, 2] for trace in batches[kind]]).std()

    assert spread("hilly") > 3.0 * max(spread(kind) for kind in (*ROADS, "track"))


def test_the_strip_holds_longer_what_it_accelerates(batches):
    """Shares of time with much along the road: standing starts and full braking from high speed."""

    def share(kind):
        return np.mean(np.abs(np.concatenate([trace.specific_force[:, 0] for trace in batches[kind]])) > 3.0)

    offsets = [np.abs(trace.channels["path_offset_m"]).max() for trace in batches["strip"]]
    assert max(offsets) < 1.0
    assert share("strip") > 2.0 * max(share(kind) for kind in KINDS if kind != "strip")


def test_kinds_follow_their_shares():
    names = [
        trace.name
        for trace in random_drives(8, 5.0, seed=0, drives=RandomDrives(urban=0, rural=0, highway=1))
    ]
    assert all(name.startswith("highway-") for name in names)


def test_cars_are_drawn_from_the_list():
    drives = RandomDrives(cars=("bmw-320i", "volvo-v40"))
    cars = {drives.plan(seed, 5.0).car.name for seed in range(12)}
    assert cars == {"bmw-320i", "volvo-v40"}


def test_bad_settings_are_refused():
    with pytest.raises(UnknownNameError, match="urban"):
        random_drive(0, 5.0, kind="urbn")
    with pytest.raises(ConfigurationError, match="sedan"):
        RandomDrives(cars=("sedn",))
    with pytest.raises(ConfigurationError, match="must be positive"):
        RandomDrives(urban=0, rural=0, highway=0)
    with pytest.raises(ConfigurationError):
        RandomDrives(urban=float("nan"))


@pytest.mark.parametrize("duration", [-5.0, 0.0, 0.001, float("nan"), float("inf"), 1e9])
def test_a_duration_out_of_range_is_refused(duration):
    with pytest.raises(ConfigurationError, match="duration is"):
        random_drive(0, duration)


@pytest.mark.parametrize("seed", [-1, 1.5, None])
def test_a_seed_that_is_no_whole_number_is_refused(seed):
    with pytest.raises(ConfigurationError, match="seed is"):
        random_drive(seed, 5.0)
    with pytest.raises(ConfigurationError, match="seed is"):
        random_drives(2, 5.0, seed)


def test_the_shortest_drive():
    assert random_drive(0, 0.1).duration == pytest.approx(0.1)
