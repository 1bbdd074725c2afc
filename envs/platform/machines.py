"""Configuration of a motion base: carriage, hexapod, turntable and cab, with limits and actuators, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..errors import ConfigurationError
from ..settings import Positive, Vector2, Vector3, configuration

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Joints = Annotated[tuple[Vector3, ...], Field(min_length=6, max_length=6)]
ACTUATORS = ("carriage_x", "carriage_y", "leg_1", "leg_2", "leg_3", "leg_4", "leg_5", "leg_6", "turntable")
"""Names of the nine actuators."""

AXES = ("carriage_x", "carriage_y", "surge", "sway", "heave", "roll", "pitch", "yaw", "turntable")
"""Names of the nine degrees of freedom an action commands, in its order."""

UNLIMITED: Final = 1e9
"""Travel of an unlimited turntable in the kernels, rad: finite, so that no infinity meets a zero."""

LOCKED: Final = 1.0
"""Velocity and acceleration limit of a missing subsystem, whose travel is zero."""


LONGEST_DEAD_TIME: Final = 10.0
"""s; each of its time steps takes memory."""


@configuration
class ActuatorDynamics:
    """Second-order lag and dead time of one subsystem.

    Args:
        natural_frequency: omega, rad/s; None for no lag (unity).
        damping: zeta, at least 1 so that no limit is overshot.
        dead_time: Pure delay, s; rounded to whole time steps.
    """

    natural_frequency: Positive | None = None
    damping: Annotated[float, Field(ge=1.0)] = 1.0
    dead_time: Annotated[float, Field(ge=0.0, le=LONGEST_DEAD_TIME)] = 0.0


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
class Braking:
    """How gently the machine brakes for its limits: a bound on the jerk that the driver feels of it.

    Carriage, hexapod and turntable each keep it by themselves, wherever there is room to: braking begins
    earlier. A time step of 10 ms changes the felt force by a hundredth of it.

    Args:
        jerk: Greatest jerk at the driver's head from a subsystem that brakes for an end of travel or its
            speed limit, m/s^3; 150 is a good choice. None: it brakes with full acceleration, at the last
            moment. That is the default, as the offline optimum plans so.
    """

    jerk: Positive | None = None


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
        braking: How gently limits hold the machine back.
    """

    name: str
    description: str
    hexapod: Hexapod
    carriage: Carriage | None = None
    turntable: Turntable | None = None
    cab: Cab = Cab()
    braking: Braking = Braking()

    def without_carriage(self) -> Platform:
        """The same machine with its carriage locked at 0."""
        return replace(self, name=f"{self.name}, no carriage", carriage=None)

    def without_turntable(self) -> Platform:
        """The same machine with its turntable locked at 0."""
        return replace(self, name=f"{self.name}, no turntable", turntable=None)


def limits_of(platform: Platform) -> dict[str, NDArray[np.float64]]:
    """position_min, position_max, velocity, acceleration, each (9,) in the order of :data:`ACTUATORS`.

    A missing subsystem has no travel, an unlimited turntable :data:`UNLIMITED`.
    """
    carriage, hexapod, turntable = platform.carriage, platform.hexapod, platform.turntable
    low, high = np.zeros(9), np.zeros(9)
    velocity, acceleration = np.full(9, LOCKED), np.full(9, LOCKED)
    if carriage is not None:
        low[:2], high[:2] = np.array([carriage.travel_x, carriage.travel_y]).T
        velocity[:2], acceleration[:2] = carriage.velocity, carriage.acceleration
    low[2:8], high[2:8] = hexapod.extension
    velocity[2:8], acceleration[2:8] = hexapod.velocity, hexapod.acceleration
    if turntable is not None:
        low[8], high[8] = turntable.travel or (-UNLIMITED, UNLIMITED)
        velocity[8], acceleration[8] = turntable.velocity, turntable.acceleration
    return {"position_min": low, "position_max": high, "velocity": velocity, "acceleration": acceleration}


def actuator_limits(platform: Platform) -> dict[str, NDArray[np.float64]]:
    """position_min, position_max, velocity, acceleration, each (9,), for people: unlimited is infinite."""
    limits = limits_of(platform)
    limits["position_min"][limits["position_min"] <= -UNLIMITED] = -np.inf
    limits["position_max"][limits["position_max"] >= UNLIMITED] = np.inf
    return limits


class Exceeded(NamedTuple):
    """Which actuators are beyond which limit, each (..., 9)."""

    position: Flags
    velocity: Flags
    acceleration: Flags


def limits_exceeded(
    limits: Mapping[str, Floats], position: Floats, velocity: Floats, acceleration: Floats, tolerance: float
) -> Exceeded:
    """Hold the motion of actuators against their limits; a NaN exceeds every limit.

    Args:
        limits: As of :func:`~.parameters.actuator_limits`.
        position: (..., 9) m and rad, in the order of ``ACTUATORS``.
        velocity: (..., 9) m/s and rad/s.
        acceleration: (..., 9) m/s^2 and rad/s^2.
        tolerance: Of each limit, relative; of a position, of the whole stroke.
    """
    low, high = limits["position_min"], limits["position_max"]
    slack = tolerance * (high - low)
    return Exceeded(
        ~((position >= low - slack) & (position <= high + slack)),
        ~(np.abs(velocity) <= (1.0 + tolerance) * limits["velocity"]),
        ~(np.abs(acceleration) <= (1.0 + tolerance) * limits["acceleration"]),
    )
