"""Simulation of plans: a batch of cars driven by the kernel, as cue traces, and what a rough road adds.

**Road roughness.** Each of two wheel tracks is Gaussian with the spectrum of ISO 8608, G(n) =
G(n0) (n / n0)^-2 with n0 = 0.1 1/m. The body heaves, pitches and rolls on its springs by what is between the
wheels; the motion is small, so that its cues are added to those of the smooth road.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.signal import butter, cont2discrete, lfilter, sosfilt, ss2tf

from ..arrays import FLOAT, real
from ..cues import GRAVITY, CueTrace
from ..errors import DataError
from ..road import RoadMap, Route
from .kernels.driver import (
    COLUMNS,
    MEMORY,
    ROBOT_LAG,
    SUBSTEPS,
    Driver,
    DriverParameters,
    PathRow,
    Row,
    ScheduleRow,
    Task,
    drive_all,
)
from .kernels.vehicle import CarParameters, vec16
from .plans import DT, Floats, Path, Schedule, clothoids
from .vehicles import MOST_GEARS, Car

SPACING: Final = 0.1
"""Between the points of a track, m: what a tire levels out."""

_REFERENCE: Final = 0.1
"""n0, 1/m."""

_LONGEST: Final = 0.01
"""Spatial frequency below which a track is level on the whole, 1/m; slopes are the path's."""

_TRACK: Final = 0.85
"""Distance of the wheels of an axle over the car's width (engineering choice)."""

_HEAVE: Final = (2.0 * np.pi * 1.3, 0.3)
"""Natural frequency of heave, rad/s, and its damping ratio (engineering choice, of the usual size)."""


@dataclass(frozen=True, eq=False)
class RoadRoughness:
    """Heights of the road under the wheels, m, positive upwards, every :data:`SPACING` of the way.

    Args:
        left: (n,) of the left track.
        right: (n,) of the right one.
        harshness: Share of the wheels' speed that the dampers pass on to the body, 0 to 1.
    """

    left: Floats
    right: Floats
    harshness: float = 0.0

    @classmethod
    def drawn(cls, roughness: float, length: float, rng: np.random.Generator) -> RoadRoughness:
        """Tracks of a roughness G(n0), m^3, over a length, m.

        Half of the spectrum is common to both, half is each track's own where waves are shorter than a car is
        wide, and less where they are longer: a road that leans a little, not a twisted one.
        """
        points = int(np.ceil(length / SPACING)) + 1
        common = _brownian(0.5 * roughness, _LONGEST, points, rng)
        own = _brownian(0.5 * roughness, _REFERENCE, points, rng)
        return cls(common + own, common - own)

    def under(self, distance: Floats) -> tuple[Floats, Floats]:
        """Heights of the left and the right track at distances (n,), m; beyond its ends as there."""
        stations = SPACING * np.arange(len(self.left))
        return np.interp(distance, stations, self.left), np.interp(distance, stations, self.right)


def _brownian(roughness: float, corner: float, points: int, rng: np.random.Generator) -> Floats:
    """Heights with the spectrum of ISO 8608 above a corner, 1/m, and a level one below it."""
    decay = np.exp(-2.0 * np.pi * corner * SPACING)
    variance = 0.5 * np.pi * roughness * _REFERENCE**2 / corner
    drive = np.sqrt(variance * (1.0 - decay**2)) * rng.normal(size=points)
    start = np.sqrt(variance) * rng.normal()
    return np.asarray(lfilter([1.0], [1.0, -decay], drive, zi=[decay * start])[0])


@dataclass(frozen=True, eq=False)
class Shaking:
    """The cues that a rough road adds, (n, 3) each, as :class:`~..cues.CueTrace` has them."""

    force: Floats
    rate: Floats
    rate_derivative: Floats


def shaking(car: Car, road: RoadRoughness, distance: Floats, dt: float) -> Shaking:
    """What a road adds where the c.g. is at distances (n,), m, one a time step ``dt``, s.

    x forward, y right, z down; positive pitch lifts the nose, positive roll lowers the right side.
    """
    front_left, front_right = road.under(distance + car.front_axle)
    rear_left, rear_right = road.under(distance - car.rear_axle)
    front, rear = 0.5 * (front_left + front_right), 0.5 * (rear_left + rear_right)
    left, right = 0.5 * (front_left + rear_left), 0.5 * (front_right + rear_right)
    heave, pitch, roll = (
        0.5 * (front + rear),
        (front - rear) / car.wheelbase,
        (left - right) / (_TRACK * car.width),
    )

    body, passed = car.suspension, road.harshness
    weight = body.sprung_mass * GRAVITY * body.arm
    _, _, up = _sprung(heave, *_HEAVE, dt, passed)
    phi, p, p_dot = _sprung(
        roll, *_mode(body.roll_stiffness - weight, body.roll_damping, body.roll_inertia), dt, passed
    )
    theta, q, q_dot = _sprung(
        pitch, *_mode(body.pitch_stiffness - weight, body.pitch_damping, body.pitch_inertia), dt, passed
    )
    zero = np.zeros_like(distance)
    rate_derivative = np.column_stack((p_dot, q_dot, zero))
    # The body turns about the point of the roll axis under the c.g.; f = a - g.
    point = np.array(car.reference_point) - np.array([0.0, 0.0, body.arm])
    force = np.cross(rate_derivative, point)
    force += np.column_stack((GRAVITY * theta, -GRAVITY * phi, -up))
    return Shaking(force, np.column_stack((p, q, zero)), rate_derivative)


def _mode(stiffness: float, damping: float, inertia: float) -> tuple[float, float]:
    """Natural frequency, rad/s, and damping ratio."""
    frequency = float(np.sqrt(stiffness / inertia))
    return frequency, damping / (2.0 * inertia * frequency)


def _sprung(
    base: Floats, frequency: float, ratio: float, dt: float, passed: float = 0.0
) -> tuple[Floats, Floats, Floats]:
    """A body's motion, its rate and acceleration on a spring whose other end moves as ``base`` (n,).

    y'' = w^2 (u - y) + 2 z w (k u' - y'), from rest, exact for a base that moves evenly between samples, with
    k the share ``passed``: waves shorter than a car are for the most part leveled out by tires and bushings,
    and an axle that hops follows only to :data:`_HOP`.
    """
    offset = base - base[0]
    if passed > 0.0:
        offset = np.asarray(sosfilt(butter(2, _HOP, fs=1.0 / dt, output="sos"), offset))
    damping = 2.0 * ratio * frequency
    # With q = y' - 2 z w k u the derivative of the base is not needed.
    a = np.array([[0.0, 1.0], [-(frequency**2), -damping]])
    b = np.array([[passed * damping], [frequency**2 - passed * damping**2]])
    c = np.vstack((np.eye(2), a[1]))
    d = np.array([[0.0], [passed * damping], [frequency**2 - passed * damping**2]])
    numerators, denominator = ss2tf(*cont2discrete((a, b, c, d), dt, method="foh")[:4])
    y, rate, acceleration = (lfilter(n, denominator, offset) for n in numerators)
    if passed > 0.0:
        acceleration = acceleration + passed * damping * np.gradient(offset, dt)
    return y, rate, acceleration


_HOP: Final = 10.0
"""Frequency up to which a wheel follows the road and hands its speed to the damper, Hz."""


ROBOT: Final = Driver(hand_lag=ROBOT_LAG)
"""A steering robot: keeps the speed as a driver does, and turns the wheel as told, within 20 ms."""

_SPEED: Final = COLUMNS.index("speed_m_s")


@dataclass(frozen=True, eq=False)
class Plan:
    """What a car is to do.

    Args:
        name: Of the trace that comes out.
        car: Which car.
        path: The line to follow.
        schedule: The speed over time.
        steering: (n,) steering-wheel angles, rad, instead of following the path; one a sample of the
            schedule. NaN where the driver follows the path: the driver then goes on from where the car is,
            and the rest of the path lies there.
        driver: Who drives; the default driver, or a :data:`ROBOT` where ``steering`` is given.
        roughness: Of the road; None for a smooth one.
        source: For reports.
        route: What is known of the road; the whole path, and its stops, if None.
        seed: Of the driver's errors by chance.
    """

    name: str
    car: Car
    path: Path
    schedule: Schedule
    steering: Floats | None = None
    driver: Driver | None = None
    roughness: RoadRoughness | None = None
    source: str = field(default="")
    route: Route | None = None
    seed: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        if self.steering is None:
            return
        if self.steering.shape != self.schedule.speed.shape or not np.isfinite(self.steering).any():
            raise DataError(f"{self.name}: steering must be {len(self.schedule)} finite angles, one a sample")

    @property
    def known_route(self) -> Route:
        """What is known of the road: what was given, or the path and the largest planned speed."""
        if self.route is not None:
            return self.route
        return Route.of_road(self.path.curvature, float(self.schedule.speed.max()))

    @property
    def follows(self) -> NDArray[np.bool_]:
        """(n,) whether the driver follows the path."""
        if self.steering is None:
            return np.ones(len(self.schedule), dtype=bool)
        return np.isnan(self.steering)

    @property
    def chosen_driver(self) -> Driver:
        """The driver, or the default one for this kind of plan."""
        if self.driver is not None:
            return self.driver
        return Driver() if self.follows.any() else ROBOT


def straight(length: float = 1.0) -> Path:
    """A straight, level path."""
    return Path.of_curvature(clothoids([(0.0, 0.0)], length))


def simulate(plans: Sequence[Plan], device: str = "cpu") -> list[CueTrace]:
    """Drive every plan, all in one kernel launch.

    Returns:
        One trace a plan, sampled at 100 Hz, at the origin of F_A, with the channels
        :data:`~.drive_kernel.COLUMNS`: accelerations are those of the point of the roll axis under the c.g.,
        in the road's frame; ``path_offset_m`` is the distance to the right of the path; throttle and brake
        are shares; ``gear`` is there for cars that have a gearbox, ``station_m`` is the way along the path.
        On a rough road its shaking is added to all three cues. What is known of the road is the trace's
        ``road``.

    Raises:
        DataError: the car left the range of the model (a plan no car can follow).
    """
    if not plans:
        return []
    rows = _launch(plans, device)
    starts = np.cumsum([0, *(len(plan.schedule) for plan in plans)])
    return [_trace(plan, rows[a:b]) for plan, a, b in zip(plans, starts[:-1], starts[1:], strict=True)]


def _launch(plans: Sequence[Plan], device: str) -> Floats:
    tasks = _tasks(plans)
    cars = [_parameters(plan.car) for plan in plans]
    drivers = [fill(DriverParameters(), plan.chosen_driver) for plan in plans]
    schedule = np.concatenate([_schedule_rows(plan) for plan in plans])
    paths = np.concatenate([plan.path.table() for plan in plans])
    result = wp.zeros(len(schedule), dtype=Row, device=device)
    inputs = [
        wp.array(cars, dtype=CarParameters, device=device),
        wp.array(drivers, dtype=DriverParameters, device=device),
        wp.array(tasks, dtype=Task, device=device),
        wp.array(paths.astype(FLOAT), dtype=PathRow, device=device),
        wp.array(schedule.astype(FLOAT), dtype=ScheduleRow, device=device),
        wp.zeros((len(plans), MEMORY), dtype=real, device=device),
    ]
    wp.launch(drive_all, len(plans), inputs=[*inputs, SUBSTEPS], outputs=[result], device=device)
    return np.asarray(result.numpy(), dtype=np.float64)


def _tasks(plans: Sequence[Plan]) -> list[Any]:
    tasks, path_start, first = [], 0, 0
    for plan in plans:
        task = Task()
        task.path_start, task.path_points = path_start, len(plan.path)
        task.first, task.samples = first, len(plan.schedule)
        task.open_loop = int(not plan.follows.any())
        tasks.append(task)
        path_start += len(plan.path)
        first += len(plan.schedule)
    return tasks


def _parameters(car: Car) -> Any:
    """The kernel's numbers of a car; gearbox and stability control are none where the car has none."""
    parameters = fill(CarParameters(), car)
    if car.gearbox is not None:
        ratios = car.gearbox.ratios
        parameters.gears = len(ratios)
        parameters.gear_ratios = vec16(*ratios, *[ratios[-1]] * (MOST_GEARS - len(ratios)))
    return parameters


def _schedule_rows(plan: Plan) -> Floats:
    schedule, follows = plan.schedule, plan.follows
    steering = np.zeros(len(schedule)) if plan.steering is None else np.where(follows, 0.0, plan.steering)
    rows = np.column_stack((schedule.speed, schedule.acceleration, schedule.distance, steering, ~follows))
    return np.hstack((rows, errors_of(plan.chosen_driver, len(schedule), plan.seed)))


def errors_of(driver: Driver, samples: int, seed: tuple[int, ...]) -> Floats:
    """(n, 3) errors of a driver by chance: of the line, m, of the wheel, rad, of the acceleration, m/s^2.

    Gaussian, filtered twice by first-order low-passes: line and acceleration with the driver's
    ``wander_time``, the wheel with :data:`TREMBLING`. They begin at zero.
    """
    if not driver.errs:
        return np.zeros((samples, 3))
    rng = np.random.default_rng(seed)
    spreads = (driver.lane_wander, driver.steering_noise, driver.pedal_noise)
    times = (driver.wander_time, TREMBLING, 0.5 * driver.wander_time)
    return np.column_stack(
        [spread * _colored(rng, samples, time) for spread, time in zip(spreads, times, strict=True)]
    )


TREMBLING: Final = 0.2
"""Correlation time of errors of the steering wheel, s (engineering choice)."""

FADE_IN: Final = 3.0
"""Time in which a driver's errors grow to their size, so that drives begin calm, s."""


def _colored(rng: np.random.Generator, samples: int, time: float) -> Floats:
    """Noise of unit variance through two first-order low-passes of a time constant, s, from 0 on."""
    decay = np.exp(-DT / time)
    # Variance of white noise after (1 - d)^2 / (1 - d z^-1)^2.
    power = (1.0 - decay) ** 4 * (1.0 + decay**2) / (1.0 - decay**2) ** 3
    noise = lfilter([(1.0 - decay) ** 2], [1.0, -2.0 * decay, decay**2], rng.normal(size=samples))
    fade = np.clip(DT * np.arange(samples) / FADE_IN, 0.0, 1.0)
    return np.asarray(fade**2 * noise / np.sqrt(power))


def fill(target: Any, source: Any) -> Any:
    """Copy the numbers of a configuration, and of those inside it, to the fields of a Warp struct by name."""
    for item in dataclasses.fields(source):
        value = getattr(source, item.name)
        if dataclasses.is_dataclass(value):
            fill(target, value)
        elif hasattr(target, item.name):
            setattr(target, item.name, value)
    return target


def _trace(plan: Plan, rows: Floats) -> CueTrace:
    if not np.isfinite(rows).all():
        raise DataError(
            f"{plan.name}: {plan.car.name} left the range of the vehicle model; ask for less speed or bend"
        )
    force, rate, rate_derivative = rows[:, 0:3], rows[:, 3:6], rows[:, 6:9]
    if plan.roughness is not None:
        distance = np.cumsum(DT * rows[:, 9 + _SPEED])
        added = shaking(plan.car, plan.roughness, distance, DT)
        force, rate = force + added.force, rate + added.rate
        rate_derivative = rate_derivative + added.rate_derivative
    channels = {name: rows[:, 9 + k] for k, name in enumerate(COLUMNS)}
    if plan.car.gearbox is None:
        del channels["gear"]
    return CueTrace(
        name=plan.name,
        time=np.asarray(DT * np.arange(len(rows)), dtype=np.float64),
        specific_force=force,
        angular_velocity=rate,
        angular_acceleration=rate_derivative,
        channels=channels,
        source=plan.source or f"{plan.car.name}, vehicle model",
        road=RoadMap.of_route(
            plan.known_route,
            plan.path.grade,
            plan.path.bank,
            channels["station_m"],
            channels["speed_m_s"],
        ),
    )
