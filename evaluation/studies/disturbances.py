"""Noise on what a policy sees of the cues: sensors in the car and in the cab that are not perfect."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ...baselines import ForeknowingPolicy, Policy
from ...envs.car import Car
from ...envs.cues import GRAVITY, CueTrace
from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ...envs.platform.kernels import ActuatorDynamics
from ...envs.settings import NonNegative, Positive, configuration, to_dict
from ...envs.simulator.kernels.observation import SCALES, SLICES
from ...envs.task.observation import ADDED
from ..rollout import AnyPolicy, TaskPolicy, Wrapped
from ..suite import CueSource
from .study import Condition, moved_to, policy_on

Array = NDArray[Any]

NOISE_VERSION: Final = 2
"""Of what noise is: drives of another one are driven again. 1 was a constant for policies without memory."""

_KINDS = (
    ("reference_force", "simulator_force", "force_error"),
    ("reference_rate", "simulator_rate", "rate_error"),
)
_ERRORS = {added.row.name: added.row.scale for added in ADDED}


@configuration
class SensorNoise:
    """White noise, new in every time step; the defaults are of the class of a cheap inertial sensor.

    Args:
        force: Standard deviation on each axis of the specific force wanted and felt, m/s^2.
        rate: Standard deviation on each axis of the angular velocity wanted and felt, rad/s (0.3 deg/s).
        seed: Of the noise, which is the same for every policy.
    """

    force: NonNegative = 0.05
    rate: NonNegative = math.radians(0.3)
    seed: int = 0


def with_noise(policy: AnyPolicy, noise: SensorNoise) -> AnyPolicy:
    """The policy behind noisy sensors. What it is told of the drive ahead stays true."""
    if isinstance(policy, ForeknowingPolicy):
        return _ForeknowingBehind(policy, noise)
    return _TaskBehind(policy, noise) if isinstance(policy, TaskPolicy) else _Behind(policy, noise)


class _Behind(Wrapped):
    """A policy that sees noisy observations.

    Its state is the policy's own in a tuple, so that it is never None but at the beginning, not even where
    the policy has none.

    Args:
        policy: What is behind the sensors.
        noise: Of the sensors.
    """

    errors: Mapping[str, slice] = MappingProxyType({})
    """Where the observation has the difference of cues wanted and felt, by name."""
    in_cab: float = 1.0
    """Share of the noise that the cab's cues get: 0 where a model tells them, not sensors."""

    def __init__(self, policy: Policy | TaskPolicy, noise: SensorNoise) -> None:
        super().__init__(policy)
        self._policy, self._noise = policy, noise
        self._draw = np.random.default_rng(noise.seed)

    def predict(
        self,
        observation: Array,
        state: tuple[Any] | None = None,
        episode_start: Array | None = None,
        deterministic: bool = True,
    ) -> tuple[Array, tuple[Any]]:
        """The answer to the observation with noise on it.

        The noise begins anew, for all rows, where ``episode_start`` says of any that a drive begins; where it
        is None, where ``state`` is.
        """
        if state is None if episode_start is None else np.any(episode_start):
            self._draw = np.random.default_rng(self._noise.seed)
        inner = None if state is None else state[0]
        action, memory = self._policy.predict(self._noisy(observation), inner, episode_start, deterministic)
        return action, (memory,)

    def _noisy(self, observation: Array) -> Array:
        seen = np.array(observation)
        shape = (*seen.shape[:-1], 3)
        for (reference, simulated, error), size in zip(
            _KINDS, (self._noise.force, self._noise.rate), strict=True
        ):
            in_car, in_cab = self._draw.normal(scale=size, size=(2, *shape))
            in_cab *= self.in_cab
            seen[..., SLICES[reference]] += in_car / SCALES[reference]
            seen[..., SLICES[simulated]] += in_cab / SCALES[simulated]
            if error in self.errors:
                seen[..., self.errors[error]] += (in_car - in_cab) / _ERRORS[error]
        return seen


class _TaskBehind(_Behind):
    """The same for a policy with an environment of its own; only the newest frame of a stack is noisy."""

    def __init__(self, policy: TaskPolicy, noise: SensorNoise) -> None:
        super().__init__(policy, noise)
        self.task = policy.task
        self.in_cab = float(policy.task.observation.simulator_cue == "machine")
        self.base_policy = getattr(policy, "base_policy", None)
        layout = getattr(policy, "layout", None)
        self.errors = {} if layout is None else {name: layout.slices[name] for name in _ERRORS}


class _ForeknowingBehind(Wrapped):
    """The same for a policy that is told the drive."""

    def __init__(self, policy: ForeknowingPolicy, noise: SensorNoise) -> None:
        super().__init__(policy)
        self._told: Callable[[CueTrace], Policy] = policy.for_drive
        self._noise = noise

    def for_drive(self, cues: CueTrace) -> Policy:
        """The policy for one drive."""
        return _Behind(self._told(cues), self._noise)


# What a controller was not made for: slower actuators, delay, noise, another car, fiercer drives.


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
        time_scaling: Factor on all accelerations of the drives; see :func:`fiercer`.
    """

    lag: Positive = 30.0
    dead_time: Positive = 0.05
    noise: SensorNoise = SensorNoise()
    time_scaling: Annotated[float, Field(ge=1.0, le=4.0)] = 2.0


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
        factor = self.disturbances.time_scaling
        drives = {name: partial(_fiercer, source, factor) for name, source in self._nominal.maneuvers.items()}
        description = f"the same ways {math.sqrt(factor):.2f} times as fast, with {factor:g} times the forces"
        return replace(self._nominal, name="fierce", description=description, maneuvers=drives)


def _fiercer(source: CueSource, factor: float) -> CueTrace:
    return fiercer(source(), factor)
