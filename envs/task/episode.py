"""What is drawn for one episode."""

from __future__ import annotations

from typing import Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..platform.machines import Platform
from ..platform.parameters import UNLIMITED
from ..precision import real, vec9
from . import draws
from .options import EpisodeOptions, RandomisationOptions

Floats = NDArray[np.float64]

N_DRAWS: Final = 32
"""Random words an episode takes: drive, machine, start, noise, two sensor gains, nine of the start pose,
nine actuator gains, and room for more, so that adding one leaves the others as they were."""

DRIVE, MACHINE, START, NOISE = range(4)
SENSOR_GAINS: Final = slice(4, 6)
POSE: Final = slice(6, 15)
ACTUATOR_GAINS: Final = slice(15, 24)


@wp.struct
class Episode:
    """Constants of one episode."""

    last: int  # sample of the drive at which it is truncated
    noise: int  # seed of the sensor noise
    force_gain: real  # of the cab's accelerometers
    rate_gain: real  # of its gyroscopes
    actuator_gain: vec9


def draw(keys: NDArray[np.uint64], episodes: NDArray[np.int64]) -> NDArray[np.uint64]:
    """(n, N_DRAWS) words of the episodes (n,) of environments with keys (n,)."""
    return draws.words(keys, episodes, N_DRAWS)


def start_samples(
    words: NDArray[np.uint64], lengths: NDArray[np.integer], options: EpisodeOptions, dt: float
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last sample of episodes in drives of ``lengths`` (n,) samples."""
    ends = lengths - 1
    steps = ends if options.duration is None else np.minimum(ends, round(options.duration / dt))
    first = np.zeros_like(ends)
    if options.random_start:
        first = np.floor(draws.uniform(words[:, START]) * (ends - steps + 1)).astype(ends.dtype)
    return first.astype(np.int32), (first + steps).astype(np.int32)


def start_poses(words: NDArray[np.uint64], scale: Floats, share: float) -> Floats:
    """(n, 9) poses within a share of each machine's :func:`pose_scale` (n, 9), in the order of ``AXES``."""
    signed = share * (2.0 * draws.uniform(words[:, POSE]) - 1.0)
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
    options: RandomisationOptions,
) -> None:
    """Write the constants of the masked environments' episodes; ``words`` and ``last`` are theirs alone."""
    signed = 2.0 * draws.uniform(words) - 1.0
    gains = 1.0 + options.sensor_gain * signed[:, SENSOR_GAINS]
    view["last"][mask] = last
    view["noise"][mask] = (words[:, NOISE] >> np.uint64(33)).astype(np.int32)
    view["force_gain"][mask], view["rate_gain"][mask] = gains.T
    view["actuator_gain"][mask] = 1.0 + options.actuator_gain * signed[:, ACTUATOR_GAINS]
