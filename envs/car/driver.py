"""The driver: previews the path, steers along it, and keeps the speed with the pedals."""

from __future__ import annotations

import warp as wp

from ..cues import GRAVITY
from ..precision import real
from ..settings import NonNegative, Positive, configuration
from .tires import slip_for
from .vehicle_model import air_drag
from .vehicle_state import FORWARD, LATERAL, CarParameters, State

wp.set_module_options({"enable_backward": False})


@configuration
class Driver:
    """How a driver steers and uses the pedals. The values are engineering choices.

    Args:
        preview_time: Time to the point the driver aims at, s. The path error then closes with natural
            frequency sqrt(2) / preview_time and damping ratio 1 / sqrt(2).
        preview_distance: Least distance of that point, m.
        anticipation: How far ahead the path's curvature is steered, s: makes up for arms, tires and yaw
            inertia.
        hand_lag: Time constant of the arms, s.
        speed_gain: Acceleration asked for per speed error, 1/s.
        position_gain: Acceleration asked for per error of the position along the path, 1/s^2.
        pedal_anticipation: How far ahead the planned acceleration is pedalled, s.
    """

    preview_time: Positive = 0.8
    preview_distance: Positive = 4.0
    anticipation: NonNegative = 0.2
    hand_lag: Positive = 0.08
    speed_gain: Positive = 1.0
    position_gain: NonNegative = 0.15
    pedal_anticipation: NonNegative = 0.12


@wp.struct
class DriverParameters:
    """The numbers of :class:`Driver`, under the same names."""

    preview_time: real
    preview_distance: real
    anticipation: real
    hand_lag: real
    speed_gain: real
    position_gain: real
    pedal_anticipation: real


@wp.struct
class Errors:
    """Where the car is, seen from its path."""

    offset: real  # to the right of the path, m
    heading: real  # heading minus the path's, rad
    curvature_ahead: real  # of the path at the anticipated point, 1/m


@wp.func
def road_wheel_for(car: CarParameters, speed: real, curvature: real) -> real:
    """(D1) Road-wheel angle of a steady turn, delta = L kappa + alpha_f - alpha_r with the tires' slips, rad.

    The feed-forward of Kapania and Gerdes (2015); in the linear range it is (L + K v^2) kappa.
    """
    wheelbase = car.front_axle + car.rear_axle
    lateral = car.mass * speed * speed * curvature / wheelbase
    grip = car.friction * car.mass * real(GRAVITY) / wheelbase
    a, b = car.front_axle, car.rear_axle
    front = slip_for(lateral * b, grip * b, car.front_cornering_stiffness, car.shape_factor)
    rear = slip_for(lateral * a, grip * a, car.rear_cornering_stiffness, car.shape_factor)
    return wp.atan(wheelbase * curvature) + front - rear


@wp.func
def wheel_command(car: CarParameters, driver: DriverParameters, state: State, errors: Errors) -> real:
    """(D2) Steering-wheel angle: feed-forward of the anticipated curvature, and preview feedback.

    The feedback aims at a point ahead on the path, kappa = -2 e_aim / l^2 with e_aim the offset extrapolated
    along the course (heading plus side slip) to the distance l. In rad.
    """
    u = wp.max(state[FORWARD], real(0.0))
    distance = wp.max(driver.preview_time * u, driver.preview_distance)
    course = errors.heading + wp.atan2(state[LATERAL], wp.max(u, real(1.0)))
    aim = errors.offset + distance * wp.sin(course)
    curvature = errors.curvature_ahead - real(2.0) * aim / (distance * distance)
    return car.ratio * road_wheel_for(car, u, curvature)


@wp.struct
class SpeedTarget:
    """What the speed should be, now and shortly."""

    speed: real  # m/s
    position: real  # along the path, m
    acceleration: real  # anticipated, m/s^2
    acceleration_now: real  # m/s^2


@wp.func
def force_command(
    car: CarParameters,
    driver: DriverParameters,
    speed: real,
    position: real,
    target: SpeedTarget,
    grade: real,
) -> real:
    """(D3) Force asked of drive (positive) or brakes (negative), N: feed-forward and feedback.

    Where the plan stands still, the planned (negative) acceleration is the brake that holds the car.
    """
    slope = real(GRAVITY) * wp.sin(grade)
    if target.speed <= real(0.0):
        wanted = target.acceleration_now - driver.speed_gain * wp.max(speed, real(0.0))
        return car.mass * (wp.min(wanted, real(0.0)) - wp.abs(slope))
    follow = driver.position_gain * wp.min(real(0.5) * target.speed, real(1.0))
    wanted = (
        target.acceleration
        + driver.speed_gain * (target.speed - speed)
        + follow * (target.position - position)
    )
    return car.mass * (wanted + slope + car.rolling_resistance * real(GRAVITY)) + air_drag(car, speed)


@wp.func
def most_drive(car: CarParameters, speed: real) -> real:
    """Largest drive force at this speed: traction-limited, then power-limited, N."""
    return wp.min(car.max_drive_force, car.max_power / wp.max(speed, real(1.0)))
