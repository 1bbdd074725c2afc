"""Signals that a log does not have, computed from others: rates without a gyro."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from ..cues import Floats
from .mounting import SMOOTHING_HZ, Mounting, gather, rest_force
from .signals import Change, Grid, ImportOptions, low_pass
from .units import FORCES, RATES

_COURSE_CUTOFF_HZ: Final = 1.0
"""A receiver gives its course in steps, whose rate is noise above this, Hz."""

_LEAST_SPEED: Final = 3.0
"""Below this speed f_y / v is noise, and a receiver's course as well, m/s."""


def with_rates(
    raw: Mapping[str, Floats], grid: Grid, options: ImportOptions
) -> tuple[dict[str, Floats], ImportOptions, Change]:
    """Signals with a yaw rate about the vertical and no other, and the options that hold then."""
    force = np.stack([raw[name] for name in FORCES], axis=1)
    speed, course = raw.get("speed"), raw.get("course")

    def down(yaw_rate: Floats, toward: Floats) -> Floats:
        """The vertical in device axes (3,), as the estimate of the mounting finds it."""
        if options.roll_deg is not None or options.pitch_deg is not None:
            angles = (math.radians(options.roll_deg or 0.0), math.radians(options.pitch_deg or 0.0))
            return np.asarray(Mounting(*angles).matrix[2])
        evidence = gather(
            grid.rate_hz, force, yaw_rate[:, None] * toward, speed, course, options.standstill_m_s
        )
        rest = rest_force(evidence)[0]
        return np.asarray(-rest / np.linalg.norm(rest))

    mean = force.mean(axis=0)
    toward = np.asarray(-mean / np.linalg.norm(mean))
    if options.rates == "from-course":
        yaw_rate = _rate_of_course(raw, grid, options)
        said = "rates not measured: the yaw rate is the rate of the course"
    else:
        yaw_rate = _rate_of_force(raw, force, toward, grid)
        said = "rates not measured: the yaw rate is f_y / v, for axes of the device that are right-handed"
    for _ in range(2):
        toward = down(yaw_rate, toward)
    rates = dict(zip(RATES, (yaw_rate[:, None] * toward).T, strict=True))
    fixed = replace(options, rate_sign="keep", rate_bias_deg_s=(0.0, 0.0, 0.0))
    return {**raw, **rates}, fixed, Change(f"{said}; roll and pitch rates are zero")


def _rate_of_course(raw: Mapping[str, Floats], grid: Grid, options: ImportOptions) -> Floats:
    course = low_pass(raw["course"], grid.rate_hz, min(_COURSE_CUTOFF_HZ, options.cutoff_hz))
    rate = np.asarray(np.gradient(course, 1.0 / grid.rate_hz))
    if "speed" in raw:
        # A receiver that stands reports any course.
        rate = rate * np.clip(raw["speed"] / _LEAST_SPEED, 0.0, 1.0)
    return rate


def _rate_of_force(raw: Mapping[str, Floats], force: Floats, toward: Floats, grid: Grid) -> Floats:
    """f_y / v, with y to the right of the horizontal direction along which the force follows dv/dt."""
    smooth = low_pass(force, grid.rate_hz, SMOOTHING_HZ)
    speed = low_pass(raw["speed"], grid.rate_hz, SMOOTHING_HZ)
    flat = smooth - smooth.mean(axis=0)
    flat = flat - np.outer(flat @ toward, toward)
    along = np.gradient(speed, 1.0 / grid.rate_hz)
    forward = np.linalg.lstsq(np.column_stack([along, np.ones(len(along))]), flat, rcond=None)[0][0]
    if np.linalg.norm(forward) < 0.3:
        forward = np.array([1.0, 0.0, 0.0]) - toward[0] * toward
    right = np.cross(toward, forward / np.linalg.norm(forward))
    lateral = low_pass((force - force.mean(axis=0)) @ right, grid.rate_hz, SMOOTHING_HZ)
    moving = np.clip(speed / _LEAST_SPEED, 0.0, 1.0)
    return np.asarray(lateral / np.maximum(speed, _LEAST_SPEED) * moving)
