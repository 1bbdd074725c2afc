"""Drives packed for the view: pose of the machine, cues of car and simulator, and the car's road."""

from __future__ import annotations

from typing import Final

import numpy as np

from ....envs.cues import CueTrace
from ...metrics import Criteria, cab_motion, cue_error
from ...trajectory import Floats, Trajectory
from ..packing import MOST_SAMPLES, PackedDrive, Packer
from ..signals import Drives

_LENGTH: Final = 5e-5
"""Resolution of a position, m."""
_ANGLE: Final = 2e-5
"""Of an angle, rad."""
_FORCE: Final = 2e-3
"""Of a specific force, m/s^2."""
_RATE: Final = 2e-4
"""Of an angular velocity, rad/s."""
_ROAD: Final = 0.02
"""Of a place on the road, m."""
_MOST_ROAD: Final = 3_000
"""Points of a road."""


def pack_view(drives: Drives, cues: CueTrace | None = None, criteria: Criteria | None = None) -> PackedDrive:
    """Pack what a view shows of the drives of one maneuver.

    Of a drive with more than :data:`~.packing.MOST_SAMPLES` samples, equally spaced ones are packed.

    Args:
        drives: Trajectory of each policy (at least one), all of the same cues.
        cues: The cues that were driven, for the car's road, where they are known.
        criteria: Thresholds of J.
    """
    criteria, packer = criteria or Criteria(), Packer()
    first = next(iter(drives.values()))
    policies = {}
    for name, drive in drives.items():
        rows = _rows(len(drive))
        positions = [*drive.carriage.T, *drive.hexapod.T, drive.turntable]
        steps = [_LENGTH] * 5 + [_ANGLE] * 4
        policies[name] = {
            "error": float(np.mean(cue_error(*cab_motion(drive), criteria))),
            "time": packer.add_time(drive.time[rows]),
            "pose": [packer.add(one[rows], step) for one, step in zip(positions, steps, strict=True)],
            **_cues(packer, rows, drive.f_simulator, drive.w_simulator),
        }
    rows = _rows(len(first))
    about = {
        "name": first.maneuver,
        "car_name": first.car,
        "duration": [float(first.time[0]), float(first.time[-1])],
        "car": {
            "time": packer.add_time(first.time[rows]),
            **_cues(packer, rows, first.f_reference, first.w_reference),
        },
        "road": _road(packer, cues, first),
        "policies": policies,
        "arrays": packer.arrays,
    }
    return PackedDrive(about, packer.compressed())


def _rows(n: int) -> slice:
    return slice(None, None, -(-n // MOST_SAMPLES))


def _cues(packer: Packer, rows: slice, force: Floats, rate: Floats) -> dict[str, list[int]]:
    return {
        "force": [packer.add(column[rows], _FORCE) for column in force.T],
        "rate": [packer.add(column[rows], _RATE) for column in rate.T],
    }


def _road(packer: Packer, cues: CueTrace | None, drive: Trajectory) -> dict[str, int] | None:
    """Where the car is over time: from the drive's own channels, or from its speed and yaw rate."""
    if cues is None or len(cues) != len(drive):
        return None
    channels = cues.channels
    if {"x_m", "y_m", "heading_rad"} <= set(channels):
        x, y, heading = channels["x_m"], channels["y_m"], channels["heading_rad"]
    elif "speed_m_s" in channels:
        heading = np.cumsum(cues.angular_velocity[:, 2]) * cues.dt
        x, y = (np.cumsum(channels["speed_m_s"] * way(heading)) * cues.dt for way in (np.cos, np.sin))
    else:
        return None
    rows = slice(None, None, max(1, len(cues) // _MOST_ROAD))
    return {
        "time": packer.add_time(drive.time[rows]),
        "x": packer.add(x[rows], _ROAD),
        "y": packer.add(y[rows], _ROAD),
        "heading": packer.add(heading[rows], 2e-3),
    }
