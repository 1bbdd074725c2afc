"""The vehicle model against closed forms, kinematics, and commonroad-vehicle-models."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motion_cueing.envs.car import car_names, get_car
from motion_cueing.envs.car.kernels.driver import Driver
from motion_cueing.envs.car.plans import Change, Hold, Path, Schedule
from motion_cueing.envs.car.simulation import Plan, simulate, straight
from motion_cueing.envs.car.vehicles import Car
from motion_cueing.envs.cues import GRAVITY

from .gains import roll_gradient, yaw_rate_gain

DT = 0.01
DEG = np.pi / 180.0


def open_loop(car: Car, speed: float, steering: np.ndarray):
    schedule = Schedule.of(speed, [Hold(DT * (len(steering) - 1))])
    return simulate([Plan("test", car, straight(), schedule, steering=steering)])[0]


def held_wheel(car: Car, speed: float, lateral_acceleration: float, duration: float = 12.0):
    angle = car.steering_wheel_for(speed, lateral_acceleration)
    time = DT * np.arange(round(duration / DT) + 1)
    return open_loop(car, speed, angle * np.clip(time - 1.0, 0.0, 1.0)), angle


def without_resistance(car: Car) -> Car:
    """Drag and rolling resistance need a drive force, which moves load (and grip) to the rear axle."""
    drivetrain = dataclasses.replace(car.drivetrain, drag_area=0.0, rolling_resistance=0.0)
    return dataclasses.replace(car, drivetrain=drivetrain)


def integral(rate: np.ndarray) -> np.ndarray:
    return np.concatenate(([0.0], np.cumsum(0.5 * DT * (rate[1:] + rate[:-1]))))


@pytest.mark.parametrize("name", car_names())
@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0])
def test_steady_yaw_gain_is_that_of_the_linear_bicycle(name, speed):
    car = without_resistance(get_car(name))
    trace, angle = held_wheel(car, speed, 0.3)
    gain = trace.angular_velocity[-1, 2] / angle
    assert gain == pytest.approx(yaw_rate_gain(car, trace.channels["speed_m_s"][-1]), rel=2e-3)


# Long vehicles turn their wheels too far for the linear range on this radius.
@pytest.mark.parametrize("name", [name for name in car_names() if get_car(name).wheelbase < 4.0])
def test_understeer_gradient_from_two_speeds_on_one_radius(name):
    car, radius = get_car(name), 200.0
    angles, accelerations = [], []
    for speed in (5.0, 14.0):
        path = Path.of_curvature(np.concatenate((np.linspace(0.0, 1 / radius, 40), np.full(600, 1 / radius))))
        trace = simulate([Plan("circle", car, path, Schedule.of(speed, [Hold(18.0)]))])[0]
        yaw_rate, v = trace.angular_velocity[-1, 2], trace.channels["speed_m_s"][-1]
        angles.append(
            trace.channels["steering_wheel_rad"][-1] / car.steering.ratio - car.wheelbase * yaw_rate / v
        )
        accelerations.append(trace.channels["lateral_acceleration_m_s2"][-1])
    gradient = np.diff(angles)[0] / np.diff(accelerations)[0]
    # The neutral car has none: the tolerance is then 0.05 deg/g.
    assert gradient == pytest.approx(car.understeer_gradient, rel=0.03, abs=0.05 * DEG / GRAVITY)


def test_sedan_understeers_by_2_2_degrees_and_rolls_by_5_degrees_a_g():
    car = get_car("sedan")
    assert car.understeer_gradient * GRAVITY / DEG == pytest.approx(2.2, abs=0.05)
    assert roll_gradient(car) * GRAVITY / DEG == pytest.approx(-5.0, abs=0.02)


@pytest.mark.parametrize("name", car_names())
def test_body_leans_outwards_by_the_roll_gradient(name):
    car = get_car(name)
    trace, _ = held_wheel(car, 20.0, 1.0)
    acceleration = trace.channels["lateral_acceleration_m_s2"][-1]
    assert trace.channels["roll_rad"][-1] / acceleration == pytest.approx(roll_gradient(car), rel=1e-3)


def test_specific_force_of_a_steady_turn_is_the_rotated_one():
    car = dataclasses.replace(get_car("sedan"), reference_point=(0.0, 0.0, 0.45))  # on the roll axis
    trace, _ = held_wheel(car, 20.0, 2.0, duration=25.0)
    roll, pitch = trace.channels["roll_rad"][-1], trace.channels["pitch_rad"][-1]
    a = [trace.channels[f"{axis}_acceleration_m_s2"][-1] for axis in ("longitudinal", "lateral")]
    body_from_road = Rotation.from_euler("ZYX", [0.0, pitch, roll]).inv()
    expected = body_from_road.apply([a[0], a[1], -GRAVITY])
    np.testing.assert_allclose(trace.specific_force[-1], expected, atol=2e-4)
    assert trace.specific_force[-1, 1] > a[1] + 0.9 * GRAVITY * abs(roll)


def test_saturated_tires_give_no_more_than_friction():
    car = get_car("sedan")
    trace = open_loop(car, 25.0, 3.0 * np.clip(DT * np.arange(500) - 1.0, 0.0, 1.0))
    assert np.abs(trace.channels["lateral_acceleration_m_s2"]).max() < 1.06 * car.tires.friction * GRAVITY
    assert trace.channels["lateral_acceleration_m_s2"].max() > 0.85 * car.tires.friction * GRAVITY


@pytest.mark.parametrize("name", car_names())
def test_full_brake_stops_within_the_distance_of_friction(name):
    car, speed = get_car(name), 20.0
    phases = [Hold(1.0), Change(0.0, 30.0, 1000.0, np.inf), Hold(5.0, brake=30.0)]
    trace = simulate([Plan("stop", car, straight(), Schedule.of(speed, phases))])[0]
    distance = trace.channels["x_m"][-1] - speed * 1.0
    # With all friction used, and one brake lag of rolling on; half of it was anticipated.
    friction = min(car.tires.friction * GRAVITY, car.drivetrain.max_brake_force / car.mass)
    shortest = speed**2 / (2.0 * (friction + 0.5))
    assert shortest < distance < speed**2 / (2.0 * 0.75 * friction) + speed * car.drivetrain.brake_lag


def test_car_held_on_a_slope_feels_its_gravity():
    car, grade = get_car("sedan"), 0.1
    path = Path.of_curvature(np.zeros(50), grade)
    trace = simulate([Plan("hold", car, path, Schedule.of(0.0, [Hold(10.0, brake=2.0)]))])[0]
    assert abs(trace.channels["speed_m_s"][-1]) < 1e-6
    assert np.linalg.norm(trace.specific_force[-1]) == pytest.approx(GRAVITY, rel=1e-6)
    pitch = grade + trace.channels["pitch_rad"][-1]
    expected = Rotation.from_euler("Y", pitch).inv().apply([0.0, 0.0, -GRAVITY])
    np.testing.assert_allclose(trace.specific_force[-1], expected, atol=1e-4)
    assert trace.specific_force[-1, 0] > 0.9  # uphill: pressed into the seat


def test_standing_car_does_not_chatter():
    trace = simulate([Plan("stand", get_car("sedan"), straight(), Schedule.of(0.0, [Hold(5.0)]))])[0]
    np.testing.assert_allclose(trace.specific_force, [[0.0, 0.0, -GRAVITY]] * len(trace), atol=1e-12)
    np.testing.assert_allclose(trace.angular_velocity, 0.0, atol=1e-12)


def test_cornering_at_walking_pace_is_geometric():
    car = get_car("sedan")
    time = DT * np.arange(3001)
    trace = open_loop(car, 1.0, 3.0 * np.clip(0.2 * time, 0.0, 1.0))
    expected = trace.channels["speed_m_s"][-1] * np.tan(3.0 / car.steering.ratio) / car.wheelbase
    assert trace.angular_velocity[-1, 2] == pytest.approx(expected, rel=5e-3)


WINDING = Path.of_curvature(0.01 * np.sin(np.arange(1200) / 40.0))
HILLY = Path.of_curvature(
    np.zeros(1200), 0.06 * np.sin(np.arange(1200) / 60.0) * np.clip(np.arange(1200) / 200, 0, 1)
)
SPEEDS = Schedule.of(12.0, [Hold(3.0), Change(18.0, 2.0), Hold(3.0), Change(9.0, 2.5), Hold(4.0)])


@pytest.mark.parametrize("path", [WINDING, HILLY], ids=["winding", "hilly"])
def test_cues_are_the_derivatives_of_the_motion(path):
    """Position and attitude of the reference point, differentiated twice, give the cues back."""
    car = get_car("sedan")
    trace = simulate([Plan("drive", car, path, SPEEDS)])[0]
    ch = trace.channels
    pitch = ch["pitch_rad"] + ch["grade_rad"]
    attitude = Rotation.from_euler("ZYX", np.stack((ch["heading_rad"], pitch, ch["roll_rad"]), axis=1))
    depth = -integral(np.sin(ch["grade_rad"]) * ch["speed_m_s"])
    arm = np.array(car.reference_point) - [0.0, 0.0, car.suspension.arm]
    point = np.stack((ch["x_m"], ch["y_m"], depth), axis=1) + attitude.apply(arm)
    acceleration = np.gradient(np.gradient(point, DT, axis=0), DT, axis=0)
    force = attitude.inv().apply(acceleration - [0.0, 0.0, GRAVITY])
    middle = slice(20, -20)
    np.testing.assert_allclose(trace.specific_force[middle], force[middle], atol=0.03)
    step = attitude[:-2].inv() * attitude[2:]
    omega = step.as_rotvec() / (2.0 * DT)
    np.testing.assert_allclose(trace.angular_velocity[1:-1][middle], omega[middle], atol=2e-4)
    alpha = np.gradient(trace.angular_velocity, DT, axis=0)
    np.testing.assert_allclose(trace.angular_acceleration[middle], alpha[middle], atol=0.02)


def test_integrated_acceleration_is_the_speed():
    ch = simulate([Plan("drive", get_car("sedan"), WINDING, SPEEDS)])[0].channels
    yaw_rate = np.gradient(ch["heading_rad"], DT)
    rate = ch["longitudinal_acceleration_m_s2"] + ch["lateral_speed_m_s"] * yaw_rate
    np.testing.assert_allclose(12.0 + integral(rate), ch["speed_m_s"], atol=5e-3)


def test_coasting_energy_goes_into_drag_and_rolling():
    """Where neither pedal is used, kinetic energy falls by the work of drag and rolling resistance."""
    car = get_car("sedan")
    weak = dataclasses.replace(car.drivetrain, max_drive_force=1e-6, max_power=1e-6)
    coasting = dataclasses.replace(car, drivetrain=weak)
    trace = simulate([Plan("coast", coasting, straight(), Schedule.of(30.0, [Hold(30.0)]))])[0]
    v, start = trace.channels["speed_m_s"], 300  # the drive force of the start has died away
    power = (
        0.5 * 1.2 * car.drivetrain.drag_area * v**3
        + car.drivetrain.rolling_resistance * car.mass * GRAVITY * v
    )
    lost = 0.5 * car.mass * (v[start] ** 2 - v[-1] ** 2)
    assert lost == pytest.approx(integral(power[start:])[-1], rel=2e-3)


def rigid(car: Car) -> Car:
    """Without what a plain single-track model lacks: resistances, relaxing tires, a rolling body."""
    tires = dataclasses.replace(car.tires, relaxation_length=0.04)
    return dataclasses.replace(
        without_resistance(car), tires=tires, suspension=dataclasses.replace(car.suspension, arm=1e-4)
    )


def test_bmw_agrees_with_commonroad_single_track_in_the_linear_range():
    """Same steering angle into both models: yaw rate and side slip within 1 % of their peaks."""
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
    from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

    car, speed = rigid(get_car("bmw-320i")), 30.0
    time = DT * np.arange(801)
    wave = np.where(time > 1.0, np.sin(2.0 * np.pi * 0.5 * (time - 1.0)), 0.0)
    trace = open_loop(car, speed, 1.0 * DEG * wave)
    delta = trace.channels["steering_wheel_rad"] / car.steering.ratio
    parameters, substeps = parameters_vehicle2(), 10
    state = np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0])
    yaw_rate, slip = [], []
    for here, there in zip(delta, [*delta[1:], delta[-1]], strict=True):
        yaw_rate.append(state[5])
        slip.append(state[6])
        for k in range(substeps):
            state[2] = here + (there - here) * (k + 0.5) / substeps
            state = state + DT / substeps * np.array(vehicle_dynamics_st(state, [0.0, 0.0], parameters))
    for ours, theirs in (
        (trace.angular_velocity[:, 2], np.array(yaw_rate)),
        (trace.channels["lateral_speed_m_s"] / trace.channels["speed_m_s"], np.array(slip)),
    ):
        assert np.abs(theirs).max() > 5e-4
        np.testing.assert_allclose(ours, theirs, atol=0.01 * np.abs(theirs).max())


def test_driver_follows_a_circle_without_steady_error():
    for name in car_names():
        path = Path.of_curvature(
            np.concatenate((np.zeros(60), np.linspace(0, 1 / 80, 60), np.full(600, 1 / 80)))
        )
        plan = Plan("circle", get_car(name), path, Schedule.of(12.0, [Hold(25.0)]), driver=Driver())
        assert abs(simulate([plan])[0].channels["path_offset_m"][-1]) < 0.05
