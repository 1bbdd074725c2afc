"""The thresholds every metric is measured against."""

from __future__ import annotations

from math import radians

from ..envs.cue_cost import CueCost
from ..envs.settings import Positive, Vector3, configuration

_ZONE = CueCost()


@configuration
class References:
    """The policies between which the share of the gap is measured; see ``share.py``.

    Args:
        baseline: The washout at its best, share 0.
        optimum: The lowest J there is, share 1.
        perceived_optimum: The lowest perceived J there is, share 1 of the perceived J.
    """

    baseline: str = "classical-tuned"
    optimum: str = "optimum"
    perceived_optimum: str = "optimum-perceived"


@configuration
class Criteria:
    """Published thresholds, and what J is compared with; every table of this project has the defaults.

    Args:
        indifference_force: Error of specific force no driver minds, m/s^2 (Slob et al., Bosch Rexroth).
        indifference_rate: Error of angular velocity no driver minds, rad/s (the same; 3 deg/s).
        force_threshold: Perception of specific force x, y, z, m/s^2 (Reid and Nahon, from memory).
        rate_threshold: Perception of angular velocity x, y, z, rad/s (Zacharias; Reid and Nahon;
            3.0, 3.6, 2.6 deg/s).
        tilt_rate: Rate up to which tilt coordination goes unnoticed, rad/s (3 deg/s, SIMONA).
        delay_range: Largest delay or lead searched, s; a cue that comes later is a missing cue instead.
        delay_correlation: Least correlation at which a delay is reported at all.
        action_tolerance: An applied acceleration this near the asked one is not clipped, m/s^2 and rad/s^2.
        vibration_above: Motion of a higher frequency is vibration, Hz.
        vibration_window: Length over which it is averaged, s (the running RMS of ISO 2631-1).
        references: Policies between which the share of the gap is measured.
    """

    indifference_force: Positive = _ZONE.force
    indifference_rate: Positive = _ZONE.rate
    force_threshold: Vector3 = (0.17, 0.17, 0.28)
    rate_threshold: Vector3 = (radians(3.0), radians(3.6), radians(2.6))
    tilt_rate: Positive = radians(3.0)
    delay_range: Positive = 1.0
    delay_correlation: Positive = 0.5
    action_tolerance: Positive = 1e-4
    vibration_above: Positive = 4.0
    vibration_window: Positive = 1.0
    references: References = References()

    @property
    def scales(self) -> tuple[float, ...]:
        """Indifference zone of f x, y, z and w x, y, z."""
        return (self.indifference_force,) * 3 + (self.indifference_rate,) * 3

    @property
    def thresholds(self) -> tuple[float, ...]:
        """Perception thresholds of f x, y, z and w x, y, z."""
        return self.force_threshold + self.rate_threshold
