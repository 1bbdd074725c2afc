"""The vehicle model: single-track car with roll, pitch, tires and actuators (Warp).

Equations carry the tags of docs/reference/car.md. Velocities are those of the point B of the roll axis
under the c.g., in the plane of the road: x forward, y right, z down.
"""

from __future__ import annotations

import math
from typing import Any

import warp as wp

from ...arrays import mat33, real, vec2, vec3
from ...cues import GRAVITY

wp.set_module_options({"enable_backward": False})

vec16: Any = wp.types.vector(16, real)
"""Ratios of up to 16 gears."""

State: Any = wp.types.vector(15, real)
"""Integrated quantities of one car, by the indices below."""

X, Y, HEADING = wp.constant(0), wp.constant(1), wp.constant(2)
FORWARD, LATERAL, YAW_RATE = wp.constant(3), wp.constant(4), wp.constant(5)
ROLL, ROLL_RATE, PITCH, PITCH_RATE = wp.constant(6), wp.constant(7), wp.constant(8), wp.constant(9)
SLIP_FRONT, SLIP_REAR = wp.constant(10), wp.constant(11)
WHEEL, DRIVE, BRAKE = wp.constant(12), wp.constant(13), wp.constant(14)


@wp.struct
class CarParameters:
    """The numbers of :class:`~.vehicles.Car`, under the same names, flat."""

    mass: real
    front_axle: real
    rear_axle: real
    yaw_inertia: real
    cg_height: real
    reference_point: vec3
    sprung_mass: real
    roll_inertia: real
    pitch_inertia: real
    arm: real
    roll_stiffness: real
    roll_damping: real
    pitch_stiffness: real
    pitch_damping: real
    front_cornering_stiffness: real
    rear_cornering_stiffness: real
    friction: real
    shape_factor: real
    relaxation_length: real
    low_speed: real
    low_speed_damping: real
    ratio: real
    max_angle: real
    max_rate: real
    max_drive_force: real
    max_power: real
    max_brake_force: real
    drive_front_share: real
    brake_front_share: real
    drive_lag: real
    brake_lag: real
    drag_area: real
    rolling_resistance: real
    standstill_stiffness: real
    standstill_damping: real
    # Gearbox; no gears for a car without one.
    gears: int
    gear_ratios: vec16
    shift_speed: real
    urgency: real
    down_share: real
    gap: real
    depth: real
    closing: real
    dwell: real
    engine_braking: real
    driveline_frequency: real
    driveline_damping: real
    # Stability control; no gain for a car without one.
    stability_gain: real
    stability_moment: real


@wp.struct
class Commands:
    """What acts on the car during one integration step."""

    wheel: real  # steering-wheel angle asked for, rad
    wheel_lag: real  # time constant of the arms (or the robot), s
    drive: real  # drive force asked for, N
    brake: real  # brake force asked for, N
    resistance: real  # brakes and rolling resistance, opposing the motion, N, see (C8)
    grade: real  # slope of the road along the path, rad, uphill positive
    grade_per_meter: real  # rad/m
    bank: real  # cross slope of the road, rad, right side down positive
    driveline: real  # what gearbox and driveline add to the drive force, N, see (C15)
    yaw_moment: real  # of the stability control, N m, see (C16)


@wp.struct
class Forces:
    """Of the tires and the air, in the road's plane, and the rates of the relaxed slips."""

    x: real  # N
    front_y: real
    rear_y: real
    slip_rate_front: real  # 1/s
    slip_rate_rear: real


_LEAST_CAPACITY = 0.05
"""Share of the friction that stays lateral when all of it is used longitudinally."""


@wp.struct
class Axle:
    """One axle at one moment."""

    load: real  # F_z, N
    force: real  # F_x along the wheels, N
    stiffness: real  # C_alpha at this load, N/rad


@wp.func
def limited(value: real, bound: real) -> real:
    """The value within [-bound, bound]."""
    return wp.clamp(value, -bound, bound)


@wp.func
def lateral_capacity(axle: Axle, friction: real) -> real:
    """(C1) Friction ellipse: D = sqrt((mu F_z)^2 - F_x^2), N."""
    grip = friction * axle.load
    least = real(_LEAST_CAPACITY) * grip
    return wp.sqrt(wp.max(grip * grip - axle.force * axle.force, least * least))


@wp.func
def lateral_force(axle: Axle, friction: real, shape: real, slip: real) -> real:
    """(C2) Magic Formula F_y = D sin(C atan(B alpha)), B = C_alpha / (C D); Pacejka 2012, ch. 4. In N."""
    capacity = wp.max(lateral_capacity(axle, friction), real(1.0))
    return capacity * wp.sin(shape * wp.atan(axle.stiffness * slip / (shape * capacity)))


@wp.func
def slip_for(force: real, capacity: real, stiffness: real, shape: real) -> real:
    """(C2) inverted: the slip angle that gives this lateral force, held at 95 % of the capacity, rad."""
    share = wp.clamp(force / capacity, real(-0.95), real(0.95))
    return shape * capacity / stiffness * wp.tan(wp.asin(share) / shape)


@wp.func
def slip_rate(slip: real, along: real, across: real, relaxation_length: real) -> real:
    """(C3) Relaxation sigma dalpha/dt + |v_x| alpha = -v_y (Bernard and Clover 1995), 1/s.

    ``along`` and ``across`` are the contact patch's velocity in the wheel's plane and across it, m/s.
    """
    return (-across - wp.abs(along) * slip) / relaxation_length


@wp.func
def damped_slip(slip: real, along: real, across: real, low_speed: real, damping: real) -> real:
    """(C4) Slip with the damping a standing tire needs, fading out at ``low_speed`` (Pacejka 2012, ch. 8)."""
    speed = wp.abs(along)
    result = slip
    if speed < low_speed:
        weight = real(0.5) * (real(1.0) + wp.cos(real(math.pi) * speed / low_speed))
        result = slip - damping * weight * across
    return result


AIR_DENSITY = 1.2
"""kg/m^3, at sea level and 20 degrees."""


@wp.func
def air_drag(car: CarParameters, speed: real) -> real:
    """(C5) F = rho c_d A v |v| / 2, N."""
    return real(0.5 * AIR_DENSITY) * car.drag_area * speed * wp.abs(speed)


@wp.func
def normal_gravity(command: Commands, speed: real) -> real:
    """(C6) Gravity and the centripetal acceleration of crests and dips, normal to the road, m/s^2."""
    return (
        real(GRAVITY) * wp.cos(command.grade) * wp.cos(command.bank) + command.grade_per_meter * speed * speed
    )


@wp.func
def axle_loads(car: CarParameters, gravity: real, traction: real) -> vec2:
    """(C7) Static loads and the transfer F_x h / L from front to rear, N."""
    wheelbase = car.front_axle + car.rear_axle
    transfer = traction * car.cg_height / wheelbase
    front = car.mass * gravity * car.rear_axle / wheelbase - transfer
    rear = car.mass * gravity * car.front_axle / wheelbase + transfer
    return vec2(wp.max(front, real(0.0)), wp.max(rear, real(0.0)))


STABILITY_GRIP = 0.93
"""Share of an axle's grip that anti-lock brakes and traction control use, so that it still steers."""


@wp.func
def usable_grip(car: CarParameters, load: real) -> real:
    """Largest longitudinal force of an axle, N: its grip; less with a stability control."""
    grip = car.friction * load
    if car.stability_gain > real(0.0):
        return real(STABILITY_GRIP) * grip
    return grip


@wp.func
def front_share(car: CarParameters, load: vec2) -> real:
    """Front axle's share of the brake force: the car's; with a stability control as its share of the load."""
    if car.stability_gain > real(0.0):
        return load[0] / wp.max(load[0] + load[1], real(1.0))
    return car.brake_front_share


@wp.func
def most_resistance(car: CarParameters, brake: real, command: Commands, speed: real) -> real:
    """Largest resisting force of brakes (ideal anti-lock: never beyond friction) and rolling, N."""
    gravity = normal_gravity(command, speed)
    load = axle_loads(car, gravity, -brake)
    share = front_share(car, load)
    front = wp.min(brake * share, usable_grip(car, load[0]))
    rear = wp.min(brake * (real(1.0) - share), usable_grip(car, load[1]))
    return front + rear + car.rolling_resistance * car.mass * gravity


@wp.func
def solve_pair(mass: real, coupling: real, inertia: real, force: real, moment: real) -> vec2:
    """Solve [mass, coupling; coupling, inertia] [a; w] = [force; moment]."""
    determinant = mass * inertia - coupling * coupling
    return vec2(
        (inertia * force - coupling * moment) / determinant, (mass * moment - coupling * force) / determinant
    )


@wp.func
def front_axle(car: CarParameters, load: real, share: real, state: State, command: Commands) -> Axle:
    """Load, longitudinal force and stiffness of the front axle; the force is held within friction.

    ``share`` is the front axle's of the brakes.
    """
    axle = Axle()
    static = car.mass * real(GRAVITY) * car.rear_axle / (car.front_axle + car.rear_axle)
    drive = state[DRIVE] + command.driveline
    force = drive * car.drive_front_share - command.resistance * share
    axle.load = load
    axle.force = limited(force, usable_grip(car, load))
    axle.stiffness = car.front_cornering_stiffness * load / static
    return axle


@wp.func
def rear_axle(car: CarParameters, load: real, share: real, state: State, command: Commands) -> Axle:
    """The same of the rear axle."""
    axle = Axle()
    static = car.mass * real(GRAVITY) * car.front_axle / (car.front_axle + car.rear_axle)
    force = (state[DRIVE] + command.driveline) * (real(1.0) - car.drive_front_share)
    force = force - command.resistance * (real(1.0) - share)
    axle.load = load
    axle.force = limited(force, usable_grip(car, load))
    axle.stiffness = car.rear_cornering_stiffness * load / static
    return axle


@wp.func
def axle_force(car: CarParameters, axle: Axle, slip: real, along: real, across: real) -> real:
    """Lateral force of an axle with its relaxed and damped slip, N."""
    alpha = damped_slip(slip, along, across, car.low_speed, car.low_speed_damping)
    return lateral_force(axle, car.friction, car.shape_factor, alpha)


@wp.func
def body_moments(car: CarParameters, state: State, gravity: real) -> vec2:
    """(C11) Springs, dampers and toppling weight in roll and pitch, N m."""
    topple = car.sprung_mass * gravity * car.arm
    roll = -car.roll_damping * state[ROLL_RATE] - (car.roll_stiffness - topple) * state[ROLL]
    pitch = -car.pitch_damping * state[PITCH_RATE] - (car.pitch_stiffness - topple) * state[PITCH]
    return vec2(roll, pitch)


@wp.func
def actuator_rates(car: CarParameters, state: State, command: Commands) -> vec3:
    """(C12) First-order lags of steering wheel (rate-limited), drive and brake force."""
    wheel = (limited(command.wheel, car.max_angle) - state[WHEEL]) / command.wheel_lag
    drive = (command.drive - state[DRIVE]) / car.drive_lag
    brake = (command.brake - state[BRAKE]) / car.brake_lag
    return vec3(limited(wheel, car.max_rate), drive, brake)


@wp.func
def tire_forces(car: CarParameters, state: State, command: Commands) -> Forces:
    """(C9) Forces of both axles in the plane of the road, and the rates of their slips."""
    u, r = state[FORWARD], state[YAW_RATE]
    delta = state[WHEEL] / car.ratio
    c, s = wp.cos(delta), wp.sin(delta)
    load = axle_loads(car, normal_gravity(command, u), state[DRIVE] + command.driveline - command.resistance)
    share = front_share(car, load)
    front = front_axle(car, load[0], share, state, command)
    rear = rear_axle(car, load[1], share, state, command)

    # Velocity of the contact patches along and across the wheels.
    front_v = state[LATERAL] + car.front_axle * r
    along, across = u * c + front_v * s, front_v * c - u * s
    rear_v = state[LATERAL] - car.rear_axle * r
    f_yf = axle_force(car, front, state[SLIP_FRONT], along, across)

    forces = Forces()
    forces.x = front.force * c - f_yf * s + rear.force - air_drag(car, u)
    forces.front_y = front.force * s + f_yf * c
    forces.rear_y = axle_force(car, rear, state[SLIP_REAR], u, rear_v)
    forces.slip_rate_front = slip_rate(state[SLIP_FRONT], along, across, car.relaxation_length)
    forces.slip_rate_rear = slip_rate(state[SLIP_REAR], u, rear_v, car.relaxation_length)
    return forces


@wp.func
def derivative(car: CarParameters, state: State, command: Commands) -> State:
    """Equations of motion (C9) to (C12): the state's time derivative."""
    u, v, r = state[FORWARD], state[LATERAL], state[YAW_RATE]
    forces = tire_forces(car, state, command)
    moments = body_moments(car, state, normal_gravity(command, u))

    # (C10) The body's roll and pitch accelerations react on the car's. The slope's share of gravity acts on
    # every mass alike, so that it drops out of the coupling.
    arm = car.sprung_mass * car.arm
    roll_inertia = car.roll_inertia + arm * car.arm
    pitch_inertia = car.pitch_inertia + arm * car.arm
    sideways = solve_pair(car.mass, arm, roll_inertia, forces.front_y + forces.rear_y, moments[0])
    lengthways = solve_pair(car.mass, -arm, pitch_inertia, forces.x, moments[1])
    rates = actuator_rates(car, state, command)

    d = State()
    flat = u * wp.cos(command.grade)
    d[X] = flat * wp.cos(state[HEADING]) - v * wp.sin(state[HEADING])
    d[Y] = flat * wp.sin(state[HEADING]) + v * wp.cos(state[HEADING])
    d[HEADING] = r
    d[FORWARD] = lengthways[0] - real(GRAVITY) * wp.sin(command.grade) + v * r
    d[LATERAL] = sideways[0] - u * r + real(GRAVITY) * wp.cos(command.grade) * wp.sin(command.bank)
    moment = car.front_axle * forces.front_y - car.rear_axle * forces.rear_y
    d[YAW_RATE] = (moment + command.yaw_moment) / car.yaw_inertia
    d[ROLL] = state[ROLL_RATE]
    d[ROLL_RATE] = sideways[1]
    d[PITCH] = state[PITCH_RATE]
    d[PITCH_RATE] = lengthways[1]
    d[SLIP_FRONT] = forces.slip_rate_front
    d[SLIP_REAR] = forces.slip_rate_rear
    d[WHEEL] = rates[0]
    d[DRIVE] = rates[1]
    d[BRAKE] = rates[2]
    return d


@wp.func
def runge_kutta(car: CarParameters, state: State, command: Commands, dt: real) -> State:
    """One step of the classical fourth-order method with the commands held."""
    half = real(0.5) * dt
    k1 = derivative(car, state, command)
    k2 = derivative(car, state + half * k1, command)
    k3 = derivative(car, state + half * k2, command)
    k4 = derivative(car, state + dt * k3, command)
    return state + (dt / real(6.0)) * (k1 + real(2.0) * k2 + real(2.0) * k3 + k4)


@wp.func
def resist(car: CarParameters, deflection: real, state: State, command: Commands, dt: real) -> vec2:
    """(C8) Brakes and rolling resistance as an elastic, perfectly plastic element (Prandtl's; Dahl 1968).

    Sliding, it gives its full force; standing, it is a damped spring, so that a stop ends with a jerk, does
    not chatter, and a slope is held. Returns the new deflection, m, and the force, N.
    """
    most = most_resistance(car, state[BRAKE], command, state[FORWARD])
    stiffness = car.mass * car.standstill_stiffness
    limit = most / stiffness
    after = limited(deflection + state[FORWARD] * dt, limit)
    force = stiffness * after + car.mass * car.standstill_damping * (after - deflection) / dt
    return vec2(after, limited(force, most))


@wp.struct
class Gear:
    """The gearbox of a car at one moment."""

    number: int  # from 0, the lowest
    time: real  # since the last shift began, s
    force: real  # that the driveline passes to the wheels, N
    force_rate: real  # N/s


@wp.func
def most_drive(car: CarParameters, speed: real) -> real:
    """Largest drive force at this speed: traction-limited, then power-limited, N."""
    return wp.min(car.max_drive_force, car.max_power / wp.max(speed, real(1.0)))


@wp.func
def engine_speed(car: CarParameters, number: int, speed: real) -> real:
    """Speed at which the lowest gear would turn the engine as fast as this gear does, m/s."""
    return speed * car.gear_ratios[number] / car.gear_ratios[0]


@wp.func
def shifted(car: CarParameters, gear: Gear, pace: real, state: State, dt: real) -> Gear:
    """(C15) Up where the engine turns faster than the throttle asks for, down where it turns slower.

    ``pace`` is a factor on the time a shift takes.
    """
    gear.time += dt
    if gear.time < pace * (car.gap + car.closing) + car.dwell:
        return gear
    speed = wp.max(state[FORWARD], real(0.0))
    demand = wp.clamp(state[DRIVE] / most_drive(car, speed), real(0.0), real(1.0))
    most = car.shift_speed * (real(1.0) + car.urgency * demand)
    if gear.number < car.gears - 1 and engine_speed(car, gear.number, speed) > most:
        gear.number += 1
        gear.time = real(0.0)
    elif gear.number > 0 and engine_speed(car, gear.number - 1, speed) < car.down_share * most:
        gear.number -= 1
        gear.time = real(0.0)
    return gear


@wp.func
def first_gear(car: CarParameters, speed: real) -> Gear:
    """The gear of a car that rolls evenly, long after its last shift."""
    gear = Gear()
    for k in range(car.gears - 1):
        if engine_speed(car, k, speed) > car.shift_speed:
            gear.number = k + 1
    gear.time = real(1.0e3)
    return gear


@wp.func
def engaged(car: CarParameters, gear: Gear, pace: real) -> real:
    """Share of the drive force that the clutches pass: 1 - depth for the gap, then closing evenly."""
    after = gear.time - pace * car.gap
    closed = wp.clamp(after / (pace * car.closing), real(0.0), real(1.0))
    return real(1.0) - car.depth * (real(1.0) - closed)


@wp.func
def transmitted(car: CarParameters, gear: Gear, pace: real, drive: real, dt: real) -> Gear:
    """The driveline, elastic between clutch and tires: a second-order mode of the force, N."""
    w = car.driveline_frequency
    target = engaged(car, gear, pace) * drive
    gear.force_rate += dt * (
        w * w * (target - gear.force) - real(2.0) * car.driveline_damping * w * gear.force_rate
    )
    gear.force += dt * gear.force_rate
    return gear


IDLE = 0.4
"""Share of the speed of shifting up below which an engine no longer brakes (engineering choice)."""


@wp.func
def engine_brake(car: CarParameters, gear: Gear, speed: real) -> real:
    """Largest drag of the engine with the throttle closed, N; none where the clutch opens before a stop."""
    if car.gears == 0:
        return real(0.0)
    turning = wp.clamp(
        engine_speed(car, gear.number, speed) / (real(IDLE) * car.shift_speed), real(0.0), real(1.0)
    )
    return car.mass * car.engine_braking * turning * car.gear_ratios[gear.number] / car.gear_ratios[0]


@wp.func
def stabilizing_moment(car: CarParameters, state: State) -> real:
    """(C16) Yaw moment of single braked wheels against a yaw rate beyond what the wheel asks for, N m."""
    u = state[FORWARD]
    if car.stability_gain == real(0.0) or u < real(STABILITY_FROM):
        return real(0.0)
    wheelbase = car.front_axle + car.rear_axle
    understeer = car.mass / wheelbase
    understeer *= (
        car.rear_axle / car.front_cornering_stiffness - car.front_axle / car.rear_cornering_stiffness
    )
    wanted = u * state[WHEEL] / car.ratio / (wheelbase + understeer * u * u)
    wanted = limited(wanted, car.friction * real(GRAVITY) / u)
    excess = state[YAW_RATE] - wanted
    excess = excess - limited(excess, real(STABILITY_DEAD_BAND))
    if excess * state[YAW_RATE] < real(0.0):
        return real(0.0)  # understeer: left to the driver
    return limited(-car.stability_gain * excess, car.stability_moment)


STABILITY_FROM = 5.0
"""Speed from which the stability control acts, m/s (engineering choice)."""

STABILITY_DEAD_BAND = 0.03
"""Error of the yaw rate that it leaves alone, rad/s (engineering choice)."""


@wp.struct
class Slope:
    """The road under the car, along its path."""

    grade: real  # rad, uphill positive
    per_meter: real  # rad/m
    per_square_meter: real  # rad/m^2
    bank: real  # cross slope, rad, right side down positive
    bank_per_meter: real  # rad/m
    bank_per_square_meter: real  # rad/m^2


@wp.struct
class Cue:
    """Cues at the origin of F_A, in F_A."""

    specific_force: vec3  # m/s^2
    angular_velocity: vec3  # rad/s
    angular_acceleration: vec3  # rad/s^2
    road_acceleration: vec3  # of point B in the road's frame, m/s^2


@wp.func
def road_to_body(roll: real, pitch: real) -> mat33:
    """Components in the road's frame to those in the body's: pitch first, then roll."""
    cr, sr, cp, sp = wp.cos(roll), wp.sin(roll), wp.cos(pitch), wp.sin(pitch)
    zero = real(0.0)
    return mat33(cp, zero, -sp, sr * sp, cr, sr * cp, cr * sp, -sr, cr * cp)


@wp.func
def cues(car: CarParameters, state: State, rate: State, slope: Slope) -> Cue:
    """(C13), (C14) Rigid-body kinematics from point B to the reference point; exact for any angle."""
    u, v, r = state[FORWARD], state[LATERAL], state[YAW_RATE]
    zero = real(0.0)
    turn = road_to_body(state[ROLL], state[PITCH])

    # The road's frame yaws with the car, pitches with the slope and rolls with the bank.
    tilt = slope.per_meter * u
    tilting = slope.per_square_meter * u * u + slope.per_meter * rate[FORWARD]
    lean = slope.bank_per_meter * u
    leaning = slope.bank_per_square_meter * u * u + slope.bank_per_meter * rate[FORWARD]
    carried = turn * vec3(lean, tilt, r)
    carried_rate = turn * vec3(leaning, tilting, rate[YAW_RATE])
    acceleration = vec3(rate[FORWARD] - v * r, rate[LATERAL] + u * r, lean * v - tilt * u)

    # The body's own rotation in that frame.
    c, s = wp.cos(state[ROLL]), wp.sin(state[ROLL])
    p, q = state[ROLL_RATE], state[PITCH_RATE]
    own = vec3(p, q * c, -q * s)
    own_rate = vec3(rate[ROLL_RATE], rate[PITCH_RATE] * c - q * s * p, -rate[PITCH_RATE] * s - q * c * p)

    cue = Cue()
    cue.angular_velocity = carried + own
    cue.angular_acceleration = carried_rate - wp.cross(own, carried) + own_rate
    level = wp.cos(slope.grade)
    gravity = real(GRAVITY) * vec3(
        -wp.sin(slope.grade), level * wp.sin(slope.bank), level * wp.cos(slope.bank)
    )
    point = car.reference_point - vec3(zero, zero, car.arm)
    swing = wp.cross(cue.angular_velocity, wp.cross(cue.angular_velocity, point))
    cue.specific_force = turn * (acceleration - gravity) + wp.cross(cue.angular_acceleration, point) + swing
    cue.road_acceleration = acceleration
    return cue
