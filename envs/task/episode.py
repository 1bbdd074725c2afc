"""Episodes: the random numbers of one, and what is drawn with them.

Random numbers depend only on an environment's seed and its episode, so they are the same alone or in a batch.
A counter goes through the finalizer of SplitMix64 (Steele, Lea and Flood 2014): a whole batch is drawn at
once, and an environment's numbers do not depend on its neighbors.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..platform.machines import UNLIMITED, Platform
from .options import EpisodeOptions, RandomizationOptions

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
