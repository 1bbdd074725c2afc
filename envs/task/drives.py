"""The drives and machines that episodes draw from."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from ..car import Car, get_car
from ..car.simulation import Plan, simulate
from ..cues import CueTrace
from ..errors import ConfigurationError
from ..maneuvers import drive_seeds, get_maneuver, get_recording, recording_names
from ..maneuvers.maneuver import LARGEST_OFFSET
from ..platform.machines import ActuatorDynamics, Platform
from ..platform.presets import get_platform
from ..platform.randomization import random_platform
from .options import EpisodeOptions, RandomizationOptions, TaskOptions

_FRICTION_STREAM: Final = 1
_MACHINE_STREAM: Final = 2
_PLATFORM_STREAM: Final = 3

_DRAWS: Final = 8
"""How often a random drive is drawn anew, at most, whose car comes off its path."""

_OFTEN: Final = 0.1
"""Share of random drives that may be drawn anew: where more come off, what is asked for is wrong."""


def slippery(car: Car, factor: float) -> Car:
    """The same car with its tires' friction times a factor."""
    return replace(car, tires=replace(car.tires, friction=factor * car.tires.friction))


def _frictions(episode: EpisodeOptions, randomization: RandomizationOptions, count: int) -> list[float]:
    rng = np.random.default_rng((episode.library_seed, _FRICTION_STREAM))
    return [float(value) for value in rng.uniform(*randomization.friction, count)]


def _random_drives(episode: EpisodeOptions, randomization: RandomizationOptions) -> list[CueTrace]:
    """The library; drives whose car comes off its path are drawn anew, if they are few."""
    count = episode.library
    seeds = drive_seeds(_DRAWS * count, episode.library_seed)
    frictions = _frictions(episode, randomization, count)
    drives: dict[int, CueTrace] = {}
    rows = list(range(count))
    for draw in range(_DRAWS):
        plans = [_slippery_plan(episode, seeds[draw * count + row], frictions[row]) for row in rows]
        traces = simulate(plans)
        drives.update(zip(rows, traces, strict=True))
        off = [
            k for k, (plan, trace) in enumerate(zip(plans, traces, strict=True)) if _comes_off(plan, trace)
        ]
        if not off:
            break
        if draw == _DRAWS - 1 or (draw == 0 and len(off) > max(1.0, _OFTEN * count)):
            raise _off_its_path(plans[off[0]], traces[off[0]])
        rows = [rows[k] for k in off]
    return [drives[row] for row in range(count)]


def _slippery_plan(episode: EpisodeOptions, seed: int, friction: float) -> Plan:
    car = episode.random.plan(seed, episode.drive_duration).car
    return episode.random.plan(seed, episode.drive_duration, car=slippery(car, friction))


def _named_drives(episode: EpisodeOptions, randomization: RandomizationOptions) -> list[CueTrace]:
    """Each recording once, and each maneuver by each car."""
    frictions = iter(_frictions(episode, randomization, len(episode.drives) * len(episode.random.cars)))
    plans, recordings = [], []
    for name in episode.drives:
        if name in recording_names():
            recordings.append(get_recording(name))
            continue
        for car in episode.random.cars:
            plans.append(get_maneuver(name).plan(slippery(get_car(car), next(frictions))))
    return [*_driven(plans), *recordings]


def _driven(plans: list[Plan]) -> list[CueTrace]:
    """The drives that come of plans, all of them on their paths.

    Raises:
        ConfigurationError: a car came off its path; open-loop steering tests have none to come off.
    """
    traces = simulate(plans)
    for plan, trace in zip(plans, traces, strict=True):
        if _comes_off(plan, trace):
            raise _off_its_path(plan, trace)
    return traces


def _offset(trace: CueTrace) -> float:
    """Largest distance from the path, m."""
    return float(np.abs(trace.channels["path_offset_m"]).max())


def _comes_off(plan: Plan, trace: CueTrace) -> bool:
    return plan.steering is None and _offset(trace) > LARGEST_OFFSET


def _off_its_path(plan: Plan, trace: CueTrace) -> ConfigurationError:
    car = plan.car
    return ConfigurationError(
        f"{car.name} with tire friction {car.tires.friction:.2f} came {_offset(trace):.1f} m off the path of "
        f"{plan.name} (at most {LARGEST_OFFSET:g} m): raise randomization.friction, or leave the "
        "drive or the car out of episode"
    )


@lru_cache(maxsize=8)
def library_of(episode: EpisodeOptions, randomization: RandomizationOptions) -> tuple[CueTrace, ...]:
    """The drives that options ask for; the same options give the same drives.

    Raises:
        ConfigurationError: a car came off its path (a friction too low for the drive): of a maneuver, of more
            than a tenth of the random drives, or of one drawn eight times.
        DataError: a car left the range of its model.
    """
    make = _named_drives if episode.drives else _random_drives
    return tuple(make(episode, randomization))


def platform_of(options: TaskOptions) -> Platform:
    """The machine, by name if it is given by name."""
    return get_platform(options.platform) if isinstance(options.platform, str) else options.platform


def machines_of(options: TaskOptions) -> list[Platform]:
    """The machines that episodes draw from: the platform, or variants of it, drawn.

    Raises:
        ConfigurationError: none of the drawn machines closes.
    """
    platform, ranges, seed = platform_of(options), options.randomization, options.episode.library_seed
    if ranges.natural_frequency is None and ranges.dead_time is None and ranges.platform is None:
        return [platform]
    machines = [platform] * ranges.platforms
    if ranges.platform is not None:
        rng = np.random.default_rng((seed, _PLATFORM_STREAM))
        names = [f"{platform.name}-{k}" for k in range(ranges.platforms)]
        machines = [random_platform(platform, ranges.platform, rng, name) for name in names]
    rng = np.random.default_rng((seed, _MACHINE_STREAM))
    return [_variant(machine, ranges, rng) for machine in machines]


def _variant(platform: Platform, ranges: RandomizationOptions, rng: np.random.Generator) -> Platform:
    def drawn(own: ActuatorDynamics) -> ActuatorDynamics:
        if ranges.natural_frequency is not None:
            own = replace(own, natural_frequency=float(rng.uniform(*ranges.natural_frequency)))
        if ranges.dead_time is not None:
            own = replace(own, dead_time=float(rng.uniform(*ranges.dead_time)))
        return own

    carriage, hexapod, turntable = platform.carriage, platform.hexapod, platform.turntable
    return replace(
        platform,
        carriage=carriage and replace(carriage, dynamics=drawn(carriage.dynamics)),
        hexapod=replace(hexapod, dynamics=drawn(hexapod.dynamics)),
        turntable=turntable and replace(turntable, dynamics=drawn(turntable.dynamics)),
    )
