"""Gears, the engine's drag and banked roads, against their parameters and plain mechanics."""

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.car import car_names, get_car
from motion_cueing.envs.car.fleet import AUTOMATIC, MANUAL
from motion_cueing.envs.car.kernels.driver import Driver
from motion_cueing.envs.car.plans import Change, Hold, Path, Schedule
from motion_cueing.envs.car.simulation import Plan, simulate, straight
from motion_cueing.envs.car.vehicles import RESERVED_CARS, STANDARD_CARS, Gearbox
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError

SEDAN = get_car("sedan")


def driven(gearbox, phases, start=0.0, **driver):
    car = replace(SEDAN, gearbox=gearbox)
    plan = Plan("drive", car, straight(), Schedule.of(start, phases), driver=Driver(catch_up=0.3, **driver))
    return simulate([plan])[0]


def shifts(trace):
    """Samples at which another gear begins."""
    return np.flatnonzero(np.diff(trace.channels["gear"])) + 1


@pytest.mark.parametrize("gap", [0.2, 0.5])
@pytest.mark.parametrize("depth", [0.4, 1.0])
def test_a_shift_lasts_and_is_as_deep_as_the_gearbox_says(gap, depth):
    driveline = {"driveline_frequency": 60.0, "driveline_damping": 1.0}
    gearbox = replace(MANUAL, gap=gap, depth=depth, closing=0.05, dwell=2.0, **driveline)
    trace = driven(gearbox, [Hold(1.0), Change(30.0, 2.0, 4.0)])
    force = trace.channels["longitudinal_acceleration_m_s2"]
    # The second shift: the launch is over, the air's drag still small.
    at = shifts(trace)[1]
    before = force[at - 10 : at].mean()
    missing = (before - force[at : at + round(100 * gap) + 40]) / (before + 0.2)
    # Resistances of about 0.2 m/s^2 stay while the drive force is away.
    assert missing.max() == pytest.approx(depth, abs=0.12)
    assert 0.01 * np.sum(missing > 0.5 * depth) == pytest.approx(gap, abs=0.08)


def test_the_felt_force_has_the_spectrum_of_a_gap_through_the_driveline():
    """The force is that of a rectangular gap through the second-order driveline of its parameters."""
    gearbox = replace(MANUAL, gap=0.5, closing=0.02, dwell=2.0)
    trace = driven(gearbox, [Hold(1.0), Change(30.0, 2.0, 4.0)])
    force = trace.channels["longitudinal_acceleration_m_s2"]
    at = shifts(trace)[1]
    fall = np.argmin(force[at : at + 50]) * 0.01
    w, z = gearbox.driveline_frequency, gearbox.driveline_damping
    # An underdamped mode reaches its first extreme after half a period.
    assert fall == pytest.approx(np.pi / (w * np.sqrt(1.0 - z**2)), abs=0.04)


def test_shifts_come_at_engine_speeds_that_follow_the_ratios():
    trace = driven(replace(MANUAL, urgency=0.0, dwell=0.0), [Hold(1.0), Change(32.0, 1.0, 4.0), Hold(1.0)])
    speed = trace.channels["speed_m_s"][shifts(trace) - 1]
    expected = MANUAL.shift_speed * MANUAL.ratios[0] / np.array(MANUAL.ratios[: len(speed)])
    assert len(speed) >= 4
    np.testing.assert_allclose(speed, expected, atol=0.1)


def test_an_automatic_interrupts_less_than_a_manual():
    phases = [Hold(1.0), Change(25.0, 2.0, 4.0)]
    dips = []
    for gearbox in (MANUAL, AUTOMATIC):
        trace = driven(gearbox, phases)
        force = trace.channels["longitudinal_acceleration_m_s2"]
        dips.append(min(force[at : at + 60].min() for at in shifts(trace)[:2]))
    assert dips[0] < 0.2
    assert dips[1] > 0.5


def test_coasting_is_slowed_by_the_engine_without_the_brake():
    gearbox = Gearbox(ratios=(1.0,), shift_speed=5.0, engine_braking=1.0)
    trace = driven(gearbox, [Hold(1.0), Change(10.0, 0.9, 2.0)], start=25.0)
    assert trace.channels["brake"].max() < 0.01
    assert trace.channels["longitudinal_acceleration_m_s2"].min() < -0.8
    without = driven(None, [Hold(1.0), Change(10.0, 0.9, 2.0)], start=25.0)
    assert without.channels["brake"].max() > 0.04


def test_down_shifts_when_slowing_and_first_gear_at_rest():
    trace = driven(MANUAL, [Hold(1.0), Change(0.0, 2.0, 3.0), Hold(3.0)], start=25.0)
    gear = trace.channels["gear"]
    assert gear[0] > 3
    assert np.all(np.diff(gear) <= 0.0)
    assert gear[-1] == 1.0
    np.testing.assert_allclose(trace.specific_force[-1], [0.0, 0.0, -GRAVITY], atol=0.02)


def test_a_car_without_a_gearbox_has_no_gear():
    assert "gear" not in driven(None, [Hold(1.0)]).channels


def test_a_gearbox_whose_ratios_do_not_fall_is_refused():
    with pytest.raises(ConfigurationError, match="ratios must fall"):
        Gearbox(ratios=(2.0, 3.0), shift_speed=5.0)


def test_reserved_and_standard_cars_are_known_and_apart():
    assert set(STANDARD_CARS) | set(RESERVED_CARS) < set(car_names())
    assert not set(STANDARD_CARS) & set(RESERVED_CARS)


@pytest.mark.parametrize("name", [name for name in car_names() if name not in STANDARD_CARS])
def test_new_cars_have_a_gearbox_a_stability_control_and_understeer(name):
    car = get_car(name)
    assert car.gearbox is not None
    assert car.stability is not None
    assert 0.2 < np.degrees(car.understeer_gradient) * GRAVITY < 4.0


def test_a_bank_takes_the_side_force_off_the_driver():
    """On a circle banked by atan(v^2 / R g) hardly anybody is pushed aside; level, the body rolls as well."""
    speed, radius = 20.0, 120.0
    angle = np.arctan(speed**2 / (radius * GRAVITY))
    stations = np.arange(0.0, 500.0, 0.5)
    rise = np.clip((stations - 40.0) / 80.0, 0.0, 1.0)
    path = Path.of_curvature(rise / radius, bank=angle * rise)
    level = Path.of_curvature(rise / radius)
    schedule = Schedule.of(speed, [Hold(20.0)])
    banked, flat = simulate([Plan("b", SEDAN, path, schedule), Plan("l", SEDAN, level, schedule)])
    assert flat.specific_force[-1, 1] == pytest.approx(speed**2 / radius, rel=0.12)
    assert abs(banked.specific_force[-1, 1]) < 0.08 * flat.specific_force[-1, 1]
    assert np.abs(banked.channels["path_offset_m"]).max() < 0.3
    # The turn presses the car into the bank.
    pressed = GRAVITY * np.cos(angle) + speed**2 / radius * np.sin(angle)
    assert banked.specific_force[-1, 2] == pytest.approx(-pressed, rel=0.015)
    # The bank's roll is felt: its integral is the bank, right side down.
    assert 0.01 * banked.angular_velocity[:, 0].sum() == pytest.approx(angle, rel=0.05)
