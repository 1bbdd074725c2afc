"""Random roads of several kinds, and the speed along a path.

A road is stretches of curvature, speed limits and stops, one behind another. The speed is as high as bends
and limits allow, with a driver's accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ..car.kernels.vehicle import AIR_DENSITY
from ..car.plans import DT, HOLD, STEP, Schedule, bend
from ..car.vehicles import Car
from ..cues import GRAVITY
from ..errors import DataError
from .circuits import Circuit, random_circuit

Floats = NDArray[np.float64]

SMOOTHING: Final = 0.7
"""Width of the moving average, taken twice, that bounds the planned jerk, s."""

CREEP: Final = 0.5
"""Below this planned speed, before and after a stop, the car is held by the brake, m/s."""


@dataclass(frozen=True)
class Style:
    """How briskly somebody drives, m/s^2.

    Args:
        accelerate: Largest acceleration.
        brake: Largest deceleration.
        lateral: Largest centripetal acceleration in a bend.
    """

    accelerate: float
    brake: float
    lateral: float


def speed_limit(curvature: Floats, limit: Floats, style: Style) -> Floats:
    """Limit (n,), m/s, at every point: the road's, and that of the bend, sqrt(a / |kappa|)."""
    return np.minimum(limit, np.sqrt(style.lateral / np.maximum(np.abs(curvature), 1e-9)))


def along_path(
    limit: Floats,
    style: Style,
    stops: Sequence[tuple[int, float]],
    duration: float | None,
    smoothing: float = SMOOTHING,
    ability: Ability | None = None,
) -> Schedule:
    """The schedule of a path with a speed limit (n,), m/s, at each of its points.

    Args:
        limit: From the start on; the drive begins at the first limit.
        style: The driver's.
        stops: Point of the path and time to stand there, s, for each stop.
        duration: Of the drive, s: cut there; to the end of the path if None.
        smoothing: Width of the moving average of the speed, taken twice, s.
        ability: What the car can do on this path; whatever the style asks for if None.

    Raises:
        DataError: the path ends before ``duration``.
    """
    points = [point for point, _ in stops]
    reach = _reachable if ability is None else partial(_reachable_by, ability)
    speed = reach(limit, style, points)
    step = 2.0 * STEP / np.maximum(speed[1:] + speed[:-1], 1e-6)
    arrival = np.concatenate(([0.0], np.cumsum(step)))
    nodes, speeds = arrival, speed
    for point, wait in sorted(stops, reverse=True):
        # A second node at the same place, `wait` later: the time between is spent standing.
        nodes = np.concatenate((nodes[: point + 1], nodes[point:] + wait))
        speeds = np.concatenate((speeds[: point + 1], speeds[point:]))
    end = nodes[-1] if duration is None else duration
    if nodes[-1] < end - DT:
        raise DataError(f"the path ends after {nodes[-1]:.1f} s, before the drive of {end:.1f} s")
    time = DT * np.arange(round(end / DT) + 1)
    return _smoothed(np.interp(time, nodes, speeds), smoothing)


def _reachable(limit: Floats, style: Style, stops: Sequence[int]) -> Floats:
    """Forward and backward pass: v^2 grows by at most 2 a ds. (n,) m/s."""
    square = (limit**2).tolist()
    for point in stops:
        square[point] = 0.0
    gain, loss = 2.0 * style.accelerate * STEP, 2.0 * style.brake * STEP
    for i in range(1, len(square)):
        square[i] = min(square[i], square[i - 1] + gain)
    for i in range(len(square) - 2, -1, -1):
        square[i] = min(square[i], square[i + 1] + loss)
    return np.asarray(np.sqrt(np.array(square)))


@dataclass(frozen=True, eq=False)
class Ability:
    """What a car can do along a path, so that plans keep within it.

    Args:
        car: The car.
        curvature: (n,) of the path, 1/m.
        grade: (n,) of the path, rad.
    """

    car: Car
    curvature: Floats
    grade: Floats

    @classmethod
    def style(cls, style: Style, car: Car) -> Style:
        """The style, within the car's grip, brakes and rollover threshold T / (2 h)."""
        grip = MOST_GRIP * car.tires.friction * GRAVITY
        drivetrain = car.drivetrain
        share = MOST_TOPPLE if car.mass < HEAVY else LOADED_TOPPLE
        topple = share * TRACK * 0.5 * car.width / car.cg_height * GRAVITY
        return Style(
            min(style.accelerate, MOST_GRIP * drivetrain.max_drive_force / car.mass, 0.6 * grip),
            min(style.brake, MOST_GRIP * drivetrain.max_brake_force / car.mass, grip),
            min(style.lateral, MOST_LATERAL * car.tires.friction * GRAVITY, topple),
        )

    def power(self) -> float:
        """W/kg that accelerate the car."""
        return MOST_GRIP * self.car.drivetrain.max_power / self.car.mass

    def drag(self) -> float:
        """Deceleration by air per square of the speed, 1/m."""
        return 0.5 * AIR_DENSITY * self.car.drivetrain.drag_area / self.car.mass


MOST_GRIP: Final = 0.85
"""Share of grip, force and power that plans use of a car (engineering choice)."""

MOST_LATERAL: Final = 0.78
"""Share of grip that plans use in bends (engineering choice)."""

MOST_TOPPLE: Final = 0.5
"""Share of the rollover threshold that plans use (engineering choice)."""

LOADED_TOPPLE: Final = 0.33
"""The same for drivers of vans, trucks and buses, who carry loads or people."""

HEAVY: Final = 2500.0
"""Mass from which a vehicle is one of those, kg."""

TRACK: Final = 0.85
"""Distance of the wheels of an axle over the car's width (engineering choice)."""

SLOWEST: Final = 9.0
"""Square of the speed that a car always reaches, however steep the road, m^2/s^2."""


def _reachable_by(ability: Ability, limit: Floats, style: Style, stops: Sequence[int]) -> Floats:
    """As :func:`_reachable`, within power and within an ellipse of both accelerations (trail braking)."""
    square = (limit**2).tolist()
    for point in stops:
        square[point] = 0.0
    bend = ((ability.curvature / style.lateral) ** 2).tolist()
    climb = (GRAVITY * np.sin(ability.grade) + ability.car.drivetrain.rolling_resistance * GRAVITY).tolist()
    power, drag, step = ability.power(), ability.drag(), 2.0 * STEP
    before = square[0]
    for i in range(1, len(square)):
        reached = square[i]
        if reached > before:
            most = min(style.accelerate, power / math.sqrt(before) if before > 1.0 else power)
            most -= drag * before + climb[i - 1]
            gain = most * math.sqrt(max(1.0 - bend[i - 1] * before * before, 0.05))
            reached = min(reached, max(before + step * gain, SLOWEST if before >= SLOWEST else before + 0.2))
            square[i] = reached
        before = reached
    after = square[-1]
    for i in range(len(square) - 2, -1, -1):
        reached = square[i]
        if reached > after:
            most = style.brake * math.sqrt(max(1.0 - bend[i + 1] * after * after, 0.05))
            reached = min(reached, after + step * most)
            square[i] = reached
        after = reached
    return np.asarray(np.sqrt(np.array(square)))


def _smoothed(speed: Floats, smoothing: float) -> Schedule:
    width = max(round(smoothing / DT), 1)
    for _ in range(2):
        speed = uniform_filter1d(speed, width, mode="nearest")
    acceleration = np.gradient(speed, DT)
    standing = speed < CREEP
    return Schedule(np.where(standing, 0.0, speed), np.where(standing, -HOLD, acceleration))


Range = tuple[float, float]


@dataclass(frozen=True)
class RoadKind:
    """What a kind of road is made of. Ranges are drawn from uniformly (radii by their logarithm).

    Args:
        speed: Limits of the road, m/s.
        accelerate: Largest acceleration of its drivers, m/s^2.
        brake: Largest deceleration, m/s^2.
        lateral: Largest centripetal acceleration, m/s^2.
        straight: Length between events, m.
        radius: Of bends, m.
        angle: Of bends, rad.
        transition: Length of their clothoids, m.
        lane_change: Duration of a lane change, s.
        grade: Amplitude of the slope, rad.
        waves: Lengths of the two waves of the slope, m.
        events: Relative frequency of each event.
        weave_period: Of a weave at the limit, s.
        weave_width: Amplitude of a weave, m.
        smoothing: Width of the moving average of the speed, taken twice, s.
        roughness: G(n0) of the road, 1e-6 m^3, of which the square root is drawn; that of the drives if None.
        bumps: Potholes, seams and humps per kilometer, beside those of the drives.
        bank: Largest cross slope of bends of a circuit, rad.
        severity: Of open-loop steering, as a multiple of the wheel's angle at 0.3 g.
    """

    speed: Range
    accelerate: Range
    brake: Range
    lateral: Range
    straight: Range
    radius: Range
    angle: Range
    transition: Range
    lane_change: Range
    grade: Range
    waves: tuple[Range, Range]
    events: dict[str, float]
    weave_period: Range = (2.6, 4.5)
    weave_width: Range = (0.4, 1.2)
    smoothing: float = SMOOTHING
    roughness: Range | None = None
    bumps: Range = (0.0, 0.0)
    bank: Range = (0.0, 0.0)
    severity: Range = (1.0, 1.0)


KMH: Final = 1.0 / 3.6
"""One km/h in m/s."""

ROLLING: Final[tuple[Range, Range]] = ((300.0, 600.0), (700.0, 1500.0))
"""Waves of an ordinary road's slope, m."""

KINDS: Final = {
    "urban": RoadKind(
        speed=(30 * KMH, 60 * KMH),
        accelerate=(1.0, 2.4),
        brake=(1.2, 3.0),
        lateral=(1.5, 3.0),
        straight=(15.0, 120.0),
        radius=(25.0, 150.0),
        angle=(0.2, 1.2),
        transition=(8.0, 20.0),
        lane_change=(2.8, 5.0),
        grade=(0.0, 0.02),
        waves=ROLLING,
        events={"bend": 3, "corner": 3, "stop": 2.5, "slow": 2, "lane_change": 2, "roundabout": 1},
    ),
    "rural": RoadKind(
        speed=(60 * KMH, 100 * KMH),
        accelerate=(0.8, 2.0),
        brake=(1.0, 2.5),
        lateral=(1.5, 3.0),
        straight=(30.0, 250.0),
        radius=(70.0, 500.0),
        angle=(0.2, 1.3),
        transition=(20.0, 60.0),
        lane_change=(3.5, 6.0),
        grade=(0.0, 0.05),
        waves=ROLLING,
        events={"bend": 6, "corner": 0.5, "stop": 0.5, "slow": 2, "lane_change": 1.5, "roundabout": 0.5},
    ),
    "highway": RoadKind(
        speed=(85 * KMH, 130 * KMH),
        accelerate=(0.4, 1.2),
        brake=(0.6, 1.8),
        lateral=(0.6, 1.5),
        straight=(60.0, 400.0),
        radius=(500.0, 2000.0),
        angle=(0.1, 0.6),
        transition=(60.0, 150.0),
        lane_change=(4.5, 8.0),
        grade=(0.0, 0.03),
        waves=ROLLING,
        events={"bend": 3, "slow": 2.5, "lane_change": 3},
    ),
    "track": RoadKind(
        speed=(35 * KMH, 100 * KMH),
        accelerate=(1.5, 3.5),
        brake=(3.0, 6.0),
        lateral=(2.0, 4.0),
        straight=(5.0, 80.0),
        radius=(15.0, 200.0),
        angle=(0.3, 1.6),
        transition=(10.0, 25.0),
        lane_change=(2.4, 4.0),
        grade=(0.0, 0.02),
        waves=ROLLING,
        events={"bend": 3, "corner": 2, "stop": 1, "slow": 2, "lane_change": 3, "roundabout": 1, "weave": 2},
    ),
    "hilly": RoadKind(
        speed=(40 * KMH, 90 * KMH),
        accelerate=(0.8, 2.0),
        brake=(1.0, 2.5),
        lateral=(1.0, 2.5),
        straight=(60.0, 400.0),
        radius=(70.0, 500.0),
        angle=(0.2, 1.0),
        transition=(20.0, 60.0),
        lane_change=(3.5, 6.0),
        grade=(0.05, 0.12),
        waves=((150.0, 300.0), (300.0, 700.0)),
        events={"bend": 2, "slow": 1, "lane_change": 1},
    ),
    "strip": RoadKind(
        speed=(80 * KMH, 150 * KMH),
        accelerate=(2.0, 4.5),
        brake=(3.0, 7.0),
        lateral=(1.5, 2.5),
        straight=(50.0, 500.0),
        radius=(300.0, 600.0),
        angle=(0.1, 0.4),
        transition=(30.0, 60.0),
        lane_change=(4.5, 8.0),
        grade=(0.0, 0.01),
        waves=ROLLING,
        events={"stop": 4, "slow": 3, "bend": 1},
    ),
    "cones": RoadKind(
        speed=(40 * KMH, 90 * KMH),
        accelerate=(1.0, 3.0),
        brake=(2.0, 5.0),
        lateral=(3.5, 6.0),
        straight=(10.0, 80.0),
        radius=(40.0, 250.0),
        angle=(0.2, 1.2),
        transition=(5.0, 15.0),
        lane_change=(2.2, 3.5),
        grade=(0.0, 0.01),
        waves=ROLLING,
        events={"weave": 4, "lane_change": 3, "bend": 3, "slow": 1},
        weave_period=(2.3, 4.5),
        weave_width=(0.4, 1.4),
    ),
    "circuit": RoadKind(
        speed=(50 * KMH, 90 * KMH),
        accelerate=(3.0, 6.0),
        brake=(4.5, 9.5),
        lateral=(5.0, 9.8),
        straight=(STEP, STEP),
        radius=(14.0, 140.0),
        angle=(0.2, 2.4),
        transition=(5.0, 12.0),
        lane_change=(3.0, 5.0),
        grade=(0.0, 0.04),
        waves=((200.0, 400.0), (400.0, 900.0)),
        events={"lap": 1},
        smoothing=0.35,
        bank=(0.0, 0.15),
    ),
    "limit": RoadKind(
        speed=(50 * KMH, 90 * KMH),
        accelerate=(2.0, 4.0),
        brake=(6.0, 9.5),
        lateral=(6.0, 9.0),
        straight=(40.0, 120.0),
        radius=(30.0, 150.0),
        angle=(0.4, 1.6),
        transition=(5.0, 12.0),
        lane_change=(1.7, 2.6),
        grade=(0.0, 0.01),
        waves=ROLLING,
        events={"dwell": 3, "step": 3, "stop": 3, "weave": 3, "lane_change": 2, "bend": 1, "slow": 1},
        weave_period=(1.9, 3.2),
        weave_width=(0.4, 1.3),
        smoothing=0.25,
        severity=(1.0, 6.5),
    ),
    "rough": RoadKind(
        speed=(25 * KMH, 80 * KMH),
        accelerate=(0.8, 2.4),
        brake=(1.0, 3.5),
        lateral=(1.5, 3.5),
        straight=(20.0, 200.0),
        radius=(25.0, 300.0),
        angle=(0.2, 1.2),
        transition=(8.0, 30.0),
        lane_change=(3.0, 5.0),
        grade=(0.0, 0.05),
        waves=ROLLING,
        events={"bend": 5, "corner": 1, "stop": 1, "slow": 3, "lane_change": 1},
        roughness=(64.0, 1024.0),
        bumps=(3.0, 20.0),
    ),
}
"""Engineering choices: speed limits of European roads, accelerations of ordinary to brisk drivers; on the
handling track those of a test driver, in the hills slopes and crests of mountain roads, on the strip standing
starts and full braking, among cones weaves, sudden bends and lane changes close to what tires hold. On a
circuit laps at 0.5 to 1 g with trail braking, banked corners and curbs; at the limit open-loop steering tests
up to the severity of FMVSS 126, full braking and swerves; on rough roads G(n0) up to a very bad road of
ISO 8608, with potholes, seams and humps."""

CORNER_RADIUS: Final[Range] = (9.0, 18.0)
"""Of a right-angled turn at a crossing, m."""

ROUNDABOUT_RADIUS: Final[Range] = (14.0, 25.0)
"""Of the circle driven, m."""

LANE_WIDTH: Final[Range] = (2.8, 3.75)
"""m."""

WEAVE_PERIODS: Final[Range] = (2.0, 5.0)
"""Of a weave."""


@dataclass(frozen=True)
class Steer:
    """A steering test on a road: the robot has the wheel from one point to another.

    Args:
        first: Point where it begins.
        last: Where the driver takes over.
        severity: Amplitude over the wheel's angle at 0.3 g in the linear range; signed, right positive.
        frequency: Of a sine with dwell, Hz; of a step, the inverse of the time that it is held.
        dwell: Whether it is a sine with dwell, not a step.
    """

    first: int
    last: int
    severity: float
    frequency: float
    dwell: bool

    def wave(self, time: Floats) -> Floats:
        """Shape over time from the onset, s, within [-1, 1]."""
        if self.dwell:
            return sine_with_dwell(time, self.frequency, DWELL)
        return np.clip(np.minimum(time, 1.0 / self.frequency - time) / STEP_RISE, 0.0, 1.0)


DWELL: Final = 0.5
"""Pause of a sine with dwell, s (FMVSS 126)."""

STEP_RISE: Final = 0.2
"""Time in which a step of the wheel reaches its angle, s."""


def sine_with_dwell(time: Floats, frequency: float, dwell: float) -> Floats:
    """A sine that pauses at its second peak, over time from its onset, s; within [-1, 1]."""
    peak = 0.75 / frequency
    phase = np.where(time < peak, time, np.maximum(time - dwell, peak))
    inside = (time >= 0.0) & (time <= 1.0 / frequency + dwell)
    return np.where(inside, np.sin(2.0 * math.pi * frequency * phase), 0.0)


Known = Literal["map", "cones", "nobody"]
"""Who knows a stretch before it is driven: a map, a scenario that has put up cones, or the driver alone."""


@dataclass
class Road:
    """A road under construction: what to drive, how fast, and where to stop.

    Args:
        kind: Of road.
        rng: Source of chance.
        limit: Speed limit in force, m/s.
        curvature: Of its stretches.
        limits: Of its stretches.
        stops: Point of each stop, and time to stand there, s.
        points: So far.
        steers: Open-loop steering tests.
        circuit: That is driven round.
        lateral: Centripetal acceleration of its drivers, m/s^2.
        laps: Point where each lap of the circuit begins.
        mapped: Curvature of its stretches as a map has them.
        cones: What cones add to it.
        posted: Legal limits of its stretches, m/s.
    """

    kind: RoadKind
    rng: np.random.Generator
    limit: float
    curvature: list[Floats] = field(default_factory=list)
    limits: list[Floats] = field(default_factory=list)
    stops: list[tuple[int, float]] = field(default_factory=list)
    points: int = 0
    steers: list[Steer] = field(default_factory=list)
    circuit: Circuit | None = None
    lateral: float = math.inf
    laps: list[int] = field(default_factory=list)
    mapped: list[Floats] = field(default_factory=list)
    cones: list[Floats] = field(default_factory=list)
    posted: list[Floats] = field(default_factory=list)

    def draw(self, bounds: Range) -> float:
        """Uniform within the bounds."""
        return float(self.rng.uniform(*bounds))

    def sign(self) -> float:
        """Left (-1) or right (1)."""
        return float(self.rng.choice((-1.0, 1.0)))

    def add(self, curvature: Floats, limit: float | None = None, known: Known = "map") -> None:
        """Append a stretch, with a limit of its own or the road's, and whoever knows it ahead."""
        self.curvature.append(curvature)
        zero = np.zeros(len(curvature))
        self.mapped.append(curvature if known == "map" else zero)
        self.cones.append(curvature if known == "cones" else zero)
        self.posted.append(np.full(len(curvature), self.limit))
        self.limits.append(np.full(len(curvature), self.limit if limit is None else limit))
        self.points += len(curvature)

    def add_straight(self, length: float) -> None:
        """Append a straight, m."""
        self.add(np.zeros(max(round(length / STEP), 1)))

    def add_event(self) -> None:
        """Append one random event and the straight after it."""
        names = list(self.kind.events)
        weights = np.array([self.kind.events[name] for name in names])
        EVENTS[str(self.rng.choice(names, p=weights / weights.sum()))](self)
        self.add_straight(self.draw(self.kind.straight))


def add_bend(road: Road) -> None:
    """A bend of the road's kind."""
    low, high = np.log(road.kind.radius)
    radius = float(np.exp(road.rng.uniform(low, high)))
    road.add(bend(road.sign() / radius, road.draw(road.kind.angle), road.draw(road.kind.transition)))


def add_corner(road: Road) -> None:
    """A right-angled turn at a crossing."""
    angle = road.draw((0.4 * np.pi, 0.6 * np.pi))
    road.add(bend(road.sign() / road.draw(CORNER_RADIUS), angle, road.draw((5.0, 9.0))))


def add_stop(road: Road) -> None:
    """A stop of 2 to 8 s."""
    road.stops.append((road.points, road.draw((2.0, 8.0))))


def add_slow(road: Road) -> None:
    """Another speed limit, or for a while the slower one of traffic ahead."""
    if road.rng.random() < 0.5:
        road.limit = road.draw(road.kind.speed)
    else:
        road.add(
            np.zeros(round(road.draw((1.0, 4.0)) * road.limit / STEP)), road.draw((0.4, 0.8)) * road.limit
        )


def add_lane_change(road: Road) -> None:
    """To the next lane, by one sine of curvature: offset A T^2 / (2 pi) at the limit."""
    length = road.draw(road.kind.lane_change) * road.limit
    stations = np.arange(0.0, length, STEP)
    peak = 2.0 * np.pi * road.draw(LANE_WIDTH) / length**2
    road.add(road.sign() * peak * np.sin(2.0 * np.pi * stations / length), known="nobody")


def add_weave(road: Road) -> None:
    """To and fro within the road, some periods of a sine of curvature."""
    length = road.draw(road.kind.weave_period) * road.limit
    stations = np.arange(0.0, length * round(road.draw(WEAVE_PERIODS)), STEP)
    # The car sways by peak (length / 2 pi)^2 to either side.
    peak = road.draw(road.kind.weave_width) * (2.0 * np.pi / length) ** 2
    road.add(road.sign() * peak * np.sin(2.0 * np.pi * stations / length), known="cones")


def add_roundabout(road: Road) -> None:
    """Round a roundabout to one of its exits (traffic on the right)."""
    deflection = road.draw((0.6, 1.0))
    turn = float(road.rng.choice((-0.5, 0.0, 0.5))) * np.pi
    aside = bend(1.0 / road.draw((20.0, 35.0)), deflection, 7.0)
    circle = bend(-1.0 / road.draw(ROUNDABOUT_RADIUS), max(turn + 2.0 * deflection, 0.3), 7.0)
    for piece in (aside, circle, aside):
        road.add(piece)


def add_dwell(road: Road) -> None:
    """A sine with dwell by a robot, to either side, and a second to settle."""
    _add_steer(road, 1.0 / road.draw((0.5, 0.8)), True)


def add_step(road: Road) -> None:
    """A step of the wheel by a robot, held and taken back."""
    _add_steer(road, road.draw((0.8, 3.0)), False)


def _add_steer(road: Road, period: float, dwell: bool) -> None:
    severity = road.sign() * road.draw(road.kind.severity)
    length = (period + dwell * DWELL + 1.0) * road.limit
    first = road.points
    road.add_straight(length)
    road.steers.append(Steer(first, road.points, severity, 1.0 / period, dwell))


def add_lap(road: Road) -> None:
    """One lap of the circuit, always the same."""
    if road.circuit is None:
        road.circuit = random_circuit(road.rng, road.draw(road.kind.bank))
        road.limit = road.draw((130.0 * KMH, 260.0 * KMH))
    curvature = road.circuit.curvature
    road.laps.append(road.points)
    road.add(curvature)
    # As fast as its bends allow, so that the time of a lap is about right.
    road.limits[-1] = np.minimum(road.limit, np.sqrt(road.lateral / np.maximum(np.abs(curvature), 1e-9)))


EVENTS: Final[dict[str, Callable[[Road], None]]] = {
    "bend": add_bend,
    "corner": add_corner,
    "stop": add_stop,
    "slow": add_slow,
    "lane_change": add_lane_change,
    "roundabout": add_roundabout,
    "weave": add_weave,
    "dwell": add_dwell,
    "step": add_step,
    "lap": add_lap,
}
"""What can happen on a road, by name."""

ORDINARY_KINDS: Final = ("urban", "rural", "highway", "track", "hilly", "strip", "cones")
"""Kinds of the first versions, on which nothing is beyond what ordinary driver and car do."""
