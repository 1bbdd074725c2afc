"""The drives and machines that episodes draw from."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from ..car import Car, drive_seeds, get_car, get_maneuver, get_recording, recording_names
from ..car.maneuver import LARGEST_OFFSET
from ..car.simulation import Plan, simulate
from ..cues import CueTrace
from ..errors import ConfigurationError
from ..platform.actuators import ActuatorDynamics
from ..platform.builds import drawn_machine
from ..platform.machines import Platform
from ..platform.presets import get_platform
from .options import EpisodeOptions, RandomisationOptions, TaskOptions

_FRICTION_STREAM: Final = 1
_MACHINE_STREAM: Final = 2
_BUILD_STREAM: Final = 3


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
    return _driven(plans)


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
    return [*_driven(plans), *recordings]


def _driven(plans: list[Plan]) -> list[CueTrace]:
    """The drives that come of plans, all of them on their paths.

    Raises:
        ConfigurationError: a car came off its path; open-loop steering tests have none to come off.
    """
    traces = simulate(plans)
    for plan, trace in zip(plans, traces, strict=True):
        offset = float(np.abs(trace.channels["path_offset_m"]).max())
        if plan.steering is None and offset > LARGEST_OFFSET:
            car = plan.car
            raise ConfigurationError(
                f"{car.name} with tire friction {car.tires.friction:.2f} came {offset:.1f} m off the path of "
                f"{plan.name} (at most {LARGEST_OFFSET:g} m): raise randomisation.friction, or leave the "
                "drive or the car out of episode"
            )
    return traces


@lru_cache(maxsize=8)
def library_of(episode: EpisodeOptions, randomisation: RandomisationOptions) -> tuple[CueTrace, ...]:
    """The drives that options ask for; the same options give the same drives.

    Raises:
        ConfigurationError: a car came off its path (a friction too low for the drive).
        DataError: a car left the range of its model.
    """
    make = _named_drives if episode.drives else _random_drives
    return tuple(make(episode, randomisation))


def platform_of(options: TaskOptions) -> Platform:
    """The machine, by name if it is given by name."""
    return get_platform(options.platform) if isinstance(options.platform, str) else options.platform


def machines_of(options: TaskOptions) -> list[Platform]:
    """The machines that episodes draw from: the platform, or variants of it, drawn.

    Raises:
        ConfigurationError: no machine of the builds asked for closes.
    """
    platform, ranges, seed = platform_of(options), options.randomisation, options.episode.library_seed
    if ranges.natural_frequency is None and ranges.dead_time is None and ranges.build is None:
        return [platform]
    machines = [platform] * ranges.machines
    if ranges.build is not None:
        rng = np.random.default_rng((seed, _BUILD_STREAM))
        names = [f"{platform.name}-{k}" for k in range(ranges.machines)]
        machines = [drawn_machine(platform, ranges.build, rng, name) for name in names]
    rng = np.random.default_rng((seed, _MACHINE_STREAM))
    return [_variant(machine, ranges, rng) for machine in machines]


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
