"""The driver, and the kernel that drives a batch of cars through their plans (Warp).

The driver previews the path, steers along it, and keeps the speed with the pedals. All time steps of a drive
are one launch.
"""

from __future__ import annotations

from typing import Annotated, Any

import warp as wp
from pydantic import Field

from ...arrays import real, vec2
from ...cues import GRAVITY
from ...settings import NonNegative, Positive, configuration
from ..plans import DT, STEP
from .vehicle import (
    DRIVE,
    FORWARD,
    HEADING,
    LATERAL,
    PITCH,
    ROLL,
    WHEEL,
    CarParameters,
    Commands,
    Cue,
    Gear,
    Slope,
    State,
    X,
    Y,
    air_drag,
    cues,
    derivative,
    engine_brake,
    first_gear,
    limited,
    most_drive,
    resist,
    runge_kutta,
    shifted,
    slip_for,
    stabilizing_moment,
    transmitted,
)

wp.set_module_options({"enable_backward": False})

LONGEST_DELAY = 0.5
"""Of a driver's reaction, s."""

MEMORY = 64
"""Samples of the steering that a delayed driver has in mind: more than :data:`LONGEST_DELAY`."""


@configuration
class Driver:
    """How a driver steers and uses the pedals. The values are engineering choices.

    The default is the standard driver, who makes no errors of chance.

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
        reaction_delay: From what is seen to what the arms do, s; at most :data:`LONGEST_DELAY`.
        lane_wander: Standard deviation of the line aimed at from the path, m.
        wander_time: Correlation time of that line and of errors in speed, s.
        steering_noise: Standard deviation of the error of the steering-wheel angle, rad.
        pedal_noise: Standard deviation of the error of the requested acceleration, m/s^2.
        catch_up: Largest acceleration added to the planned one to make up for an error, m/s^2; 0 for no
            bound.
        patience: How far the plan may get ahead of the car before it waits for it, m; 0 for a plan that
            never waits.
        shift_pace: Factor on the time that shifting gears takes.
    """

    preview_time: Positive = 0.8
    preview_distance: Positive = 4.0
    anticipation: NonNegative = 0.2
    hand_lag: Positive = 0.08
    speed_gain: Positive = 1.0
    position_gain: NonNegative = 0.15
    pedal_anticipation: NonNegative = 0.12
    reaction_delay: Annotated[float, Field(ge=0.0, le=LONGEST_DELAY)] = 0.0
    lane_wander: NonNegative = 0.0
    wander_time: Positive = 3.0
    steering_noise: NonNegative = 0.0
    pedal_noise: NonNegative = 0.0
    catch_up: NonNegative = 0.0
    patience: NonNegative = 0.0
    shift_pace: Positive = 1.0

    @property
    def errs(self) -> bool:
        """Whether chance plays a part."""
        return max(self.lane_wander, self.steering_noise, self.pedal_noise) > 0.0


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
    reaction_delay: real
    catch_up: real
    patience: real
    shift_pace: real


@wp.struct
class Errors:
    """Where the car is, seen from its path."""

    offset: real  # to the right of the path, m
    heading: real  # heading minus the path's, rad
    curvature_ahead: real  # of the path at the anticipated point, 1/m


@wp.func
def road_wheel_for(car: CarParameters, speed: real, curvature: real, bank: real) -> real:
    """(D1) Road-wheel angle of a steady turn, delta = L kappa + alpha_f - alpha_r with the tires' slips, rad.

    The feed-forward of Kapania and Gerdes (2015); in the linear range it is (L + K v^2) kappa. A bank, rad,
    takes its share of gravity off the tires.
    """
    wheelbase = car.front_axle + car.rear_axle
    lateral = car.mass * speed * speed * curvature / wheelbase
    lateral = lateral - car.mass * real(GRAVITY) * wp.sin(bank) / wheelbase
    grip = car.friction * car.mass * real(GRAVITY) / wheelbase
    a, b = car.front_axle, car.rear_axle
    front = slip_for(lateral * b, grip * b, car.front_cornering_stiffness, car.shape_factor)
    rear = slip_for(lateral * a, grip * a, car.rear_cornering_stiffness, car.shape_factor)
    return wp.atan(wheelbase * curvature) + front - rear


@wp.func
def wheel_command(
    car: CarParameters, driver: DriverParameters, state: State, errors: Errors, bank: real
) -> real:
    """(D2) Steering-wheel angle: feed-forward of the anticipated curvature, and preview feedback.

    The feedback aims at a point ahead on the path, kappa = -2 e_aim / l^2 with e_aim the offset extrapolated
    along the course (heading plus side slip) to the distance l. In rad.
    """
    u = wp.max(state[FORWARD], real(0.0))
    distance = wp.max(driver.preview_time * u, driver.preview_distance)
    course = errors.heading + wp.atan2(state[LATERAL], wp.max(u, real(1.0)))
    aim = errors.offset + distance * wp.sin(course)
    curvature = errors.curvature_ahead - real(2.0) * aim / (distance * distance)
    return car.ratio * road_wheel_for(car, u, curvature, bank)


@wp.struct
class SpeedTarget:
    """What the speed should be, now and shortly."""

    speed: real  # m/s
    position: real  # along the path, m
    acceleration: real  # anticipated, m/s^2
    acceleration_now: real  # m/s^2
    error: real  # of the requested acceleration, by chance, m/s^2


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
        needed = target.acceleration_now - driver.speed_gain * wp.max(speed, real(0.0))
        return car.mass * (wp.min(needed, real(0.0)) - wp.abs(slope))
    follow = driver.position_gain * wp.min(real(0.5) * target.speed, real(1.0))
    needed = (
        target.acceleration
        + driver.speed_gain * (target.speed - speed)
        + follow * (target.position - position)
    )
    if driver.catch_up > real(0.0):
        needed = target.acceleration + limited(needed - target.acceleration, driver.catch_up)
    needed = needed + target.error
    return car.mass * (needed + slope + car.rolling_resistance * real(GRAVITY)) + air_drag(car, speed)


SUBSTEPS = 5
"""Integration steps a sample: 2 ms, a sixth of the fastest time constant (the tires' at 40 m/s)."""

ScheduleRow: Any = wp.types.vector(8, real)
"""Speed, acceleration, distance, steering-wheel angle, whether the wheel is turned to that angle (1) or along
the path (0), and the driver's errors by chance: of the line aimed at, of the wheel, of the acceleration."""

PathRow: Any = wp.types.vector(8, real)
"""A point of a path: the columns of :meth:`~..plans.Path.table`."""

COLUMNS = (
    "x_m",
    "y_m",
    "heading_rad",
    "speed_m_s",
    "lateral_speed_m_s",
    "roll_rad",
    "pitch_rad",
    "steering_wheel_rad",
    "throttle",
    "brake",
    "longitudinal_acceleration_m_s2",
    "lateral_acceleration_m_s2",
    "grade_rad",
    "path_offset_m",
    "gear",
    "station_m",
)
"""Channels of a driven trace, in the order of the kernel's rows after the nine cues."""

Row: Any = wp.types.vector(9 + len(COLUMNS), real)


@wp.struct
class Task:
    """One drive: where its path, schedule and results lie in the shared arrays."""

    path_start: int
    path_points: int
    first: int  # of the schedule and the result
    samples: int
    open_loop: int  # 1: the schedule's steering angle, 0: the driver follows the path


@wp.struct
class Road:
    """The path at one station."""

    x: real
    y: real
    heading: real
    curvature: real
    slope: Slope


@wp.func
def road_at(paths: wp.array(dtype=PathRow), task: Task, station: real) -> Road:
    """The path between its points, curvature and slope changing linearly; straight on after its end."""
    i = wp.clamp(int(wp.floor(station / real(STEP))), 0, task.path_points - 2)
    d = station - real(STEP) * real(i)
    here, there = paths[task.path_start + i], paths[task.path_start + i + 1]
    bend = (there[3] - here[3]) / real(STEP)
    inside = wp.clamp(d, real(0.0), real(STEP))
    outside = d - inside
    road = Road()
    road.curvature = here[3] + bend * inside
    turned = here[3] * inside + real(0.5) * bend * inside * inside
    road.heading = here[2] + turned
    if outside != real(0.0):
        road.curvature = real(0.0)
    middle = here[2] + real(0.5) * turned
    flat = wp.cos(here[4])
    road.x = here[0] + flat * (inside * wp.cos(middle) + outside * wp.cos(road.heading))
    road.y = here[1] + flat * (inside * wp.sin(middle) + outside * wp.sin(road.heading))
    steepening = (there[5] - here[5]) / real(STEP)
    road.slope.grade = here[4] + here[5] * inside + real(0.5) * steepening * inside * inside
    road.slope.per_meter = here[5] + steepening * inside
    road.slope.per_square_meter = steepening
    leaning = (there[7] - here[7]) / real(STEP)
    road.slope.bank = here[6] + here[7] * inside + real(0.5) * leaning * inside * inside
    road.slope.bank_per_meter = here[7] + leaning * inside
    road.slope.bank_per_square_meter = leaning
    if outside != real(0.0):
        road.slope.per_meter = real(0.0)
        road.slope.per_square_meter = real(0.0)
        road.slope.bank_per_meter = real(0.0)
        road.slope.bank_per_square_meter = real(0.0)
    return road


@wp.struct
class Anchor:
    """Where the path lies: shifted and turned when the driver takes the wheel again after a steering test."""

    x: real
    y: real
    heading: real


@wp.func
def anchored(road: Road, anchor: Anchor) -> Road:
    """The path's point where the path lies now."""
    c, s = wp.cos(anchor.heading), wp.sin(anchor.heading)
    x = anchor.x + (road.x * c - road.y * s)
    road.y = anchor.y + (road.x * s + road.y * c)
    road.x = x
    road.heading = road.heading + anchor.heading
    return road


@wp.func
def anchor_at(road: Road, state: State) -> Anchor:
    """The anchor that puts this point of the path, as planned, under the car, along its course."""
    anchor = Anchor()
    course = state[HEADING] + wp.atan2(state[LATERAL], wp.max(state[FORWARD], real(1.0)))
    anchor.heading = course - road.heading
    c, s = wp.cos(anchor.heading), wp.sin(anchor.heading)
    anchor.x = state[X] - (road.x * c - road.y * s)
    anchor.y = state[Y] - (road.x * s + road.y * c)
    return anchor


@wp.func
def offset_from(road: Road, state: State) -> vec2:
    """Distances of the car ahead of the path's point and to the right of it, m."""
    dx, dy = state[X] - road.x, state[Y] - road.y
    c, s = wp.cos(road.heading), wp.sin(road.heading)
    return vec2(dx * c + dy * s, dy * c - dx * s)


@wp.func
def errors_at(road: Road, ahead: Road, state: State, wander: real) -> Errors:
    """Where the car is, seen from its path, or from the line beside it that the driver aims at."""
    errors = Errors()
    errors.offset = offset_from(road, state)[1] - wander
    errors.heading = state[HEADING] - road.heading
    errors.curvature_ahead = ahead.curvature
    return errors


@wp.func
def target_at(schedule: wp.array(dtype=ScheduleRow), task: Task, sample: int, lead: int) -> SpeedTarget:
    """The schedule at a sample, and its acceleration ``lead`` samples later."""
    now = schedule[task.first + sample]
    soon = schedule[task.first + wp.min(sample + lead, task.samples - 1)]
    target = SpeedTarget()
    target.speed = now[0]
    target.position = now[2]
    target.acceleration = soon[1]
    target.acceleration_now = now[1]
    return target


@wp.func
def pedals(car: CarParameters, force: real, speed: real, drag: real) -> vec2:
    """Requested drive and brake force, N, within what the car has; the engine's drag brakes first."""
    return vec2(
        wp.clamp(force, real(0.0) - drag, most_drive(car, speed)),
        wp.clamp(-force - drag, real(0.0), car.max_brake_force),
    )


@wp.func
def rolled(follows: bool, road: Road, state: State, station: real, dt: real) -> real:
    """The path's point nearest to the car, by one Newton step; the distance driven if there is no path."""
    if not follows:
        return station + state[FORWARD] * dt
    gap = offset_from(road, state)
    stretch = wp.max(real(1.0) - road.curvature * gap[1], real(0.2)) * wp.cos(road.slope.grade)
    return station + gap[0] / stretch


@wp.func
def start_state(car: CarParameters, road: Road, speed: real) -> State:
    """Rolling straight along the path, the engine balancing the resistances."""
    state = State()
    state[X] = road.x
    state[Y] = road.y
    state[HEADING] = road.heading
    state[FORWARD] = speed
    if speed > real(0.0):
        state[DRIVE] = air_drag(car, speed) + car.rolling_resistance * car.mass * real(GRAVITY)
    return state


@wp.func
def row_of(
    car: CarParameters,
    state: State,
    cue: Cue,
    road: Road,
    command: Commands,
    gear: Gear,
    follows: bool,
    station: real,
) -> Row:
    """One sample of the result: nine cues, then :data:`COLUMNS`."""
    row = Row()
    for k in range(3):
        row[k] = cue.specific_force[k]
        row[3 + k] = cue.angular_velocity[k]
        row[6 + k] = cue.angular_acceleration[k]
    row[9] = state[X]
    row[10] = state[Y]
    row[11] = state[HEADING]
    row[12] = state[FORWARD]
    row[13] = state[LATERAL]
    row[14] = state[ROLL]
    row[15] = state[PITCH]
    row[16] = state[WHEEL]
    row[17] = wp.max(command.drive, real(0.0)) / car.max_drive_force
    row[18] = command.brake / car.max_brake_force
    row[19] = cue.road_acceleration[0]
    row[20] = cue.road_acceleration[1]
    row[21] = road.slope.grade
    row[22] = offset_from(road, state)[1]
    if not follows:
        row[22] = real(0.0)
    row[23] = real(gear.number + 1)
    row[24] = station
    return row


@wp.func
def decide(
    car: CarParameters,
    driver: DriverParameters,
    state: State,
    station: real,
    target: SpeedTarget,
    wheel: real,
    wheel_lag: real,
    slope: Slope,
    drag: real,
) -> Commands:
    """What the driver requests, held for one integration step; ``drag`` is the engine's, N."""
    command = Commands()
    force = force_command(car, driver, state[FORWARD], station, target, slope.grade)
    forces = pedals(car, force, state[FORWARD], drag)
    command.drive = forces[0]
    command.brake = forces[1]
    command.wheel_lag = wheel_lag
    command.wheel = wheel
    command.grade = slope.grade
    command.grade_per_meter = slope.per_meter
    command.bank = slope.bank
    return command


ROBOT_LAG = 0.02
"""Time constant of a steering robot, s."""


@wp.kernel
def drive_all(
    cars: wp.array(dtype=CarParameters),
    drivers: wp.array(dtype=DriverParameters),
    tasks: wp.array(dtype=Task),
    paths: wp.array(dtype=PathRow),
    schedule: wp.array(dtype=ScheduleRow),
    memory: wp.array2d(dtype=real),
    substeps: int,
    result: wp.array(dtype=Row),
) -> None:
    """Thread i drives ``tasks[i]`` with ``cars[i]`` and ``drivers[i]``; one row of ``result`` a sample.

    ``memory`` (drives, :data:`MEMORY`) is what delayed drivers have decided and not done yet.
    """
    i = wp.tid()
    car, driver, task = cars[i], drivers[i], tasks[i]
    dt = real(DT) / real(substeps)
    lead = int(driver.pedal_anticipation / real(DT))
    delay = int(driver.reaction_delay / real(DT) + real(0.5))
    station, deflection = real(0.0), real(0.0)
    state = start_state(car, road_at(paths, task, station), schedule[task.first][0])
    gear = first_gear(car, state[FORWARD])
    gear.force = state[DRIVE]
    anchor = Anchor()
    followed = bool(True)
    late = int(0)
    for sample in range(task.samples):
        row = schedule[task.first + sample - late]
        follows = row[4] == real(0.0)
        # A plan that waits for the car stays where it is for this sample.
        ahead_of_car = row[2] - station
        if driver.patience > real(0.0) and follows and sample > 0 and ahead_of_car > driver.patience:
            late += 1
            row = schedule[task.first + sample - late]
            follows = row[4] == real(0.0)
        errors_now = schedule[task.first + sample]
        target = target_at(schedule, task, sample - late, lead)
        target.error = errors_now[7]
        if follows and not followed:
            anchor = anchor_at(road_at(paths, task, station), state)
        followed = follows
        if car.gears > 0:
            gear = shifted(car, gear, driver.shift_pace, state, real(DT))
        for substep in range(substeps):
            road = anchored(road_at(paths, task, station), anchor)
            wheel, wheel_lag = real(row[3]), real(driver.hand_lag)
            if follows:
                ahead = road_at(paths, task, station + driver.anticipation * state[FORWARD])
                errors = errors_at(road, ahead, state, errors_now[5])
                wheel = wheel_command(car, driver, state, errors, road.slope.bank)
                if delay > 0:
                    if substep == 0:
                        memory[i, sample % MEMORY] = wheel
                    wheel = memory[i, wp.max(sample - delay, 0) % MEMORY]
                wheel = wheel + errors_now[6]
            elif task.open_loop == 0:
                wheel_lag = real(ROBOT_LAG)
            target.position = row[2] + target.speed * real(substep) * dt
            drag = engine_brake(car, gear, state[FORWARD])
            command = decide(car, driver, state, station, target, wheel, wheel_lag, road.slope, drag)
            command.yaw_moment = stabilizing_moment(car, state)
            if car.gears > 0:
                gear = transmitted(car, gear, driver.shift_pace, state[DRIVE], dt)
                command.driveline = gear.force - state[DRIVE]
            standing = resist(car, deflection, state, command, dt)
            command.resistance = standing[1]
            if substep == 0:
                cue = cues(car, state, derivative(car, state, command), road.slope)
                result[task.first + sample] = row_of(
                    car, state, cue, road, command, gear, follows or task.open_loop == 1, station
                )
            deflection = standing[0]
            state = runge_kutta(car, state, command, dt)
            nearest = anchored(road_at(paths, task, station), anchor)
            station = rolled(follows, nearest, state, station, dt)
