"""Hours of random drives with other cars and slower actuators: what a policy must withstand."""

from .options import NOMINAL, SLOWER, Endurance

__all__ = ["NOMINAL", "SLOWER", "Endurance"]
