"""Robustness: policies under what they were not made for.

The disturbances are slower actuators, dead time, noisy sensors, another car, and drives with larger
accelerations, each alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from ...baselines.compensation import Compensated, CompensationOptions
from ...baselines.interface import Interface, Machines
from ...baselines.policy import Policy, Wrapper, as_policy
from ...envs.car import Car
from ...envs.cues import GRAVITY, CueTrace
from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ...envs.platform.kernels import ActuatorDynamics
from ...envs.settings import NonNegative, Positive, configuration, to_dict
from ...envs.simulator.kernels.observation import SCALES
from ...envs.task.kernels.observation import ADDED
from ..policies import make_policy
from ..suite import CueSource
from .study import Condition

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
        force: Standard deviation on each axis of the specific force of both cues, m/s^2.
        rate: Standard deviation on each axis of the angular velocity of both cues, rad/s (0.3 deg/s).
        seed: Of the noise, which is the same for every policy.
    """

    force: NonNegative = 0.05
    rate: NonNegative = math.radians(0.3)
    seed: int = 0


class NoisySensors(Wrapper):
    """The policy behind noisy sensors; what it knows of the drive ahead stays true.

    The noise begins anew in every drive, the same for every policy.

    Args:
        policy: A policy, or any object with ``predict``.
        noise: Of the sensors.
    """

    def __init__(self, policy: Any, noise: SensorNoise) -> None:
        super().__init__(as_policy(policy))
        self._noise = noise

    def connect(self, machines: Machines) -> Interface:
        """The policy's interface with noise on its observations."""
        return _NoisyInterface(self.inner.connect(machines), self._noise)


class _NoisyInterface(Interface):
    """White noise on the newest observation of an interface, nothing else.

    Differences of cues get the difference of their noise. Rows of simulator cues that a model gives, not
    sensors, get none.
    """

    def __init__(self, inner: Interface, noise: SensorNoise) -> None:
        self._inner, self._noise = inner, noise
        self.simulator, self.live, self.action_size = inner.simulator, inner.live, inner.action_size
        self.steps_per_action, self.slices = inner.steps_per_action, inner.slices
        self._draw = np.random.default_rng(noise.seed)

    @property
    def requested(self) -> Array:  # type: ignore[override]
        return self._inner.requested

    def begin(self, start: ArrayLike | None) -> None:
        self._draw = np.random.default_rng(self._noise.seed)
        self._inner.begin(start)

    def observe(self) -> Array:
        """(n, size) observations with new noise."""
        seen = np.array(self._inner.observe())
        shape = (len(seen), 3)
        for (reference, simulated, error), size in zip(
            _KINDS, (self._noise.force, self._noise.rate), strict=True
        ):
            in_car, in_cab = self._draw.normal(scale=size, size=(2, *shape))
            in_cab *= float(self._inner.simulator_cue_measured)
            seen[:, self.slices[reference]] += in_car / SCALES[reference]
            seen[:, self.slices[simulated]] += in_cab / SCALES[simulated]
            if error in self.slices:
                seen[:, self.slices[error]] += (in_car - in_cab) / _ERRORS[error]
        return seen

    def act(self, action: Array) -> Iterator[None]:
        return self._inner.act(action)

    def follow(self, leader: Any) -> Callable[[], None]:
        return self._inner.follow(leader)


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
        time_scaling: Factor on all accelerations of the drives; see :func:`time_scaled`.
        known: Machines with lag and dead time at once are driven as well, where this is not empty: by
            policies that know nothing of it, and by such that compensate this many times the true lateness.
    """

    lag: Positive = 30.0
    dead_time: Positive = 0.05
    noise: SensorNoise = SensorNoise()
    time_scaling: Annotated[float, Field(ge=1.0, le=4.0)] = 2.0
    known: tuple[Positive, ...] = ()


def time_scaled(cues: CueTrace, factor: float) -> CueTrace:
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
        channels={
            name: speed * values if name.endswith("speed_m_s") else values
            for name, values in cues.channels.items()
        },
    )
    return faster.resampled(cues.dt)


@dataclass(frozen=True)
class Study:
    """What a study of robustness drives.

    Args:
        platform: The machine.
        car: The car.
        other: Another car.
        maneuvers: The maneuvers of a car.
        disturbances: Sizes.
        causal: Names or files of policies that are skipped if they must know the drive beforehand.
    """

    platform: Platform
    car: Car
    other: Car
    maneuvers: Callable[[Car], Mapping[str, CueSource]]
    disturbances: Disturbances
    causal: frozenset[str] = frozenset()

    def conditions(self) -> list[Condition]:
        """The nominal condition, then one for each disturbance.

        Every policy is made for the machine as it should be and knows nothing of the disturbance, but for
        compensated ones, which know a lateness.
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
            self._time_scaled(),
            *self._late(ActuatorDynamics(natural_frequency=lag, dead_time=dead_time)),
        ]

    @cached_property
    def _nominal(self) -> Condition:
        own = self.maneuvers(self.car)
        about = "as the controllers were made for"
        return Condition(NOMINAL, about, self.platform, self.car, own, self._made)

    def _made(self, given: Any) -> Policy:
        policy = make_policy(given, self.platform, force=True)
        if policy.needs_drive and given in self.causal:
            raise ConfigurationError(
                f"{given} knows the drive before it begins; name it in --policies to drive it all the same"
            )
        return policy

    def _slower(self, name: str, description: str, dynamics: ActuatorDynamics) -> Condition:
        driven = self.platform.with_dynamics(dynamics)

        def make(given: Any) -> Policy:
            return self._made(given).on(driven)

        return replace(self._nominal, name=name, description=description, platform=driven, make=make)

    def _late(self, dynamics: ActuatorDynamics) -> list[Condition]:
        """The machine with lag and dead time at once, and compensated; none where nothing is known."""
        if not self.disturbances.known:
            return []
        late = f"lag and dead time at once: {1e3 * dynamics.lateness:.0f} ms late"
        uncompensated = self._slower("late", late, dynamics)
        return [uncompensated, *(self._compensated(uncompensated, k) for k in self.disturbances.known)]

    def _compensated(self, late: Condition, known: float) -> Condition:
        options = CompensationOptions(known=known)

        def make(given: Any) -> Policy:
            return Compensated(self._made(given), options).on(late.platform)

        what = "" if known == 1.0 else f", known ×{known:g}"
        return replace(
            late,
            name=f"late, compensated{what}",
            description=f"{late.description}, compensated{what}",
            make=make,
            about={"compensation": to_dict(options)},
        )

    def _noisy(self) -> Condition:
        noise = self.disturbances.noise

        def make(given: Any) -> Policy:
            return NoisySensors(self._made(given), noise)

        sizes = f"{noise.force:g} m/s² and {math.degrees(noise.rate):.2g} deg/s"
        about = {"noise": {"version": NOISE_VERSION, **to_dict(noise)}}
        description = f"white noise of {sizes} on the cues seen"
        return replace(self._nominal, name="noise", description=description, make=make, about=about)

    def _time_scaled(self) -> Condition:
        factor = self.disturbances.time_scaling
        drives = {
            name: partial(_time_scaled_source, source, factor)
            for name, source in self._nominal.maneuvers.items()
        }
        description = f"the same ways {math.sqrt(factor):.2f} times as fast, with {factor:g} times the forces"
        return replace(self._nominal, name="time scaling", description=description, maneuvers=drives)


def _time_scaled_source(source: CueSource, factor: float) -> CueTrace:
    return time_scaled(source(), factor)
