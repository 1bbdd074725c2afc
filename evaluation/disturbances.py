"""What a controller was not made for: slower actuators, delay, noise, another car, fiercer drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Annotated

import numpy as np
from pydantic import Field

from ..baselines import ForeknowingPolicy
from ..envs.car import Car
from ..envs.cues import GRAVITY, CueTrace
from ..envs.errors import ConfigurationError
from ..envs.platform import ActuatorDynamics, Platform
from ..envs.settings import Positive, configuration, to_dict
from .fitting import moved_to, policy_on
from .rollout import AnyPolicy
from .sensor_noise import NOISE_VERSION, SensorNoise, with_noise
from .study import Condition
from .suite import CueSource

NOMINAL = "nominal"
"""Name of the condition without a disturbance."""


@configuration
class Disturbances:
    """Sizes of the disturbances, each tried alone.

    Args:
        lag: Natural frequency of the actuators' second-order lag, rad/s, critically damped: it delays slow
            motion by 2 / lag.
        dead_time: Of the actuators, s.
        noise: Of the sensors.
        fierceness: Factor on all accelerations of the drives; see :func:`fiercer`.
    """

    lag: Positive = 30.0
    dead_time: Positive = 0.05
    noise: SensorNoise = SensorNoise()
    fierceness: Annotated[float, Field(ge=1.0, le=4.0)] = 2.0


def fiercer(cues: CueTrace, factor: float) -> CueTrace:
    """The same way driven sqrt(factor) times as fast.

    Along a given path all accelerations grow with the square of the speed, forward ones as well, and yaw
    rates with the speed. A car whose suspension is linear rolls and pitches by angles that grow as its
    accelerations: gravity in the cab's axes grows by the factor, too, and roll and pitch rates by factor
    sqrt(factor). So specific force beyond rest is the factor times what it was. In this picture a hill gets
    steeper, too, and tires set no limit.

    Args:
        cues: A drive.
        factor: On all accelerations.
    """
    speed = math.sqrt(factor)
    rest = np.array([0.0, 0.0, -GRAVITY])
    turning = speed * np.array([factor, factor, 1.0])
    faster = replace(
        cues,
        time=cues.time[0] + (cues.time - cues.time[0]) / speed,
        specific_force=rest + factor * (cues.specific_force - rest),
        angular_velocity=turning * cues.angular_velocity,
        angular_acceleration=speed * turning * cues.angular_acceleration,
    )
    return faster.resampled(cues.dt)


def with_dynamics(platform: Platform, dynamics: ActuatorDynamics) -> Platform:
    """The machine with the same lag and dead time in all its actuators."""
    carriage, turntable = platform.carriage, platform.turntable
    return replace(
        platform,
        hexapod=replace(platform.hexapod, dynamics=dynamics),
        carriage=None if carriage is None else replace(carriage, dynamics=dynamics),
        turntable=None if turntable is None else replace(turntable, dynamics=dynamics),
    )


@dataclass(frozen=True)
class Study:
    """What a study of robustness drives.

    Args:
        platform: The machine.
        car: The car.
        other: Another car.
        maneuvers: The maneuvers of a car.
        disturbances: Sizes.
        causal: Names or files of policies that are left out if they are told the drive beforehand.
    """

    platform: Platform
    car: Car
    other: Car
    maneuvers: Callable[[Car], Mapping[str, CueSource]]
    disturbances: Disturbances
    causal: frozenset[str] = frozenset()

    def conditions(self) -> list[Condition]:
        """The nominal condition, then one for each disturbance.

        Every policy is made for the machine as it should be and knows nothing of the disturbance.
        """
        lag, dead_time = self.disturbances.lag, self.disturbances.dead_time
        lagging = ActuatorDynamics(natural_frequency=lag)
        late = ActuatorDynamics(dead_time=dead_time)
        return [
            self._nominal,
            self._slower("lag", f"actuators with a lag of {lag:g} rad/s: {2e3 / lag:.0f} ms late", lagging),
            self._slower("dead time", f"actuators that answer {dead_time * 1e3:.0f} ms late", late),
            self._noisy(),
            replace(
                self._nominal,
                name="other car",
                description=f"the maneuvers driven by {self.other.name}",
                car=self.other,
                maneuvers=self.maneuvers(self.other),
            ),
            self._fierce(),
        ]

    @cached_property
    def _nominal(self) -> Condition:
        own = self.maneuvers(self.car)
        about = "as the controllers were made for"
        return Condition(NOMINAL, about, self.platform, self.car, own, self._made)

    def _made(self, name: str) -> AnyPolicy:
        policy = policy_on(name, self.platform)
        if name in self.causal and isinstance(policy, ForeknowingPolicy):
            raise ConfigurationError(
                f"{name} is told the drive before it begins; give --policies {name} to see it all the same"
            )
        return policy

    def _slower(self, name: str, description: str, dynamics: ActuatorDynamics) -> Condition:
        driven = with_dynamics(self.platform, dynamics)

        def make(policy: str) -> AnyPolicy:
            return moved_to(self._made(policy), driven)

        return replace(self._nominal, name=name, description=description, platform=driven, make=make)

    def _noisy(self) -> Condition:
        noise = self.disturbances.noise

        def make(policy: str) -> AnyPolicy:
            return with_noise(self._made(policy), noise)

        sizes = f"{noise.force:g} m/s² and {math.degrees(noise.rate):.2g} deg/s"
        about = {"noise": {"version": NOISE_VERSION, **to_dict(noise)}}
        description = f"white noise of {sizes} on the cues seen"
        return replace(self._nominal, name="noise", description=description, make=make, about=about)

    def _fierce(self) -> Condition:
        factor = self.disturbances.fierceness
        drives = {name: partial(_fiercer, source, factor) for name, source in self._nominal.maneuvers.items()}
        description = f"the same ways {math.sqrt(factor):.2f} times as fast, with {factor:g} times the forces"
        return replace(self._nominal, name="fierce", description=description, maneuvers=drives)


def _fiercer(source: CueSource, factor: float) -> CueTrace:
    return fiercer(source(), factor)
