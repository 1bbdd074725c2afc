"""Random drives for training: seeded, of any length, on roads of several kinds and on a track."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from ..car.plans import STEP, Path
from ..car.simulation import Plan, RoadRoughness, simulate
from ..car.vehicles import Car, car_names, get_car
from ..cues import CueTrace
from ..errors import ConfigurationError, UnknownNameError
from ..settings import NonNegative, check_names, check_range, configuration
from .roads import KINDS, Floats, Road, Style, along_path, speed_limit

SETTLE: Final = 3.0
"""Straight and steady driving before the first event, s."""

SHORTEST: Final = 0.1
"""Of a drive, s: ten samples."""

LONGEST: Final = 86_400.0
"""Of a drive, s: a day, some gigabyte of cues."""

_ROUGHNESS_STREAM: Final = 1


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
        roughness: Range of the road's roughness G(n0), 1e-6 m^3, of which the square root is drawn. ISO 8608:
            16 is a very good road, 64 a good, 256 an average one; 0 is smooth.
        cars: Cars to draw from, by name.
    """

    urban: NonNegative = 0.5
    rural: NonNegative = 0.3
    highway: NonNegative = 0.2
    track: NonNegative = 0.0
    hilly: NonNegative = 0.0
    strip: NonNegative = 0.0
    cones: NonNegative = 0.0
    roughness: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    cars: Annotated[tuple[str, ...], Field(min_length=1)] = ("sedan",)

    def __post_init__(self) -> None:
        if sum(getattr(self, kind) for kind in KINDS) <= 0.0:
            raise ValueError(f"one of {', '.join(KINDS)} must be positive")
        check_range("roughness", self.roughness)
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
        plan = _plan(f"{kind}-{seed}", car or get_car(drawn_car), kind, rng, duration)
        return plan if self.roughness[1] == 0.0 else self._rough(plan, seed)

    def _rough(self, plan: Plan, seed: int) -> Plan:
        """The same plan on a rough road."""
        rng = np.random.default_rng((seed, _ROUGHNESS_STREAM))
        roughness = 1e-6 * float(rng.uniform(*np.sqrt(self.roughness))) ** 2
        length = float(plan.schedule.distance[-1]) + plan.car.length
        return replace(plan, roughness=RoadRoughness.drawn(roughness, length, rng))


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
        kind: "urban", "rural", "highway", "track", "hilly", "strip" or "cones"; drawn if None.
        car: Drawn from ``drives.cars`` if None.
        drives: What to draw from.

    Raises:
        ConfigurationError: the seed or the duration is out of range.
        UnknownNameError: no such kind of road.
    """
    return simulate([(drives or RandomDrives()).plan(seed, duration, kind, car)])[0]


def drive_seeds(n: int, seed: int) -> list[int]:
    """The seeds of the ``n`` drives of a batch: well apart for any two values of ``seed``."""
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


def _plan(name: str, car: Car, kind_name: str, rng: np.random.Generator, duration: float) -> Plan:
    kind = KINDS[kind_name]
    road = Road(kind, rng, float(rng.uniform(*kind.speed)))
    style = Style(road.draw(kind.accelerate), road.draw(kind.brake), road.draw(kind.lateral))
    # Long enough to brake to rest after the settling, whatever comes.
    road.add_straight(road.limit * (SETTLE + 1.0) + road.limit**2 / (2.0 * style.brake))
    while _shortest_time(road) < duration + SETTLE:
        road.add_event()
    curvature = np.concatenate(road.curvature)
    path = Path.of_curvature(curvature, _slope(road, len(curvature)))
    limit = speed_limit(curvature, np.concatenate(road.limits), style)
    stops = [(point, wait) for point, wait in road.stops if point < len(curvature)]
    return Plan(
        name, car, path, along_path(limit, style, stops, duration), source=f"random {kind_name} drive"
    )


def _shortest_time(road: Road) -> float:
    """Time on the road at its limits, without standing: below what any drive takes, s."""
    return float(sum(STEP * len(piece) / piece[0] for piece in road.limits))


def _slope(road: Road, points: int) -> Floats:
    """Two waves of the road's slope, rising from level after the first 100 m."""
    stations = STEP * np.arange(points)
    fade = np.clip((stations - 100.0) / 200.0, 0.0, 1.0)
    amplitude, slope = road.draw(road.kind.grade), np.zeros(points)
    for length in [road.draw(wave) for wave in road.kind.waves]:
        slope += 0.5 * amplitude * np.sin(2.0 * np.pi * stations / length + road.draw((0.0, 2.0 * np.pi)))
    return np.asarray(slope * fade**2 * (3.0 - 2.0 * fade))
