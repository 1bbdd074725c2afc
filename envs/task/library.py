"""The drives and machines that episodes draw from."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from ..car import Car, drive_seeds, get_car, get_maneuver, get_recording, recording_names
from ..car.simulation import simulate
from ..cues import CueTrace
from ..platform.actuators import ActuatorDynamics
from ..platform.machines import Platform
from ..platform.presets import get_platform
from .options import EpisodeOptions, RandomisationOptions, TaskOptions

_FRICTION_STREAM: Final = 1
_MACHINE_STREAM: Final = 2


def slippery(car: Car, factor: float) -> Car:
    """The same car with its tires' friction times a factor."""
    return replace(car, tires=replace(car.tires, friction=factor * car.tires.friction))


def _frictions(episode: EpisodeOptions, randomisation: RandomisationOptions, count: int) -> list[float]:
    rng = np.random.default_rng((episode.library_seed, _FRICTION_STREAM))
    return [float(value) for value in rng.uniform(*randomisation.friction, count)]


def _random_drives(episode: EpisodeOptions, randomisation: RandomisationOptions) -> list[CueTrace]:
    source, seeds = episode.random, drive_seeds(episode.library, episode.library_seed)
    frictions = _frictions(episode, randomisation, len(seeds))
    plans = []
    for seed, factor in zip(seeds, frictions, strict=True):
        car = source.plan(seed, episode.drive_duration).car
        plans.append(source.plan(seed, episode.drive_duration, car=slippery(car, factor)))
    return simulate(plans)


def _named_drives(episode: EpisodeOptions, randomisation: RandomisationOptions) -> list[CueTrace]:
    """Each recording once, and each maneuver by each car."""
    frictions = iter(_frictions(episode, randomisation, len(episode.drives) * len(episode.random.cars)))
    plans, recordings = [], []
    for name in episode.drives:
        if name in recording_names():
            recordings.append(get_recording(name))
            continue
        for car in episode.random.cars:
            plans.append(get_maneuver(name).plan(slippery(get_car(car), next(frictions))))
    return [*simulate(plans), *recordings]


@lru_cache(maxsize=8)
def library_of(episode: EpisodeOptions, randomisation: RandomisationOptions) -> tuple[CueTrace, ...]:
    """The drives that options ask for; the same options give the same drives.

    Raises:
        DataError: a car left the range of its model (a friction too low for the drive).
    """
    make = _named_drives if episode.drives else _random_drives
    return tuple(make(episode, randomisation))


def platform_of(options: TaskOptions) -> Platform:
    """The machine, by name if it is given by name."""
    return get_platform(options.platform) if isinstance(options.platform, str) else options.platform


def machines_of(options: TaskOptions) -> list[Platform]:
    """The machines that episodes draw from: the platform, or variants of it with drawn dynamics."""
    platform, ranges = platform_of(options), options.randomisation
    if ranges.natural_frequency is None and ranges.dead_time is None:
        return [platform]
    rng = np.random.default_rng((options.episode.library_seed, _MACHINE_STREAM))
    return [_variant(platform, ranges, rng) for _ in range(ranges.machines)]


def _variant(platform: Platform, ranges: RandomisationOptions, rng: np.random.Generator) -> Platform:
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
