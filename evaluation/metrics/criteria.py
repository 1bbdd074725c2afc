"""Criteria: the thresholds of the metrics."""

from __future__ import annotations

from math import radians
from typing import Final

from ...envs.settings import Positive, Vector2, Vector3, configuration
from ...envs.simulator.kernels.step import CueCost

_ZONE: Final = CueCost()


@configuration
class References:
    """The policies between which the normalized score is measured; see ``comparison.py``.

    Args:
        baseline: The reference washout, score 0.
        optimum: The policy with the lowest J there is, score 1.
        perceived_optimum: The policy with the lowest perceived J there is, score 1 of the perceived J.
    """

    baseline: str = "optimal-washout-tuned"
    optimum: str = "optimum"
    perceived_optimum: str = "optimum-perceived"


@configuration
class Criteria:
    """Published thresholds, and the references of the score. Every table of this project has the defaults.

    Args:
        indifference_force: Indifference zone of specific force, m/s^2: an error that no driver minds (Slob
            et al., Bosch Rexroth).
        indifference_rate: Indifference zone of angular velocity, rad/s (the same source; 3 deg/s).
        force_threshold: Perception of specific force x, y, z, m/s^2 (Reid and Nahon, from memory).
        rate_threshold: Perception of angular velocity x, y, z, rad/s (Zacharias; Reid and Nahon;
            3.0, 3.6, 2.6 deg/s).
        tilt_rate: Rate up to which tilt coordination goes unnoticed, rad/s (3 deg/s, SIMONA).
        delay_range: Largest delay or lead searched, s; a cue that comes later is a missing cue instead.
        delay_correlation: Least correlation at which a delay is reported at all.
        action_tolerance: An applied acceleration this near the requested one is not clipped, m/s^2, rad/s^2.
        vibration_above: Motion of a higher frequency is vibration, Hz.
        vibration_window: Length over which it is averaged, s (the running RMS of ISO 2631-1).
        worst_window: Length of the window of the worst second, s.
        incongruence_weights: Weights of the longitudinal and lateral mismatch in the predicted rating of
            incongruence (Kolff et al.).
        incongruence_time: Time constant of its low-pass, s. The published one is not public: this value is
            a choice, not calibrated.
        tilt_rate_high: Higher limit of the tilt rate, rad/s (6 deg/s; Nesti et al. find thresholds of roll
            from 0.7 deg/s alone in the dark to 6.3 deg/s in active driving).
        jerk_below: Low-pass of specific force before its derivative, Hz.
        sickness_exposure: Time for which a drive is repeated for the incidence of motion sickness, s.
        dose_least: A dose of the car below this (in its own unit) is too small for a ratio.
        references: Policies between which the normalized score is measured.
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
    worst_window: Positive = 1.0
    incongruence_weights: Vector2 = (0.34, 0.66)
    incongruence_time: Positive = 2.0
    tilt_rate_high: Positive = radians(6.0)
    jerk_below: Positive = 10.0
    sickness_exposure: Positive = 1800.0
    dose_least: Positive = 1e-3
    references: References = References()

    @property
    def indifference_zone(self) -> tuple[float, ...]:
        """Indifference zone of f x, y, z and w x, y, z."""
        return (self.indifference_force,) * 3 + (self.indifference_rate,) * 3

    @property
    def thresholds(self) -> tuple[float, ...]:
        """Perception thresholds of f x, y, z and w x, y, z."""
        return self.force_threshold + self.rate_threshold
