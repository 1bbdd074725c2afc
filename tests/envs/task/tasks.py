"""Environments small enough to test with: short drives and a small library."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from motion_cueing.baselines.washout import ClassicalWashout, ScheduledWashout
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import RandomDrives
from motion_cueing.envs.platform.randomization import PlatformRanges
from motion_cueing.envs.task import (
    ActionOptions,
    EpisodeOptions,
    ObservationOptions,
    RandomizationOptions,
    RewardOptions,
    RewardWeights,
)

SHORT = EpisodeOptions(library=3, drive_duration=2.0, duration=0.4, random_start=True)

EVERY_OPTION: dict[str, dict[str, Any]] = {
    "defaults": {},
    "preview": {"observation": ObservationOptions(preview=5, preview_spacing=0.1)},
    "perceived": {"observation": ObservationOptions(perceived=True)},
    "true motion": {"observation": ObservationOptions(true_motion=True)},
    "told machine": {"observation": ObservationOptions(machine=True)},
    "stack": {"observation": ObservationOptions(stack=3)},
    "jerk": {"action": ActionOptions(mode="jerk")},
    "velocity": {"action": ActionOptions(mode="velocity")},
    "residual": {"action": ActionOptions(mode="residual", authority=0.1), "base": ClassicalWashout()},
    "commands": {
        "action": ActionOptions(
            mode="residual", base="classical", axes=("roll", "carriage_x"), repeat=4, ramp=True
        ),
        "observation": ObservationOptions(scaling="typical"),
        "reward": RewardOptions(against_base=True, standstill=0.1, floor=5.0),
    },
    "gains": {"action": ActionOptions(mode="gains"), "base": ScheduledWashout()},
    "frozen": {"action": ActionOptions(frozen=("turntable", "carriage_x", "carriage_y"))},
    "repeat": {"action": ActionOptions(repeat=5)},
    "authority": {"action": ActionOptions(authority=0.2)},
    "reward": {"reward": RewardOptions(weights=RewardWeights(perceived_error=1.0, false_cues=1.0))},
    "termination": {"episode": replace(SHORT, terminate_on_failure=True)},
    "maneuver": {"episode": replace(SHORT, drives=("braking",))},
    "recording": {"episode": replace(SHORT, drives=("commute",))},
    "offset": {"episode": replace(SHORT, platform_offset=0.5)},
    "cars": {
        "episode": replace(SHORT, random=RandomDrives(cars=("sedan", "bmw-320i"))),
        "randomization": RandomizationOptions(friction=(0.7, 1.0)),
    },
    "actuators": {
        "randomization": RandomizationOptions(
            natural_frequency=(20.0, 60.0), dead_time=(0.0, 0.05), platforms=3
        )
    },
    "builds": {
        "observation": ObservationOptions(machine=True),
        "randomization": RandomizationOptions(
            platform=PlatformRanges(travel=(0.5, 1.0), size=(0.4, 1.0), without_carriage=0.5), platforms=3
        ),
    },
    "sensors": {
        "randomization": RandomizationOptions(
            actuator_gain=0.1, sensor_gain=0.1, force_noise=0.05, rate_noise=0.01
        )
    },
    "dim hexapod": {"platform": "dim-hexapod"},
    "24-inch": {"platform": "24-inch"},
    "nads-1": {"platform": "nads-1"},
    "telban": {"vestibular": "telban"},
}
"""Arguments of the environment that use each option, on short episodes."""


def options(name: str) -> dict[str, Any]:
    """Arguments for one entry of :data:`EVERY_OPTION`."""
    return {"episode": SHORT} | EVERY_OPTION[name]


def drive(name: str = "weave", samples: int = 301, dt: float = 0.01) -> CueTrace:
    """A gentle drive of sines in all axes, f = [0, 0, -9.81] at its beginning."""
    time = dt * np.arange(samples)
    phases = np.outer(time, [1.0, 1.4, 0.6])
    force = np.sin(phases) * [1.5, 1.2, 0.4] + [0.0, 0.0, -9.81]
    rate = np.sin(1.3 * phases) * [0.05, 0.04, 0.2]
    return CueTrace(name, time, force, rate)
