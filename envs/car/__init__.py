"""Cars, maneuvers, random drives and recorded drives: where cues come from."""

from .fleet import car_names, get_car
from .maneuver import Maneuver
from .maneuvers import get_maneuver, maneuver_names
from .random_drives import RandomDrives, drive_seeds, random_drive, random_drives
from .recordings import get_recording, recording_names
from .vehicles import Car

__all__ = [
    "Car",
    "Maneuver",
    "RandomDrives",
    "car_names",
    "drive_seeds",
    "get_car",
    "get_maneuver",
    "get_recording",
    "maneuver_names",
    "random_drive",
    "random_drives",
    "recording_names",
]
