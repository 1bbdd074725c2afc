"""Real-time loop: a policy as the controller of a motion base; cues arrive, set-points leave."""

from .bridge import Bridge, BridgeOptions
from .controller import Controller, ControllerOptions
from .guard import GuardOptions
from .machine import make_machine
from .packets import Cues, FloatsFormat, SetPoint
from .watchdog import State, WatchdogOptions

__all__ = [
    "Bridge",
    "BridgeOptions",
    "Controller",
    "ControllerOptions",
    "Cues",
    "FloatsFormat",
    "GuardOptions",
    "SetPoint",
    "State",
    "WatchdogOptions",
    "make_machine",
]
