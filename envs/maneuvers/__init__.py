"""Drives: standard maneuvers, random drives and recorded drives."""

from .maneuver import Maneuver
from .random_drives import RandomDrives, drive_seeds, random_drive, random_drives
from .recordings import get_recording, recording_names
from .registry import get_maneuver, maneuver_names

__all__ = [
    "Maneuver",
    "RandomDrives",
    "drive_seeds",
    "get_maneuver",
    "get_recording",
    "maneuver_names",
    "random_drive",
    "random_drives",
    "recording_names",
]
