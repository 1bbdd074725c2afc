"""Drives: standard maneuvers, random drives and recorded drives.

What needs the vehicle model is imported when it is asked for, so that names are listed at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .registry import (
    SUITES,
    describe_maneuver,
    describe_recording,
    get_maneuver,
    get_recording,
    maneuver_names,
    recording_names,
    register,
)

if TYPE_CHECKING:
    from .sampling import (
        HELD_OUT_SEEDS,
        RandomDrives,
        drive_seeds,
        drives_names,
        held_out_drives,
        load_drives,
        random_drive,
        random_drives,
    )
    from .standard import Maneuver

__all__ = [
    "HELD_OUT_SEEDS",
    "SUITES",
    "Maneuver",
    "RandomDrives",
    "describe_maneuver",
    "describe_recording",
    "drive_seeds",
    "drives_names",
    "get_maneuver",
    "get_recording",
    "held_out_drives",
    "load_drives",
    "maneuver_names",
    "random_drive",
    "random_drives",
    "recording_names",
    "register",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = "standard" if name == "Maneuver" else "sampling"
    return getattr(import_module(f"{__name__}.{module}"), name)
