"""A datagram's content in one set of axes, and the interface of a protocol.

Car axes: x forward, y right, z down. World axes: x north, y east, z down. Both are right-handed. Where a game
has no north, any horizontal axis stands for it: only the sense of the turn matters.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from ..cues import Floats
from ..errors import DataError
from .layout import Layout


def _unknown() -> Floats:
    return np.full(3, np.nan)


@dataclass(frozen=True)
class Sample:
    """What one datagram says; NaN where the protocol says nothing.

    Attributes:
        time: Of the sender's clock, s.
        force: (3,) specific force f = a - g, car axes, m/s^2; given by senders that know it.
        acceleration: (3,) of the car over ground, without gravity, car axes, m/s^2.
        rate: (3,) angular velocity, car axes, rad/s.
        attitude: (3, 3) from world to car axes: its rows are the car's axes in the world.
        velocity: (3,) world axes, m/s.
        position: (3,) world axes, m.
        paused: Whether the sender says that nobody drives: menu, pause, replay. None if it says nothing.
    """

    time: float = math.nan
    force: Floats = field(default_factory=_unknown)
    acceleration: Floats = field(default_factory=_unknown)
    rate: Floats = field(default_factory=_unknown)
    attitude: Floats | None = None
    velocity: Floats = field(default_factory=_unknown)
    position: Floats = field(default_factory=_unknown)
    paused: bool | None = None

    @property
    def moves(self) -> bool:
        """Whether it says anything about motion."""
        return any(
            bool(np.isfinite(part).any())
            for part in (self.force, self.acceleration, self.rate, self.velocity)
        )

    @property
    def broken(self) -> bool:
        """Whether a number is infinite, or a part is known only to some of its axes."""
        whole = (self.velocity, self.position, *(() if self.attitude is None else self.attitude))
        parts = (self.force, self.acceleration, self.rate, *whole)
        return any(bool(np.isinf(part).any()) for part in parts) or any(
            bool(np.isnan(part).any() and not np.isnan(part).all()) for part in whole
        )


class Source(ABC):
    """A protocol: from a datagram to a sample, without memory.

    A further protocol is a module with a subclass, and a name for it in :data:`.sources.SOURCES`.

    Attributes:
        name: By which it is chosen.
        summary: Program and version it was written for.
        port: Where telemetry usually arrives.
        simulator_port: Where the simulator takes requests; 0 if it takes none.
        layouts: Datagrams that are read.
        tick: Resolution of the sender's clock, s; 0 if it is finer than what matters.
        period: Time after which the sender's clock begins again, s.
        uncertain: What the public descriptions leave open; empty if nothing.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    port: ClassVar[int] = 0
    simulator_port: ClassVar[int] = 0
    layouts: ClassVar[tuple[Layout, ...]] = ()
    tick: ClassVar[float] = 0.0
    period: ClassVar[float] = math.inf
    uncertain: ClassVar[str] = ""

    @abstractmethod
    def parse(self, datagram: bytes) -> Sample | None:
        """The sample in a datagram; None for one of the protocol that holds no motion.

        Raises:
            DataError: it is none of this protocol, of another version, or cut off.
        """

    def requests(self) -> tuple[bytes, ...]:
        """Datagrams that ask the simulator to send; none where its own settings say so."""
        return ()

    def layout_of(self, datagram: bytes) -> Layout:
        """The layout whose size a datagram has.

        Raises:
            DataError: there is none.
        """
        for layout in self.layouts:
            if layout.size == len(datagram):
                return layout
        sizes = ", ".join(str(layout.size) for layout in self.layouts)
        raise DataError(f"{self.name}: a datagram of {len(datagram)} bytes; known sizes are {sizes}")


def attitude_of(roll: float, pitch: float, heading: float) -> Floats:
    """(3, 3) from world to car axes; right side down, nose up and to the right are positive, rad."""
    matrix = Rotation.from_euler("ZYX", [heading, pitch, roll]).as_matrix()
    return np.asarray(matrix.T)


def from_east_north_up(vector: Floats) -> Floats:
    """(3,) from x east, y north, z up to north, east, down."""
    return np.array([vector[1], vector[0], -vector[2]])


def from_east_up_north(vector: Floats) -> Floats:
    """(3,) from left-handed x east, y up, z north to north, east, down."""
    return np.array([vector[2], vector[0], -vector[1]])


def from_east_up_south(vector: Floats) -> Floats:
    """(3,) from right-handed x east, y up, z south to north, east, down."""
    return np.array([-vector[2], vector[0], -vector[1]])


def attitude_from_axes(forward: Floats, right: Floats) -> tuple[Floats, bool]:
    """Attitude from the car's forward and right axes in a world with y up, and whether that is right-handed.

    The third axis is the one that points up, as it does in a car on its wheels. So handedness is found, not
    believed. A car on its roof has the attitude of its mirror image.

    Args:
        forward: (3,) in the game's world, of any length.
        right: (3,) likewise.

    Raises:
        DataError: the axes are zero or parallel.
    """
    ahead = forward / max(float(np.linalg.norm(forward)), 1e-9)
    side = right - (right @ ahead) * ahead
    if not (np.isfinite(side).all() and np.linalg.norm(side) > 0.1 and np.linalg.norm(ahead) > 0.5):
        raise DataError("the directions of the car are no axes")
    side = side / np.linalg.norm(side)
    up = np.cross(side, ahead)
    # In right-handed axes right x forward is up.
    right_handed = bool(up[1] >= 0.0)
    if not right_handed:
        up = -up
    change = from_east_up_south if right_handed else from_east_up_north
    return np.array([change(ahead), change(side), -change(up)]), right_handed
