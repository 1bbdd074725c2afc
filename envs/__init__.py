"""The machine, the car, the driver's perception, and the environment: everything that is not a policy."""

from .cues import GRAVITY, CueTrace
from .registration import ENVIRONMENT_ID, register

register()

__all__ = ["ENVIRONMENT_ID", "GRAVITY", "CueTrace"]
