"""The kernel that drives a batch of cars through their plans, all time steps in one launch (Warp)."""

from __future__ import annotations

from typing import Any

import warp as wp

from ..cues import GRAVITY
from ..precision import real, vec2, vec6
from .body_motion import Cue, Slope, cues
from .driver import DriverParameters, Errors, SpeedTarget, force_command, most_drive, wheel_command
from .paths import STEP
from .schedules import DT
from .vehicle_model import air_drag, derivative, resist, runge_kutta
from .vehicle_state import (
    DRIVE,
    FORWARD,
    HEADING,
    LATERAL,
    PITCH,
    ROLL,
    WHEEL,
    CarParameters,
    Commands,
    State,
    X,
    Y,
)

wp.set_module_options({"enable_backward": False})

SUBSTEPS = 5
"""Integration steps a sample: 2 ms, a sixth of the fastest time constant (the tires' at 40 m/s)."""

vec4: Any = wp.types.vector(4, real)
"""A row of a schedule: speed, acceleration, distance, steering-wheel angle."""

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
def road_at(paths: wp.array(dtype=vec6), task: Task, station: real) -> Road:
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
    road.slope.per_metre = here[5] + steepening * inside
    road.slope.per_square_metre = steepening
    if outside != real(0.0):
        road.slope.per_metre = real(0.0)
        road.slope.per_square_metre = real(0.0)
    return road


@wp.func
def offset_from(road: Road, state: State) -> vec2:
    """Distances of the car ahead of the path's point and to the right of it, m."""
    dx, dy = state[X] - road.x, state[Y] - road.y
    c, s = wp.cos(road.heading), wp.sin(road.heading)
    return vec2(dx * c + dy * s, dy * c - dx * s)


@wp.func
def errors_at(road: Road, ahead: Road, state: State) -> Errors:
    """Where the car is, seen from its path."""
    errors = Errors()
    errors.offset = offset_from(road, state)[1]
    errors.heading = state[HEADING] - road.heading
    errors.curvature_ahead = ahead.curvature
    return errors


@wp.func
def target_at(schedule: wp.array(dtype=vec4), task: Task, sample: int, lead: int) -> SpeedTarget:
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
def pedals(car: CarParameters, force: real, speed: real) -> vec2:
    """Drive and brake force asked for, N, within what the car has."""
    return vec2(
        wp.clamp(force, real(0.0), most_drive(car, speed)),
        wp.clamp(-force, real(0.0), car.max_brake_force),
    )


@wp.func
def rolled(task: Task, road: Road, state: State, station: real, dt: real) -> real:
    """The path's point nearest to the car, by one Newton step; the distance driven if there is no path."""
    if task.open_loop == 1:
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
def row_of(car: CarParameters, state: State, cue: Cue, road: Road, command: Commands) -> Row:
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
    row[17] = command.drive / car.max_drive_force
    row[18] = command.brake / car.max_brake_force
    row[19] = cue.road_acceleration[0]
    row[20] = cue.road_acceleration[1]
    row[21] = road.slope.grade
    row[22] = offset_from(road, state)[1]
    return row


@wp.func
def decide(
    car: CarParameters,
    driver: DriverParameters,
    task: Task,
    state: State,
    errors: Errors,
    station: real,
    target: SpeedTarget,
    wheel: real,
    slope: Slope,
) -> Commands:
    """What the driver asks for, held for one integration step."""
    command = Commands()
    force = force_command(car, driver, state[FORWARD], station, target, slope.grade)
    asked = pedals(car, force, state[FORWARD])
    command.drive = asked[0]
    command.brake = asked[1]
    command.wheel_lag = driver.hand_lag
    command.wheel = wheel
    if task.open_loop == 0:
        command.wheel = wheel_command(car, driver, state, errors)
    command.grade = slope.grade
    command.grade_per_metre = slope.per_metre
    return command


@wp.kernel
def drive_all(
    cars: wp.array(dtype=CarParameters),
    drivers: wp.array(dtype=DriverParameters),
    tasks: wp.array(dtype=Task),
    paths: wp.array(dtype=vec6),
    schedule: wp.array(dtype=vec4),
    substeps: int,
    result: wp.array(dtype=Row),
) -> None:
    """Thread i drives ``tasks[i]`` with ``cars[i]`` and ``drivers[i]``; one row of ``result`` a sample."""
    i = wp.tid()
    car, driver, task = cars[i], drivers[i], tasks[i]
    dt = real(DT) / real(substeps)
    lead = int(driver.pedal_anticipation / real(DT))
    station, deflection = real(0.0), real(0.0)
    state = start_state(car, road_at(paths, task, station), schedule[task.first][0])
    for sample in range(task.samples):
        target = target_at(schedule, task, sample, lead)
        wheel = schedule[task.first + sample][3]
        for substep in range(substeps):
            road = road_at(paths, task, station)
            ahead = road_at(paths, task, station + driver.anticipation * state[FORWARD])
            errors = errors_at(road, ahead, state)
            target.position = schedule[task.first + sample][2] + target.speed * real(substep) * dt
            command = decide(car, driver, task, state, errors, station, target, wheel, road.slope)
            standing = resist(car, deflection, state, command, dt)
            command.resistance = standing[1]
            if substep == 0:
                cue = cues(car, state, derivative(car, state, command), road.slope)
                result[task.first + sample] = row_of(car, state, cue, road, command)
            deflection = standing[0]
            state = runge_kutta(car, state, command, dt)
            station = rolled(task, road_at(paths, task, station), state, station, dt)
