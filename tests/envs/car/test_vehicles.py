"""Cars as data: what they refuse, and that they go through YAML."""

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.envs.car import Car, car_names, get_car
from motion_cueing.envs.cues import GRAVITY
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.settings import from_dict, load, save, to_dict

from .gains import yaw_rate_gain

NUMBERS = [f.name for f in dataclasses.fields(Car) if f.type == "Positive"]


@pytest.mark.parametrize("name", car_names())
def test_round_trip_through_yaml(name, tmp_path):
    save(get_car(name), tmp_path / "car.yaml")
    assert load(Car, tmp_path / "car.yaml") == get_car(name)


def test_all_numbers_are_checked():
    assert {"mass", "front_axle", "rear_axle", "yaw_inertia", "cg_height", "width"} <= set(NUMBERS)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 0.0, -1.0])
@pytest.mark.parametrize("field", NUMBERS)
def test_numbers_that_no_car_has_are_refused(field, bad):
    values = to_dict(get_car("sedan")) | {field: bad}
    with pytest.raises(ConfigurationError, match=field):
        from_dict(Car, values)


def test_unknown_field_names_the_nearest():
    with pytest.raises(ConfigurationError, match="Did you mean mass"):
        from_dict(Car, to_dict(get_car("sedan")) | {"masss": 1.0})


def test_body_that_would_topple_is_refused():
    values = to_dict(get_car("sedan"))
    values["suspension"]["roll_stiffness"] = 7000.0
    with pytest.raises(ConfigurationError, match="roll_stiffness must exceed"):
        from_dict(Car, values)


def test_body_heavier_than_the_car_is_refused():
    with pytest.raises(ConfigurationError, match="sprung_mass"):
        from_dict(Car, to_dict(get_car("sedan")) | {"mass": 1000.0})


def test_unknown_car_names_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean sedan"):
        get_car("sedna")


def test_paper_car_comes_first_and_weighs_1814_kg():
    assert car_names()[0] == "sedan"
    assert get_car("sedan").mass == 1814.0


def test_bmw_has_the_numbers_of_commonroad():
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2

    car, p = get_car("bmw-320i"), parameters_vehicle2()
    assert (car.mass, car.front_axle, car.rear_axle, car.yaw_inertia) == (p.m, p.a, p.b, p.I_z)
    load = p.m * GRAVITY / (p.a + p.b)
    assert car.tires.front_cornering_stiffness == pytest.approx(-p.tire.p_ky1 * load * p.b, rel=1e-4)
    assert car.tires.rear_cornering_stiffness == pytest.approx(-p.tire.p_ky1 * load * p.a, rel=1e-4)
    roll = sum(k * t**2 / 2.0 - bar for k, t, bar in ((p.K_sf, p.T_f, p.K_tsf), (p.K_sr, p.T_r, p.K_tsr)))
    assert car.suspension.roll_stiffness == pytest.approx(roll, rel=1e-3)
    assert car.length == pytest.approx(p.l, abs=0.01)


@given(st.sampled_from(car_names()), st.floats(3.0, 45.0), st.floats(0.01, 5.0))
def test_steering_angle_and_yaw_gain_agree(name, speed, acceleration):
    """a_y = v r, whichever way it is computed."""
    car = get_car(name)
    angle = car.steering_wheel_for(speed, acceleration)
    assert speed * yaw_rate_gain(car, speed) * angle == pytest.approx(acceleration, rel=1e-9)


SEATS = {"van": (0.0, 1.3), "truck": (1.4, 2.3), "city-bus": (2.7, 1.6)}
"""Most a driver sits before the front axle and above the c.g., m, where not as in a car."""


@pytest.mark.parametrize("name", car_names())
def test_drivers_seat_is_inside_the_car(name):
    car = get_car(name)
    x, y, z = car.reference_point
    assert abs(y) < 0.5 * car.width
    # In a van the driver sits higher, in a truck and a bus over the front axle or before it.
    front, high = SEATS.get(name, (0.0, 1.0))
    assert -car.rear_axle < x < car.front_axle + front
    assert 0.3 < car.cg_height - z < high
