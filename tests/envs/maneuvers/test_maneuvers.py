"""Every maneuver with every car: calm at both ends, and what its source says of it."""

import dataclasses

import numpy as np
import pytest

from motion_cueing.envs.car import get_car
from motion_cueing.envs.car.vehicles import STANDARD_CARS
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.maneuvers import describe_maneuver, get_maneuver, maneuver_names
from motion_cueing.envs.maneuvers.cones import (
    DoubleLaneChange,
    Gate,
    ObstacleAvoidance,
    Slalom,
    clearance,
    smoothest_way,
)
from motion_cueing.envs.maneuvers.standard import (
    DEGREE,
    KMH,
    LARGEST_OFFSET,
    Maneuver,
    SineWithDwell,
    SteadyTurn,
)
from motion_cueing.envs.settings import from_dict, load, save

from ..car.gains import roll_gradient

REST = np.array([0.0, 0.0, -GRAVITY])
PAPER = ["steady-turn", "braking", "lane-change"]


@pytest.fixture(scope="module")
def drives():
    return {
        (name, car): get_maneuver(name).drive(get_car(car))
        for name in maneuver_names()
        for car in STANDARD_CARS
    }


def test_names():
    assert maneuver_names()[:3] == PAPER
    assert len(maneuver_names()) == 12
    with pytest.raises(UnknownNameError, match="steady-turn"):
        get_maneuver("steady-tunr")


@pytest.mark.parametrize("name", maneuver_names())
def test_begins_calm_and_ends_calm(drives, name):
    for car in STANDARD_CARS:
        trace = drives[name, car]
        assert trace.name == name
        assert trace.dt == pytest.approx(0.01)
        np.testing.assert_allclose(trace.specific_force[:150], [REST] * 150, atol=0.02)
        np.testing.assert_allclose(trace.angular_velocity[:150], 0.0, atol=1e-3)
        if name != "steady-turn":
            np.testing.assert_allclose(trace.specific_force[-20:], [REST] * 20, atol=0.4)
            np.testing.assert_allclose(trace.angular_velocity[-20:], 0.0, atol=2.0 * DEGREE)


@pytest.mark.parametrize("name", [n for n in maneuver_names() if n not in ("step-steer", "sine-with-dwell")])
def test_driver_stays_on_the_path(drives, name):
    bound = 0.6 if name in ("slalom", "double-lane-change", "obstacle-avoidance") else 0.3
    for car in STANDARD_CARS:
        assert np.abs(drives[name, car].channels["path_offset_m"]).max() < bound


@pytest.mark.parametrize(
    "maneuver", [DoubleLaneChange(), ObstacleAvoidance(), Slalom()], ids=lambda m: m.name
)
@pytest.mark.parametrize("name", STANDARD_CARS)
def test_no_cone_is_hit(drives, maneuver, name):
    """The whole width of the body, from end to end, stays between the cones."""
    car = get_car(name)
    assert clearance(drives[maneuver.name, name], car, maneuver.gates(car)) > 0.0


def test_cones_would_be_hit_without_steering(drives):
    """The measure of the test before can fail."""
    car, maneuver = get_car("sedan"), DoubleLaneChange()
    straight_on = drives["lane-change", "sedan"]
    assert clearance(straight_on, car, maneuver.gates(car)) < -1.0


def test_track_of_iso_3888():
    car = get_car("sedan")
    first, second, third = DoubleLaneChange().track(car)
    assert (first.start, first.end, second.start, second.end, third.start, third.end) == (
        0,
        15,
        45,
        70,
        95,
        125,
    )
    assert first.right - first.left == pytest.approx(1.1 * 1.85 + 0.25)
    assert second.right - second.left == pytest.approx(1.2 * 1.85 + 0.25)
    assert third.right - third.left == pytest.approx(1.3 * 1.85 + 0.25)
    assert 0.5 * (second.right + second.left) == pytest.approx(-3.5)
    first, second, third = ObstacleAvoidance().track(car)
    assert (first.end, second.start, second.end, third.start, third.end) == (12, 25.5, 36.5, 49, 61)
    assert first.left - second.right == pytest.approx(1.0)
    assert second.right - second.left == pytest.approx(car.width + 1.0)


def test_way_too_narrow_for_the_car_is_refused():
    car = get_car("sedan")
    with pytest.raises(ConfigurationError, match="does not fit"):
        smoothest_way([Gate.lane(20.0, 20.0, 0.0, 1.8)], car, 10.0, 80.0, 0.1)


@pytest.mark.parametrize(
    ("maneuver", "asked"),
    [
        (SteadyTurn(radius=5.0), "steady-turn with .*radius 5,"),
        (Slalom(spacing=6.0), "slalom with .*spacing 6,"),
        (DoubleLaneChange(speed=60.0), "double-lane-change with .*speed 60,"),
    ],
    ids=lambda value: value.name if isinstance(value, Maneuver) else "",
)
def test_a_maneuver_no_car_can_drive_is_refused(maneuver, asked):
    with pytest.raises(
        ConfigurationError, match=rf"sedan cannot drive {asked}.* came \d+\.\d m off its path"
    ):
        maneuver.drive()


def test_open_loop_steering_has_no_path_to_come_off(drives):
    assert np.abs(drives["step-steer", "sedan"].channels["path_offset_m"]).max() > LARGEST_OFFSET


def test_steady_turn_of_the_paper(drives):
    trace = drives["steady-turn", "sedan"]
    side = trace.specific_force[:, 1] / GRAVITY
    assert side.max() == pytest.approx(0.25, abs=0.01)
    centripetal = (60 * KMH) ** 2 / 150 / GRAVITY
    roll = -roll_gradient(get_car("sedan")) * GRAVITY * centripetal
    assert side[-1] == pytest.approx(centripetal * np.cos(roll) + np.sin(roll), abs=2e-3)
    assert trace.angular_velocity[-1, 2] / DEGREE == pytest.approx(6.37, abs=0.02)
    assert trace.duration > 25.0


def test_braking_of_the_paper(drives):
    """100.7 m at 0.25 g, and the way rolled in the onset: v t / 2 - a t^2 / 24 with t = a / jerk."""
    trace, speed, deceleration = drives["braking", "sedan"], 80 * KMH, 0.25 * GRAVITY
    onset = deceleration / 10.0
    expected = speed**2 / (2 * deceleration) + speed * onset / 2 - deceleration * onset**2 / 24
    assert speed**2 / (2 * deceleration) == pytest.approx(100.7, abs=0.05)
    assert trace.channels["x_m"][-1] - 2.5 * speed == pytest.approx(expected, abs=0.3)
    steady = (trace.time > 5.0) & (trace.time < 11.0)
    np.testing.assert_allclose(
        trace.channels["longitudinal_acceleration_m_s2"][steady], -deceleration, rtol=0.02
    )


def test_stop_ends_with_a_jerk_and_springs_back(drives):
    trace = drives["braking", "sedan"]
    stop = int(np.argmax(trace.channels["speed_m_s"] < 0.05))
    assert trace.specific_force[stop - 50, 0] < -2.3
    after = slice(stop, stop + 60)
    assert trace.specific_force[after, 0].max() > 0.2
    assert np.abs(trace.specific_force[after, 0]).max() < 2.6
    assert trace.angular_velocity[after, 1].max() > 1.0 * DEGREE
    np.testing.assert_allclose(trace.specific_force[-50:], [REST] * 50, atol=0.01)


def test_lane_change_of_the_paper(drives):
    trace = drives["lane-change", "sedan"]
    assert trace.channels["y_m"][-1] == pytest.approx(-4.0, abs=0.05)
    lateral = trace.channels["lateral_acceleration_m_s2"] / GRAVITY
    assert lateral.min() == pytest.approx(-0.125, rel=0.04)
    assert lateral.max() == pytest.approx(0.125, rel=0.04)
    assert get_maneuver("lane-change").duration == pytest.approx(4.53, abs=0.005)


def test_step_steer_reaches_its_acceleration(drives):
    """4 m/s^2 is that of the linear range; saturating tires and drive load leave 10 % less or more."""
    for car in STANDARD_CARS:
        trace = drives["step-steer", car]
        held = (trace.time > 5.0) & (trace.time < 5.8)
        assert trace.channels["lateral_acceleration_m_s2"][held].mean() == pytest.approx(4.0, rel=0.1)
        rate = np.gradient(trace.channels["steering_wheel_rad"], 0.01)
        assert rate.max() > 200.0 * DEGREE


def test_sine_with_dwell_has_its_shape():
    wave = SineWithDwell().wave(
        np.array([-0.1, 0.0, 0.25 / 0.7, 0.75 / 0.7, 0.75 / 0.7 + 0.5, 1 / 0.7 + 0.51])
    )
    np.testing.assert_allclose(wave, [0.0, 0.0, 1.0, -1.0, -1.0, 0.0], atol=1e-12)


def test_slalom_passes_its_cones_alternately(drives):
    car = get_car("sedan")
    ch = drives["slalom", "sedan"].channels
    sides = [np.sign(np.interp(0.5 * (g.start + g.end), ch["x_m"], ch["y_m"])) for g in Slalom().gates(car)]
    assert sides == [-1.0, 1.0] * 4


def test_stop_and_go_stops_three_times(drives):
    standing = np.abs(drives["stop-and-go", "sedan"].channels["speed_m_s"]) < 0.1
    assert np.sum(np.diff(standing.astype(int)) == 1) >= 3
    assert drives["stop-and-go", "sedan"].channels["speed_m_s"].max() == pytest.approx(40 * KMH, rel=0.03)


def test_roundabout_turns_left_by_a_right_angle(drives):
    ch = drives["roundabout", "sedan"].channels
    assert ch["heading_rad"][-1] == pytest.approx(-np.pi / 2, abs=0.01)
    assert 25 * KMH < ch["speed_m_s"].min() < 28 * KMH


def test_hill_returns_to_the_level_and_is_felt(drives):
    trace = drives["hill", "sedan"]
    assert trace.channels["grade_rad"].max() == pytest.approx(np.arctan(0.08), rel=1e-3)
    assert trace.channels["grade_rad"][-1] == pytest.approx(0.0, abs=1e-4)
    # Uphill at constant speed: g sin(grade + pitch) pushes into the seat.
    up = int(np.argmax(trace.channels["grade_rad"] > 0.999 * np.arctan(0.08))) + 200
    pitch = trace.channels["pitch_rad"][up] + trace.channels["grade_rad"][up]
    assert trace.specific_force[up, 0] == pytest.approx(GRAVITY * np.sin(pitch), abs=0.05)
    # Over the crest one is lighter: v^2 dgrade/ds.
    assert trace.specific_force[:, 2].max() > -GRAVITY + 0.4


@pytest.mark.parametrize("name", maneuver_names())
def test_parameters_go_through_yaml_and_refuse_nonsense(name, tmp_path):
    maneuver = get_maneuver(name)
    save(maneuver, tmp_path / "maneuver.yaml")
    assert load(type(maneuver), tmp_path / "maneuver.yaml") == maneuver
    with pytest.raises(ConfigurationError, match="settle"):
        from_dict(type(maneuver), {"settle": -1.0})
    with pytest.raises(ConfigurationError, match="unknown field"):
        from_dict(type(maneuver), {"velocity": 1.0})
    assert describe_maneuver(name)
    assert type(maneuver).__doc__


def test_maneuvers_follow_their_parameters():
    gentle = dataclasses.replace(get_maneuver("braking"), deceleration=1.0)
    trace = gentle.drive()
    assert trace.channels["longitudinal_acceleration_m_s2"].min() > -1.2
