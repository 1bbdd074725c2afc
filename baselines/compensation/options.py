"""Options of the compensation, and the lateness that is known of a machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from ...envs.platform.machines import SUBSYSTEMS, UNITY, ActuatorDynamics, Platform
from ...envs.settings import NonNegative, Positive, configuration


@configuration
class CompensationOptions:
    """How lateness is compensated; all sizes were chosen on random drives.

    Args:
        bandwidth: Natural frequency that a slower subsystem's lag is led to, rad/s; critically
            damped.
        most_lead: Greatest factor by which a lead raises a natural frequency. It raises fast accelerations
            by the square of it.
        position_gain: By which set-points that a limit held back come to where they should be, 1/s^2.
        rate_gain: The same of their rates, 1/s.
        force_change: Greatest predicted change of a specific force, m/s^2.
        rate_change: Greatest predicted change of an angular velocity, rad/s.
        known: Known lateness over the true one; other than 1 in studies of what a wrong one costs.
    """

    bandwidth: Positive = 45.0
    most_lead: Annotated[float, Field(ge=1.0, le=10.0)] = 2.0
    position_gain: NonNegative = 4.0
    rate_gain: NonNegative = 4.0
    force_change: NonNegative = 2.0
    rate_change: NonNegative = 0.2
    known: Positive = 1.0


@dataclass(frozen=True)
class SubsystemLateness:
    """What is known of one subsystem, and what is left of it behind the lead.

    Args:
        dynamics: Known lag and dead time.
        led: Natural frequency after the lead, rad/s; None where its lag is not led.
    """

    dynamics: ActuatorDynamics
    led: float | None

    @property
    def left(self) -> float:
        """Lateness behind the lead, s."""
        return self.dynamics.lateness if self.led is None else self.dynamics.dead_time + 2.0 / self.led


@dataclass(frozen=True)
class Lateness:
    """The lateness known of a machine.

    Args:
        subsystems: Carriage, hexapod and turntable; one that is missing is not late.
    """

    subsystems: tuple[SubsystemLateness, ...]

    @property
    def common(self) -> float:
        """Lateness of the whole machine behind leads and delays, s: that of its latest subsystem."""
        return max(one.left for one in self.subsystems)

    def delay(self, subsystem: int) -> float:
        """By how much set-points of a subsystem wait for those of the latest one, s."""
        return self.common - self.subsystems[subsystem].left


def lateness_of(platform: Platform, options: CompensationOptions | None = None) -> Lateness:
    """The lateness known of a machine, from its lags and dead times.

    Args:
        platform: The machine.
        options: Of the compensation.
    """
    options = options or CompensationOptions()
    return Lateness(tuple(_subsystem(platform.dynamics.get(name, UNITY), options) for name in SUBSYSTEMS))


def _subsystem(true: ActuatorDynamics, options: CompensationOptions) -> SubsystemLateness:
    omega = None if true.natural_frequency is None else true.natural_frequency / options.known
    known = ActuatorDynamics(
        natural_frequency=omega, damping=true.damping, dead_time=options.known * true.dead_time
    )
    if omega is None or omega >= options.bandwidth:
        return SubsystemLateness(known, None)
    return SubsystemLateness(known, min(options.bandwidth, options.most_lead * omega))
