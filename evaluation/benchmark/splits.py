"""Splits: the fixed, versioned sets of drives of the benchmark, and how two of them are found to be equal.

``standard`` has the standard maneuvers, ``recorded`` every recorded drive of the package, and ``held-out``
random drives whose seeds, cars and drivers no training or tuning draws.

A split has a hash of its definition: names, parameters of maneuvers and cars, seeds, and recorded cues. It
is the same on every machine. Cues that a car model computes are not: processors round differently. So a
result keeps a fingerprint of each drive beside the hash, and fingerprints must agree to 0.1 %. The hash
changes when a split is defined anew, a fingerprint when its car drives otherwise.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from ...envs.car import get_car
from ...envs.cues import CueTrace
from ...envs.errors import look_up
from ...envs.maneuvers import get_maneuver, get_recording, recording_names
from ...envs.maneuvers.sampling import HELD_OUT_SEEDS, held_out_drives, load_drives
from ...envs.settings import to_dict
from ...envs.simulator.simulator import TIME_STEP

BENCHMARK_VERSION: Final = 1
"""Version of the benchmark: of its splits and its statistics."""

STANDARD: Final = (
    "steady-turn",
    "braking",
    "lane-change",
    "acceleration",
    "double-lane-change",
    "obstacle-avoidance",
    "slalom",
    "step-steer",
    "sine-with-dwell",
    "stop-and-go",
    "roundabout",
    "hill",
)
"""Maneuvers of the split ``standard``; those that another package registers are none of them."""

HELD_OUT_DRIVES: Final = 200
HELD_OUT_DURATION: Final = 30.0
"""Of a drive of the split ``held-out``, s."""

Fingerprint = tuple[float, ...]
"""Number of samples, then the RMS of specific force (gravity left out) and angular velocity, x, y, z each."""


@dataclass(frozen=True, eq=False)
class Split:
    """A set of drives.

    Args:
        name: Its name.
        version: Rises when its drives change on purpose.
        description: One line.
        definition: Everything that defines its drives, as plain values.
        make: Makes the cues of its drives, whose names differ.
    """

    name: str
    version: int
    description: str
    definition: Mapping[str, Any]
    make: Callable[[], Sequence[CueTrace]]

    @cached_property
    def hash(self) -> str:
        """SHA-256 of name, version and definition, in hexadecimal; the same on every machine."""
        whole = {"name": self.name, "version": self.version, "definition": self.definition}
        return hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()

    @cached_property
    def cues(self) -> dict[str, CueTrace]:
        """The drives by name, at the time step of the machine."""
        return {drive.name: drive.resampled(TIME_STEP) for drive in self.make()}

    @property
    def fingerprints(self) -> dict[str, Fingerprint]:
        """The fingerprint of each drive."""
        return {name: fingerprint(drive) for name, drive in self.cues.items()}


def fingerprint(drive: CueTrace) -> Fingerprint:
    """What distinguishes a drive from another, coarsely enough to be compared between machines."""
    force = drive.specific_force - drive.specific_force.mean(axis=0)
    motion = np.hstack([force, drive.angular_velocity])
    return (float(len(drive)), *np.sqrt(np.mean(motion**2, axis=0)).tolist())


def same_drive(one: Fingerprint, other: Fingerprint) -> bool:
    """Whether two fingerprints are of one drive: equal to 0.1 % and 1e-4 m/s^2 or rad/s."""
    return len(one) == len(other) and bool(np.allclose(one, other, rtol=1e-3, atol=1e-4))


def standard_split() -> Split:
    """The standard maneuvers, driven by the sedan."""
    car = get_car("sedan")
    maneuvers = {name: get_maneuver(name) for name in STANDARD}
    return Split(
        name="standard",
        version=1,
        description="standard maneuvers in a sedan",
        definition={
            "car": to_dict(car),
            "maneuvers": {name: to_dict(maneuver) for name, maneuver in maneuvers.items()},
        },
        make=lambda: [maneuver.drive(car) for maneuver in maneuvers.values()],
    )


def recorded_split() -> Split:
    """Every recorded drive of the package; the version is their number."""
    drives = [get_recording(name) for name in recording_names()]
    return Split(
        name="recorded",
        version=len(drives),
        description="recorded drives of real cars",
        definition={"recordings": {drive.name: drive.digest() for drive in drives}},
        make=lambda: drives,
    )


def held_out_split(count: int = HELD_OUT_DRIVES, duration: float = HELD_OUT_DURATION) -> Split:
    """Random drives of the preset ``held-out``: seeds, cars and drivers that no training or tuning draws.

    Args:
        count: How many.
        duration: Of each, s.
    """
    source = load_drives("held-out")
    return Split(
        name="held-out",
        version=1,
        description="random drives by other drivers in other cars, with seeds that no training draws",
        definition={
            "first_seed": HELD_OUT_SEEDS,
            "count": count,
            "duration": duration,
            "drives": to_dict(source),
            "cars": {name: to_dict(get_car(name)) for name in source.cars},
        },
        make=lambda: held_out_drives(count, duration, source),
    )


SPLITS: Final[dict[str, Callable[[], Split]]] = {
    "standard": standard_split,
    "recorded": recorded_split,
    "held-out": held_out_split,
}
"""The splits of the benchmark by name."""


def get_split(name: str) -> Split:
    """A split by name.

    Raises:
        UnknownNameError: there is none.
    """
    return look_up("split", name, SPLITS)()
