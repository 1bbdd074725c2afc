"""Random drives for training: seeded, of any length, on roads of several kinds and on a track."""

from __future__ import annotations

import pathlib
from dataclasses import replace
from typing import Annotated, Final

import numpy as np
from pydantic import BeforeValidator, Field
from scipy.ndimage import uniform_filter1d

from ..car.plans import DT, STEP, Path, Schedule
from ..car.simulation import Plan, RoadRoughness, simulate
from ..car.vehicles import Car, Stability, car_names, get_car
from ..cues import GRAVITY, CueTrace
from ..errors import ConfigurationError, UnknownNameError, suggest
from ..road import Route
from ..settings import (
    NonNegative,
    check_names,
    check_range,
    configuration,
    load,
    preset_names,
)
from .bumps import with_bumps, with_kerbs
from .drivers import STANDARD, DrawnDriver, Drivers
from .roads import KINDS, Ability, Floats, Road, Steer, Style, along_path, speed_limit

SETTLE: Final = 3.0
"""Straight and steady driving before the first event, s."""

SHORTEST: Final = 0.1
"""Of a drive, s: ten samples."""

LONGEST: Final = 86_400.0
"""Of a drive, s: a day, some gigabyte of cues."""

_ROUGHNESS_STREAM: Final = 1
_DRIVER_STREAM: Final = 2
_BUMP_STREAM: Final = 3
_ERROR_STREAM: Final = 4
_SPEED_STREAM: Final = 5

HELD_OUT_SEEDS: Final = 2**32
"""Seeds of held-out drives begin here; those of training and tuning end before, see :func:`drive_seeds`."""


Share = Annotated[float, Field(ge=0.0, le=1.0)]


@configuration
class RandomDrives:
    """A distribution of drives.

    Args:
        urban: Relative frequency of urban drives.
        rural: Of rural drives.
        highway: Of highway drives.
        track: Of hard drives on a handling track.
        hilly: Of drives over steep hills and crests.
        strip: Of drives with standing starts and full braking, far along a straight.
        cones: Of weaves, sudden bends and lane changes close to what tires hold.
        circuit: Of laps of a racing circuit, with banked corners and curbs.
        limit: Of steering tests at the limit of the tires, full braking and swerves.
        rough: Of rough and broken roads, with potholes and humps.
        roughness: Range of the road's roughness G(n0), 1e-6 m^3, of which the square root is drawn. ISO 8608:
            16 is a very good road, 64 a good, 256 an average one; 0 is smooth.
        cars: Cars to draw from, by name.
        bumps: Range of the number of potholes, seams and humps per kilometer.
        harshness: Range of the share of the wheels' speed that dampers pass on to the body, 0 to 1.
        drivers: How drivers differ.
        within_car: Whether plans keep within what the drawn car can do: power, brakes, grip, rollover.
    """

    urban: NonNegative = 0.5
    rural: NonNegative = 0.3
    highway: NonNegative = 0.2
    track: NonNegative = 0.0
    hilly: NonNegative = 0.0
    strip: NonNegative = 0.0
    cones: NonNegative = 0.0
    circuit: NonNegative = 0.0
    limit: NonNegative = 0.0
    rough: NonNegative = 0.0
    roughness: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    cars: Annotated[tuple[str, ...], Field(min_length=1)] = ("sedan",)
    bumps: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    harshness: tuple[Share, Share] = (0.0, 0.0)
    drivers: Drivers = Drivers()
    within_car: bool = False

    def __post_init__(self) -> None:
        if sum(getattr(self, kind) for kind in KINDS) <= 0.0:
            raise ValueError(f"one of {', '.join(KINDS)} must be positive")
        for name in ("roughness", "bumps", "harshness"):
            check_range(name, getattr(self, name))
        check_names("car", self.cars, car_names())

    @property
    def shares(self) -> Floats:
        """Probabilities of the kinds, in the order of :data:`~.roads.KINDS`."""
        weights = np.array([getattr(self, kind) for kind in KINDS])
        return np.asarray(weights / weights.sum())

    def plan(self, seed: int, duration: float, kind: str | None = None, car: Car | None = None) -> Plan:
        """The drive that belongs to ``seed``; kind of road and car are drawn unless given.

        Raises:
            ConfigurationError: the seed or the duration is out of range.
            UnknownNameError: no such kind of road.
        """
        _check_seed(seed)
        if not SHORTEST <= duration <= LONGEST:
            raise ConfigurationError(f"duration is {duration:g} s; use {SHORTEST:g} to {LONGEST:g} s")
        rng = np.random.default_rng(seed)
        drawn_kind, drawn_car = str(rng.choice(list(KINDS), p=self.shares)), str(rng.choice(self.cars))
        kind = drawn_kind if kind is None else kind
        if kind not in KINDS:
            raise UnknownNameError("kind of road", kind, KINDS)
        driver = self._driver(seed)
        plan, road = _plan(
            f"{kind}-{seed}", car or get_car(drawn_car), kind, rng, duration, driver, self.within_car, seed
        )
        if self.drivers != Drivers():
            plan = replace(plan, driver=driver.driver, seed=(seed, _ERROR_STREAM))
        return self._rough(plan, road, seed)

    def _driver(self, seed: int) -> DrawnDriver:
        """Who drives: the standard driver unless drivers differ."""
        if self.drivers == Drivers():
            return STANDARD
        return self.drivers.drawn(np.random.default_rng((seed, _DRIVER_STREAM)))

    def _rough(self, plan: Plan, road: Road, seed: int) -> Plan:
        """The same plan on a rough road."""
        kind = road.kind
        bounds = self.roughness if kind.roughness is None else kind.roughness
        bumps = (self.bumps[0] + kind.bumps[0], self.bumps[1] + kind.bumps[1])
        if bounds[1] == bumps[1] == 0.0 and road.circuit is None:
            return plan
        rng = np.random.default_rng((seed, _ROUGHNESS_STREAM))
        roughness = 1e-6 * float(rng.uniform(*np.sqrt(bounds))) ** 2
        length = float(plan.schedule.distance[-1]) + plan.car.length
        tracks = RoadRoughness.drawn(roughness, length, rng)
        rng = np.random.default_rng((seed, _BUMP_STREAM))
        harshness, often = float(rng.uniform(*self.harshness)), float(rng.uniform(*bumps))
        if harshness > 0.0:
            tracks = replace(tracks, harshness=harshness)
        if often > 0.0:
            tracks = with_bumps(tracks, often, rng)
        return replace(plan, roughness=with_kerbs(tracks, road))


def random_drive(
    seed: int,
    duration: float,
    kind: str | None = None,
    car: Car | None = None,
    drives: RandomDrives | None = None,
) -> CueTrace:
    """One random drive; the same seed gives the same drive.

    Args:
        seed: From 0 up.
        duration: 0.1 s to a day, s.
        kind: One of :data:`~.roads.KINDS`, such as "urban"; drawn if None.
        car: Drawn from ``drives.cars`` if None.
        drives: What to draw from.

    Raises:
        ConfigurationError: the seed or the duration is out of range.
        UnknownNameError: no such kind of road.
    """
    return simulate([(drives or RandomDrives()).plan(seed, duration, kind, car)])[0]


def drive_seeds(n: int, seed: int) -> list[int]:
    """The seeds of the ``n`` drives of a batch: well apart for any two values of ``seed``.

    They are below :data:`HELD_OUT_SEEDS`.
    """
    _check_seed(seed)
    return [int(s) for s in np.random.SeedSequence(seed).generate_state(n, np.uint32)]


def _check_seed(seed: int) -> None:
    if not isinstance(seed, int | np.integer) or seed < 0:
        raise ConfigurationError(f"seed is {seed!r}; use a whole number from 0 up")


def random_drives(
    n: int,
    duration: float,
    seed: int,
    kind: str | None = None,
    car: Car | None = None,
    drives: RandomDrives | None = None,
    device: str = "cpu",
) -> list[CueTrace]:
    """``n`` random drives in one launch; number i is ``random_drive(drive_seeds(n, seed)[i], ...)``."""
    source = drives or RandomDrives()
    return simulate([source.plan(one, duration, kind, car) for one in drive_seeds(n, seed)], device)


def held_out_drives(n: int, duration: float, drives: RandomDrives | None = None) -> list[CueTrace]:
    """``n`` random drives that no training and no tuning draws, always the same.

    Seeds from :data:`HELD_OUT_SEEDS` up; a drive whose car comes off its path is replaced by one of a later
    seed.

    Args:
        n: How many.
        duration: Of each, s.
        drives: The preset ``held-out`` if None: reserved cars, other drivers.

    Raises:
        ConfigurationError: the duration is out of range.
    """
    # Imported here: the maneuvers use this module's roads.
    from .standard import off_path

    source = drives or load_drives("held-out")
    found: dict[int, CueTrace] = {}
    seed = HELD_OUT_SEEDS
    while len(found) < n:
        missing = [row for row in range(n) if row not in found]
        plans = [source.plan(seed + k, duration) for k in range(len(missing))]
        seed += len(missing)
        for row, plan, trace in zip(missing, plans, simulate(plans), strict=True):
            if not off_path(plan, trace):
                found[row] = trace
    return [found[row] for row in range(n)]


def _plan(
    name: str,
    car: Car,
    kind_name: str,
    rng: np.random.Generator,
    duration: float,
    driver: DrawnDriver,
    within_car: bool,
    seed: int,
) -> tuple[Plan, Road]:
    kind = KINDS[kind_name]
    road = Road(kind, rng, float(rng.uniform(*kind.speed)))
    style = Style(road.draw(kind.accelerate), road.draw(kind.brake), road.draw(kind.lateral))
    style = driver.style(style)
    if within_car:
        style = Ability.style(style, car)
    road.lateral = style.lateral
    # Long enough to brake to rest after the settling, whatever comes.
    road.add_straight(road.limit * (SETTLE + 1.0) + road.limit**2 / (2.0 * style.brake))
    while _shortest_time(road) * driver.haste < duration + SETTLE:
        road.add_event()
    curvature = np.concatenate(road.curvature)
    path = Path.of_curvature(curvature, _slope(road, len(curvature)), _bank(road, len(curvature)))
    limit = np.concatenate(road.limits)
    if driver is not STANDARD:
        limit = driver.chosen_speed(limit, np.random.default_rng((seed, _SPEED_STREAM)))
    limit = speed_limit(curvature, limit, style)
    stops = [(point, wait) for point, wait in road.stops if point < len(curvature)]
    ability = Ability(car, path.curvature, path.grade) if within_car else None
    schedule = along_path(limit, style, stops, duration, kind.smoothing * driver.smoothness, ability)
    source = f"random {kind_name} drive"
    if within_car and kind_name in STABILIZED:
        car = stabilized(car)
    steering = _steering(road.steers, car, schedule) if road.steers else None
    route = Route(
        np.concatenate(road.mapped),
        np.concatenate(road.cones),
        np.concatenate(road.posted),
        stops=kind_name not in EMERGENCIES,
    )
    return Plan(name, car, path, schedule, steering=steering, source=source, route=route), road


EMERGENCIES: Final = ("limit",)
"""Kinds whose stops are emergencies, which nobody knows ahead; those of others are lines, lights, queues."""


STABILIZED: Final = ("track", "strip", "cones", "circuit", "limit")
"""Kinds on which a plan within the car's means has a stability control; others need none."""


def stabilized(car: Car) -> Car:
    """The same car with a stability control, its own or one of the usual size."""
    if car.stability is not None:
        return car
    return replace(car, stability=Stability(35.0 * car.mass, 3.2 * car.mass))


def _steering(steers: list[Steer], car: Car, schedule: Schedule) -> Floats | None:
    """(n,) angles of the wheel, rad, in the steering tests that the drive reaches; NaN between them."""
    angle, point = np.full(len(schedule), np.nan), schedule.distance / STEP
    for steer in steers:
        inside = np.flatnonzero((point >= steer.first) & (point < steer.last))
        if not len(inside):
            continue
        speed = max(float(schedule.speed[inside[0]]), 5.0)
        amplitude = steer.severity * car.steering_wheel_for(speed, 0.3 * GRAVITY)
        angle[inside] = amplitude * steer.wave(np.asarray(DT * np.arange(len(inside)), dtype=np.float64))
    return angle if np.isfinite(angle).any() else None


def _shortest_time(road: Road) -> float:
    """Time on the road at its limits, without standing: below what any drive takes, s."""
    return float(
        sum(
            STEP * len(piece) / piece[0] if np.ptp(piece) == 0.0 else np.sum(STEP / piece)
            for piece in road.limits
        )
    )


_BANKING: Final = 31
"""Points over which a bank is averaged, twice."""


def _bank(road: Road, points: int) -> Floats | None:
    """Cross slope of the road, rad; None where it is level."""
    if road.circuit is None:
        return None
    bank = np.zeros(points)
    for first in road.laps:
        bank[first : first + len(road.circuit.bank)] = road.circuit.bank
    # The road to the circuit is level: a lap may begin at the end of a banked corner.
    return np.asarray(uniform_filter1d(uniform_filter1d(bank, _BANKING), _BANKING))


def _slope(road: Road, points: int) -> Floats:
    """Two waves of the road's slope, rising from level after the first 100 m."""
    stations = STEP * np.arange(points)
    fade = np.clip((stations - 100.0) / 200.0, 0.0, 1.0)
    amplitude, slope = road.draw(road.kind.grade), np.zeros(points)
    for length in [road.draw(wave) for wave in road.kind.waves]:
        slope += 0.5 * amplitude * np.sin(2.0 * np.pi * stations / length + road.draw((0.0, 2.0 * np.pi)))
    return np.asarray(slope * fade**2 * (3.0 - 2.0 * fade))


_PRESETS: Final = pathlib.Path(__file__).parent / "presets"


def drives_names() -> list[str]:
    """Names of the distributions of random drives that come with the package."""
    return preset_names(_PRESETS)


def load_drives(name: str | pathlib.Path) -> RandomDrives:
    """A distribution of random drives by name, or from a YAML file with fields of :class:`RandomDrives`.

    Raises:
        DataError: the file cannot be read or is not YAML.
        ConfigurationError: no distribution has this name, or a field is wrong.
    """
    return load(RandomDrives, _file_of(name))


def _file_of(name: str | pathlib.Path) -> pathlib.Path:
    if pathlib.Path(name).suffix in (".yaml", ".yml"):
        return pathlib.Path(name)
    if str(name) not in drives_names():
        raise ConfigurationError(
            f"unknown distribution of random drives {str(name)!r}. {suggest(str(name), drives_names())}"
        )
    return _PRESETS / f"{name}.yaml"


def named_drives(values: object) -> object:
    """A distribution given by its name or file, or its fields as they are."""
    return load_drives(values) if isinstance(values, str | pathlib.Path) else values


NamedDrives = Annotated[RandomDrives, BeforeValidator(named_drives)]
"""Random drives, or the name of a distribution, as the type of a configuration's field."""
