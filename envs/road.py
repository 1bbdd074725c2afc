"""Road ahead: what a map and a scenario know of the road of a drive, without the driver's plan.

A map has curvature, grade, bank and speed limit along the way. A scenario adds what stands on the road: cones
that mark a lane, and places to stop. Neither has a spontaneous lane change, an emergency stop or a skid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import DataError

Floats = NDArray[np.float64]

SPACING: Final = 0.5
"""Between the points of a road, m."""

SLOWEST: Final = 3.0
"""Speed by which times ahead become distances, at least, m/s."""

NO_STOP: Final = 1e4
"""Distance to a stop where none is known, m."""

ROAD_TIMES: Final = (0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0)
"""Times ahead at which a packet of the real-time loop has the road, by the present speed, s."""


@dataclass(frozen=True, eq=False)
class Route:
    """Route: the road of a plan, before it is driven. Points every :data:`SPACING` of the way.

    Args:
        curvature: (p,) of the road, 1/m, positive to the right.
        cones: (p,) what a lane of cones adds to it, 1/m.
        speed_limit: (p,) the legal one, m/s.
        stops: Whether its stops are known: lines, lights and queues of the scenario, not emergencies.
    """

    curvature: Floats
    cones: Floats
    speed_limit: Floats
    stops: bool = True

    @classmethod
    def of_road(cls, curvature: Floats, speed_limit: float, stops: bool = True) -> Route:
        """A path that is the road's own."""
        return cls(curvature, np.zeros_like(curvature), np.full(len(curvature), speed_limit), stops)

    @classmethod
    def of_cones(cls, curvature: Floats, speed_limit: float) -> Route:
        """A path between cones, on a straight road."""
        return cls(np.zeros_like(curvature), curvature, np.full(len(curvature), speed_limit))

    @classmethod
    def unknown(cls, curvature: Floats, speed_limit: float) -> Route:
        """A path that nobody knows ahead: the road is straight, and no stop is on it."""
        zero = np.zeros_like(curvature)
        return cls(zero, zero, np.full(len(curvature), speed_limit), stops=False)


class Ahead(NamedTuple):
    """The road ahead of n places, at m distances each.

    Args:
        curvature: (n, m) 1/m, positive to the right.
        grade: (n, m) rad, positive uphill.
        bank: (n, m) rad, right side down positive.
        speed_limit: (n, m) m/s.
        stop_distance: (n,) m to the next stop; :data:`NO_STOP` where none is known.
    """

    curvature: Floats
    grade: Floats
    bank: Floats
    speed_limit: Floats
    stop_distance: Floats


@dataclass(frozen=True, eq=False)
class RoadMap:
    """Road map of a drive: the road, and where the car is on it at each sample.

    Args:
        curvature: (p,) of the road, 1/m, positive to the right; points every :data:`SPACING` of the way.
        cones: (p,) what a lane of cones adds to it, 1/m.
        grade: (p,) rad, positive uphill.
        bank: (p,) rad, right side down positive.
        speed_limit: (p,) the legal one, m/s.
        station: (n,) way of the car at each sample, m.
        stop_distance: (n,) m to the next stop; :data:`NO_STOP` where none is known.
        known: (n,) whether the map is there.
    """

    curvature: Floats
    cones: Floats
    grade: Floats
    bank: Floats
    speed_limit: Floats
    station: Floats
    stop_distance: Floats
    known: NDArray[np.bool_]

    def __post_init__(self) -> None:
        columns = (self.curvature, self.cones, self.grade, self.bank, self.speed_limit)
        if len({len(column) for column in columns}) != 1 or len(self.curvature) < 2:
            raise DataError("a road map needs at least 2 points, as many of each column")
        if not len(self.station) == len(self.stop_distance) == len(self.known):
            raise DataError("a road map needs station, stop_distance and known of every sample")
        if not all(np.isfinite(column).all() for column in (*columns, self.station, self.stop_distance)):
            raise DataError("a road map must be made of finite numbers")

    @classmethod
    def of_route(
        cls, route: Route, grade: Floats, bank: Floats | None, station: Floats, speed: Floats
    ) -> RoadMap:
        """The map of a plan that was driven: its stops are where the car stood.

        Args:
            route: What is known of the road.
            grade: (p,) rad.
            bank: (p,) rad; level if None.
            station: (n,) way of the car, m.
            speed: (n,) of the car, m/s.
        """
        return cls(
            curvature=route.curvature,
            cones=route.cones,
            grade=grade,
            bank=np.zeros_like(grade) if bank is None else bank,
            speed_limit=route.speed_limit,
            station=station,
            stop_distance=_to_stops(station, speed) if route.stops else np.full(len(station), NO_STOP),
            known=np.ones(len(station), dtype=bool),
        )

    @classmethod
    def of_recording(cls, speed: Floats, yaw_rate: Floats, dt: float, speed_limit: float) -> RoadMap:
        """The map of a recorded drive: the curvature of its own path, smoothed as a map is.

        The log says nothing of slope and stops, so there are none. Lane changes are in it, blurred.

        Args:
            speed: (n,) m/s.
            yaw_rate: (n,) rad/s, positive to the right.
            dt: Time step, s.
            speed_limit: The legal one, m/s.
        """
        # Imported here: this module is part of every command line.
        from scipy.ndimage import gaussian_filter1d

        station = np.concatenate(([0.0], np.cumsum(0.5 * dt * (speed[1:] + speed[:-1]))))
        # Where the car stands it does not turn; what is measured there is the error of the sensor.
        turning = np.where(speed < _STANDING, 0.0, yaw_rate)
        heading = np.concatenate(([0.0], np.cumsum(0.5 * dt * (turning[1:] + turning[:-1]))))
        points = np.arange(0.0, station[-1] + 2.0 * SPACING, SPACING)
        # Where the car stands its station repeats; a little slope makes it a function again.
        along = np.interp(points, station + 1e-9 * np.arange(len(station)), heading)
        curvature = np.gradient(gaussian_filter1d(along, SMOOTHNESS / SPACING, mode="nearest"), SPACING)
        route = Route.of_road(curvature, speed_limit, stops=False)
        return cls.of_route(route, np.zeros_like(points), None, station, speed)

    def __len__(self) -> int:
        return len(self.station)

    def ahead(self, distance: Floats) -> Ahead:
        """The road at distances (n, m), m, ahead of the car at each sample; straight on after its end."""
        place = np.maximum(self.station[:, None] + distance, 0.0) / SPACING
        last = len(self.curvature) - 1
        here = np.minimum(place.astype(np.int64), last - 1)
        share = np.minimum(place - here, 1.0)

        def at(column: Floats) -> Floats:
            return np.asarray(column[here] + share * (column[here + 1] - column[here]))

        curvature = np.where(place > last, 0.0, at(self.curvature + self.cones))
        return Ahead(curvature, at(self.grade), at(self.bank), at(self.speed_limit), self.stop_distance)

    def resampled(self, time: Floats, new: Floats) -> RoadMap:
        """The map at other samples of the drive, from those at ``time`` (n,), s, to those at ``new``."""
        nearest = np.clip(np.searchsorted(time, new), 0, len(time) - 1)
        return replace(
            self,
            station=np.interp(new, time, self.station),
            stop_distance=np.interp(new, time, self.stop_distance),
            known=self.known[nearest],
        )

    def unannounced(self) -> RoadMap:
        """The map alone, without what a scenario knows: no cones, no stops."""
        none = np.full(len(self), NO_STOP)
        return replace(self, cones=np.zeros_like(self.cones), stop_distance=none)

    def wrong(self, scale: float = 1.0, shift: float = 0.0) -> RoadMap:
        """The map with an error: curvature times a factor, and everything ``shift`` meters farther ahead."""
        stop = np.where(self.stop_distance < NO_STOP, self.stop_distance + shift, NO_STOP)
        return replace(
            self,
            curvature=scale * self.curvature,
            cones=scale * self.cones,
            station=self.station - shift,
            stop_distance=np.maximum(stop, 0.0),
        )

    def unmapped(self, where: NDArray[np.bool_]) -> RoadMap:
        """The map with points (p,) at which it is straight, whatever is driven there."""
        return replace(
            self, curvature=np.where(where, 0.0, self.curvature), cones=np.where(where, 0.0, self.cones)
        )

    def missing(self, where: NDArray[np.bool_]) -> RoadMap:
        """The map with samples (n,) in which it is not there."""
        return replace(self, known=self.known & ~where)


SMOOTHNESS: Final = 5.0
"""Standard deviation of the smoothing of a recorded path, m (engineering choice)."""

_STANDING: Final = 0.2
"""Speed below which a car stands, m/s."""


def _to_stops(station: Floats, speed: Floats) -> Floats:
    """(n,) distance to where the car stands next, m: 0 while it stands, and none after the last stop."""
    standing = speed < _STANDING
    distance = np.full(len(station), NO_STOP)
    # From the end backwards: the place of the next stop as seen from each sample.
    index = np.where(standing, np.arange(len(station)), len(station))
    following = np.minimum.accumulate(index[::-1])[::-1]
    known = following < len(station)
    distance[known] = np.maximum(station[following[known]] - station[known], 0.0)
    # A drive that begins standing has no stop there: it has stood since ever.
    if standing[0]:
        begins = int(np.argmin(standing)) if not standing.all() else len(station)
        distance[:begins] = NO_STOP
    return distance
