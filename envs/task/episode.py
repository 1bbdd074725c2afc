"""Episodes: their random numbers, and the drives and machines drawn with them.

Random numbers depend only on an environment's seed and its episode, so they are the same alone or in a batch.
A counter goes through the finalizer of SplitMix64 (Steele, Lea and Flood 2014): a whole batch is drawn at
once, and an environment's numbers do not depend on its neighbors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..car import Car, get_car
from ..car.simulation import Plan, simulate
from ..cues import GRAVITY, CueTrace
from ..errors import ConfigurationError
from ..maneuvers import drive_seeds, get_maneuver, get_recording, recording_names
from ..maneuvers.standard import LARGEST_OFFSET, off_path
from ..platform.machines import UNLIMITED, ActuatorDynamics, Platform
from ..platform.presets import get_platform
from ..platform.randomization import random_platform
from ..simulator.kernels.step import CueCost
from .kernels.reward import RewardOptions
from .options import EpisodeOptions, RandomizationOptions, TaskOptions

Floats = NDArray[np.float64]
Words = NDArray[np.uint64]

_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_MIX: Final = (np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))
_SHIFTS: Final = (np.uint64(30), np.uint64(27), np.uint64(31))


def key_of(seed: int) -> int:
    """The 64-bit key of a seed: neighboring seeds have unlike keys."""
    return int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])


def mixed(words: Words) -> Words:
    """SplitMix64's finalizer: every bit of a word changes half the bits of the result."""
    words = (words ^ (words >> _SHIFTS[0])) * _MIX[0]
    words = (words ^ (words >> _SHIFTS[1])) * _MIX[1]
    return words ^ (words >> _SHIFTS[2])


def words(keys: Words, episodes: NDArray[np.integer[Any]], count: int) -> Words:
    """(n, count) random words for the episodes (n,) of environments with keys (n,)."""
    streams = mixed(keys + _GOLDEN * (episodes.astype(np.uint64) + np.uint64(1)))
    counters = np.arange(1, count + 1, dtype=np.uint64) * _GOLDEN
    return mixed(streams[:, None] + counters)


def uniform(words: Words) -> NDArray[np.float64]:
    """Numbers in [0, 1) from the upper 53 bits of words."""
    return np.asarray((words >> np.uint64(11)) * 2.0**-53, dtype=np.float64)


N_DRAWS: Final = 32
"""Random words an episode takes: drive, machine, start, noise, two sensor gains, nine of the start pose,
nine actuator gains, and room for more, so that adding one leaves the others as they were."""

DRIVE, MACHINE_STREAM, START, NOISE = range(4)
SENSOR_GAINS: Final = slice(4, 6)
POSE: Final = slice(6, 15)
ACTUATOR_GAINS: Final = slice(15, 24)


def draw(keys: Words, episodes: NDArray[np.int64]) -> Words:
    """(n, N_DRAWS) words of the episodes (n,) of environments with keys (n,)."""
    return words(keys, episodes, N_DRAWS)


def start_samples(
    words: NDArray[np.uint64], lengths: NDArray[np.integer], options: EpisodeOptions, dt: float
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last sample of episodes in drives of ``lengths`` (n,) samples."""
    ends = lengths - 1
    steps = ends if options.duration is None else np.minimum(ends, round(options.duration / dt))
    first = np.zeros_like(ends)
    if options.random_start:
        first = np.floor(uniform(words[:, START]) * (ends - steps + 1)).astype(ends.dtype)
    return first.astype(np.int32), (first + steps).astype(np.int32)


def start_poses(words: NDArray[np.uint64], scale: Floats, share: float) -> Floats:
    """(n, 9) poses within a share of each machine's :func:`pose_scale` (n, 9), in the order of ``AXES``."""
    signed = share * (2.0 * uniform(words[:, POSE]) - 1.0)
    return np.asarray(signed * scale)


def pose_scale(platform: Platform) -> Floats:
    """(9,) largest absolute values of start poses, m and rad, in the order of ``AXES``.

    Half of the legs' share goes to displacement, half to tilt: a displacement s changes no leg by more
    than |s|, and angles change none by more than their sum times the largest distance of a joint.
    """
    carriage, hexapod, turntable = platform.carriage, platform.hexapod, platform.turntable
    scale = np.zeros(9)
    if carriage is not None:
        scale[0] = np.min(np.abs(carriage.travel_x))
        scale[1] = np.min(np.abs(carriage.travel_y))
    half = 0.5 * np.min(np.abs(hexapod.extension))
    radius = np.linalg.norm(hexapod.upper_joints, axis=1).max()
    scale[2:5] = half / np.sqrt(3.0)
    scale[5:8] = half / (3.0 * radius)
    if turntable is not None:
        travel = turntable.travel or (-UNLIMITED, UNLIMITED)
        scale[8] = min(np.pi, *np.abs(travel))
    return scale


def fill_episodes(
    view: NDArray[np.void],
    mask: NDArray[np.bool_],
    words: NDArray[np.uint64],
    last: NDArray[np.int32],
    options: RandomizationOptions,
) -> None:
    """Write the constants of the masked environments' episodes; ``words`` and ``last`` are theirs alone."""
    signed = 2.0 * uniform(words) - 1.0
    gains = 1.0 + options.sensor_gain * signed[:, SENSOR_GAINS]
    view["last"][mask] = last
    view["noise"][mask] = (words[:, NOISE] >> np.uint64(33)).astype(np.int32)
    view["force_gain"][mask], view["rate_gain"][mask] = gains.T
    view["actuator_gain"][mask] = 1.0 + options.actuator_gain * signed[:, ACTUATOR_GAINS]


def cost_scales(drives: Sequence[CueTrace], options: RewardOptions) -> Floats:
    """(n,) what rewards are divided by on each drive: 1 + ``standstill`` times J there, over the scale."""
    standing = np.array([standstill_cost(drive, options.zone) for drive in drives])
    return np.asarray((1.0 + options.standstill * standing) / options.scale)


def standstill_cost(drive: CueTrace, cost: CueCost) -> float:
    """J of a machine that stands still: the mean square of the car's cues, over the indifference zone."""
    force = (drive.specific_force + np.array([0.0, 0.0, GRAVITY])) / cost.force
    rate = drive.angular_velocity / cost.rate
    return float(np.mean(np.sum(force**2 + rate**2, axis=1)))


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
        off = [k for k, (plan, trace) in enumerate(zip(plans, traces, strict=True)) if off_path(plan, trace)]
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
        if off_path(plan, trace):
            raise _off_its_path(plan, trace)
    return traces


def _off_its_path(plan: Plan, trace: CueTrace) -> ConfigurationError:
    car = plan.car
    return ConfigurationError(
        f"{car.name} with tire friction {car.tires.friction:.2f} came {off_path(plan, trace):.1f} m off the "
        f"path of {plan.name} (at most {LARGEST_OFFSET:g} m): raise randomization.friction, or leave the "
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
    return tuple(drive.scaled(episode.scale) for drive in make(episode, randomization))


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
