"""Machines as configurations: carriage, hexapod, turntable and cab, in SI units."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from ..errors import ConfigurationError
from ..settings import Positive, Vector2, Vector3, configuration
from .kernels.step import ActuatorDynamics

Joints = Annotated[tuple[Vector3, ...], Field(min_length=6, max_length=6)]
UNITY = ActuatorDynamics()


def _check_range(name: str, travel: Vector2) -> None:
    if not travel[0] <= 0.0 <= travel[1]:
        raise ConfigurationError(f"{name} must contain 0, found {list(travel)}")


@configuration
class Carriage:
    """The x-y carriage, each axis by itself.

    Args:
        travel_x: Least and greatest position, m.
        travel_y: The same for y, m.
        velocity: Greatest speed of each axis, m/s.
        acceleration: Greatest acceleration of each axis, m/s^2.
        dynamics: Lag and dead time.
    """

    travel_x: Vector2
    travel_y: Vector2
    velocity: Positive
    acceleration: Positive
    dynamics: ActuatorDynamics = UNITY

    def __post_init__(self) -> None:
        _check_range("travel_x", self.travel_x)
        _check_range("travel_y", self.travel_y)


@configuration
class Hexapod:
    """Six legs between a lower frame (F_V) and the payload platform (F_H); leg i joins B_i to A_i.

    Args:
        upper_joints: A_i in F_H, m.
        lower_joints: B_i in F_V, m.
        neutral: S_0, the origin of F_H at neutral in F_V, m (z down, so its z is negative).
        extension: Least and greatest extension of a leg from its neutral length, m.
        velocity: Greatest speed of a leg, m/s.
        acceleration: Greatest acceleration of a leg, m/s^2.
        dynamics: Lag and dead time.
    """

    upper_joints: Joints
    lower_joints: Joints
    neutral: Vector3
    extension: Vector2
    velocity: Positive
    acceleration: Positive
    dynamics: ActuatorDynamics = UNITY

    def __post_init__(self) -> None:
        _check_range("extension", self.extension)
        shortest = float(np.min(self.neutral_lengths)) + self.extension[0]
        if shortest <= 0.0:
            raise ConfigurationError(
                f"extension[0] = {self.extension[0]} leaves a leg of {shortest:.3f} m; a leg needs a length"
            )

    @property
    def neutral_lengths(self) -> np.ndarray:
        """(6,) L_i of Eq. (13), m."""
        legs = np.array(self.upper_joints) - np.array(self.lower_joints) + np.array(self.neutral)
        return np.asarray(np.linalg.norm(legs, axis=1))


@configuration
class Turntable:
    """The turntable on the hexapod's platform.

    Args:
        travel: Least and greatest angle, rad; None for an unlimited one.
        velocity: Greatest speed, rad/s.
        acceleration: Greatest acceleration, rad/s^2.
        dynamics: Lag and dead time.
    """

    travel: Vector2 | None
    velocity: Positive
    acceleration: Positive
    dynamics: ActuatorDynamics = UNITY

    def __post_init__(self) -> None:
        if self.travel is not None:
            _check_range("travel", self.travel)


@configuration
class Cab:
    """Where the driver sits.

    Args:
        reference_point: D_o, the origin of F_S from the origin of F_H with the turntable at 0, Eq. (14), m.
        head: OP_SS, the driver's head (F_P) from the origin of F_S, Eq. (30), m.
    """

    reference_point: Vector3 = (0.0, -0.35, -0.80)
    head: Vector3 = (-0.10, 0.0, -0.65)


@configuration
class Platform:
    """A whole machine: any subsystem but the hexapod may be missing.

    Args:
        name: How it is called in tables.
        description: One line for people, with the source.
        hexapod: Legs and joints.
        carriage: The x-y carriage, or None.
        turntable: The turntable, or None.
        cab: Where the driver sits.
    """

    name: str
    description: str
    hexapod: Hexapod
    carriage: Carriage | None = None
    turntable: Turntable | None = None
    cab: Cab = Cab()

    def without_carriage(self) -> Platform:
        """The same machine with its carriage locked at 0."""
        return replace(self, name=f"{self.name}, no carriage", carriage=None)

    def without_turntable(self) -> Platform:
        """The same machine with its turntable locked at 0."""
        return replace(self, name=f"{self.name}, no turntable", turntable=None)
