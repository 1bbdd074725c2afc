"""The machine, the car and the driver's perception: everything that is not a policy."""

from .cues import GRAVITY, CueTrace

__all__ = ["GRAVITY", "CueTrace"]
