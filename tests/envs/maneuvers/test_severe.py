"""The maneuvers of the second suite, and the suites by version."""

import numpy as np
import pytest

from motion_cueing.envs.car import get_car
from motion_cueing.envs.car.plans import Path
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import SUITES, get_maneuver, maneuver_names
from motion_cueing.envs.maneuvers.severe import CORNERS, closed_lap

NEW = ("gear-change", "circuit", "limit-handling", "surge-and-brake")
CARS = ("sedan", "volvo-v40", "e-class-suv")
REST = np.array([0.0, 0.0, -GRAVITY])


@pytest.fixture(scope="module")
def drives():
    return {(name, car): get_maneuver(name).drive(get_car(car)) for name in NEW for car in CARS}


def test_suites():
    assert len(SUITES[1]) == 12
    assert SUITES[2] == (*SUITES[1], *NEW)
    assert not set(NEW) & set(maneuver_names())
    assert set(NEW) < set(maneuver_names(2))
    with pytest.raises(ConfigurationError, match="suite 3"):
        maneuver_names(3)


@pytest.mark.parametrize("name", NEW)
def test_begins_and_ends_calm(drives, name):
    for car in CARS:
        trace = drives[name, car]
        np.testing.assert_allclose(trace.specific_force[:150], [REST] * 150, atol=0.02)
        np.testing.assert_allclose(trace.specific_force[-20:], [REST] * 20, atol=0.4)


def test_a_gear_change_interrupts_2_m_s2_for_half_a_second(drives):
    trace = drives["gear-change", "sedan"]
    gear, along = trace.channels["gear"], trace.channels["longitudinal_acceleration_m_s2"]
    at = np.flatnonzero(np.diff(gear)) + 1
    assert len(at) >= 3
    for first in at[:3]:
        assert along[first - 5] > 1.6
        assert 0.4 < 0.01 * np.sum(along[first : first + 100] < 1.0) < 0.7
    assert trace.channels["speed_m_s"][-1] == pytest.approx(100.0 / 3.6, abs=0.7)


def test_the_lap_is_closed():
    lap = closed_lap(CORNERS, 15.0)
    path = Path.of_curvature(np.append(lap, 0.0))
    assert np.hypot(path.x[-1], path.y[-1]) < 1.0
    assert path.heading[-1] == pytest.approx(2.0 * np.pi, abs=1e-6)


def test_cars_stay_on_the_circuit_at_most_of_a_g(drives):
    for car in CARS:
        trace = drives["circuit", car]
        assert np.abs(trace.channels["path_offset_m"]).max() < 0.6
        assert np.abs(trace.specific_force[:, 1]).max() > 6.5
        assert trace.specific_force[:, 0].min() < -6.0


def test_the_limit_is_reached_without_a_spin(drives):
    for car in CARS:
        channels = drives["limit-handling", car].channels
        slip = np.arctan2(channels["lateral_speed_m_s"], channels["speed_m_s"])
        assert np.degrees(np.abs(slip).max()) < 10.0
        friction = get_car(car).tires.friction
        most = np.abs(channels["lateral_acceleration_m_s2"]).max()
        assert 0.85 * friction * GRAVITY < most < 1.1 * friction * GRAVITY


def test_a_minute_of_surge_then_full_braking(drives):
    trace = drives["surge-and-brake", "sedan"]
    along = trace.channels["longitudinal_acceleration_m_s2"]
    assert 0.01 * np.sum(along > 0.6) == pytest.approx(60.0, abs=2.0)
    assert along.min() < -7.5
