"""Platform randomization: machines drawn around a given one, so that a policy learns what a machine is."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Final, TypeVar

import numpy as np
from pydantic import Field

from ..errors import ConfigurationError
from ..settings import Positive, Vector2, Vector3, check_range, configuration
from .kinematics import check_geometry
from .machines import Carriage, Hexapod, Joints, Platform, Turntable

Range = tuple[Positive, Positive]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]

Part = TypeVar("Part", Carriage, Hexapod, Turntable)

_TRIES: Final = 100
"""Machines drawn for one that closes."""

_DRAWS: Final = 16
"""Numbers a machine takes, all of them in use. They come in one draw: another one more would change every
machine after the first of a generator."""


@configuration
class PlatformRanges:
    """How drawn machines differ from a given one. Each factor is drawn by itself, evenly within its range.

    Args:
        travel: Factor on the carriage's strokes, and another on the legs'.
        size: Factor on the hexapod as a whole: joints about their centers, height, and the legs' strokes.
        shape: Three factors beside it: on the upper joints, on the lower joints, and on the height.
        rates: Factors on velocity and acceleration limits, six: of carriage, legs and turntable.
        turntable_travel: Half the travel of a turntable that has ends, rad.
        limited_turntable: Share of the turntables that have ends; the others are as the given one.
        without_carriage: Share of the machines without carriage.
        without_turntable: Share of the machines without turntable.
    """

    travel: Range = (1.0, 1.0)
    size: Range = (1.0, 1.0)
    shape: Range = (1.0, 1.0)
    rates: Range = (1.0, 1.0)
    turntable_travel: Range = (0.5 * np.pi, 2.0 * np.pi)
    limited_turntable: Probability = 0.0
    without_carriage: Probability = 0.0
    without_turntable: Probability = 0.0

    def __post_init__(self) -> None:
        for name in ("travel", "size", "shape", "rates", "turntable_travel"):
            check_range(name, getattr(self, name))


def random_platform(
    platform: Platform, ranges: PlatformRanges, rng: np.random.Generator, name: str
) -> Platform:
    """A machine drawn around another one, within ranges, that holds its platform at neutral.

    Raises:
        ConfigurationError: none of many closes.
    """
    for _ in range(_TRIES):
        try:
            made = _built(platform, ranges, rng.uniform(size=_DRAWS))
            check_geometry(made.hexapod)
        except ConfigurationError as error:
            reason = error
            continue
        return replace(made, name=name, description=f"{platform.name}, randomized")
    raise ConfigurationError(
        f"randomization.platform: none of {_TRIES} machines drawn around {platform.name!r} closes, the last "
        f"because {reason}; narrow size, shape or travel"
    )


def _built(platform: Platform, ranges: PlatformRanges, drawn: np.ndarray) -> Platform:
    def within(limits: Range, draw: int) -> float:
        return float(limits[0] + (limits[1] - limits[0]) * drawn[draw])

    carriage, turntable = platform.carriage, platform.turntable
    hexapod = resized(
        platform.hexapod, within(ranges.size, 2), *(within(ranges.shape, draw) for draw in (3, 4, 5))
    )
    hexapod = replace(
        _quicker(hexapod, within(ranges.rates, 8), within(ranges.rates, 9)),
        extension=_times(hexapod.extension, within(ranges.travel, 1)),
    )
    if carriage is not None:
        carriage = _quicker(carriage, within(ranges.rates, 6), within(ranges.rates, 7))
        carriage = _longer(carriage, within(ranges.travel, 0))
    if turntable is not None:
        turntable = _quicker(turntable, within(ranges.rates, 10), within(ranges.rates, 11))
        end = within(ranges.turntable_travel, 12)
        turntable = (
            replace(turntable, travel=(-end, end)) if drawn[13] < ranges.limited_turntable else turntable
        )
    return replace(
        platform,
        hexapod=hexapod,
        carriage=None if drawn[14] < ranges.without_carriage else carriage,
        turntable=None if drawn[15] < ranges.without_turntable else turntable,
    )


def resized(
    hexapod: Hexapod, size: float, upper: float = 1.0, lower: float = 1.0, height: float = 1.0
) -> Hexapod:
    """A hexapod whose legs are times ``size``, and whose parts differ in shape.

    Args:
        hexapod: The one it is made of.
        size: Factor on everything: with this alone legs and strokes are as those of a similar hexapod.
        upper: Factor on the upper joints about their center.
        lower: Factor on the lower joints about theirs.
        height: Factor on the way between the two centers at neutral.
    """
    above, below = (np.array(joints) for joints in (hexapod.upper_joints, hexapod.lower_joints))
    middles = above.mean(axis=0), below.mean(axis=0)
    way = size * height * (np.array(hexapod.neutral) + middles[0] - middles[1])
    return replace(
        hexapod,
        upper_joints=_points(middles[0] + size * upper * (above - middles[0])),
        lower_joints=_points(middles[1] + size * lower * (below - middles[1])),
        neutral=_point(way - middles[0] + middles[1]),
        extension=_times(hexapod.extension, size),
    )


def _points(points: np.ndarray) -> Joints:
    return tuple(_point(point) for point in points)


def _point(point: np.ndarray) -> Vector3:
    x, y, z = point.tolist()
    return x, y, z


def _times(travel: Vector2, factor: float) -> Vector2:
    return factor * travel[0], factor * travel[1]


def _longer(carriage: Carriage, factor: float) -> Carriage:
    return replace(
        carriage, travel_x=_times(carriage.travel_x, factor), travel_y=_times(carriage.travel_y, factor)
    )


def _quicker(part: Part, velocity: float, acceleration: float) -> Part:
    return replace(part, velocity=velocity * part.velocity, acceleration=acceleration * part.acceleration)
