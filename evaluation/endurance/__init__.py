"""Hours of random drives with other cars and slower actuators: what a policy must withstand."""

from .results import NOMINAL, SLOWER, Endurance

__all__ = ["NOMINAL", "SLOWER", "Endurance"]
