"""Real-time loop: a policy as the controller of a motion base; cues arrive, set-points leave."""

from .bridge import Bridge, BridgeOptions
from .controller import Controller, ControllerOptions
from .guard import GuardOptions
from .machine import make_machine
from .packets import Controls, Cues, FloatsFormat, Road, SetPoint
from .watchdog import State, WatchdogOptions

__all__ = [
    "Bridge",
    "BridgeOptions",
    "Controller",
    "ControllerOptions",
    "Controls",
    "Cues",
    "FloatsFormat",
    "GuardOptions",
    "Road",
    "SetPoint",
    "State",
    "WatchdogOptions",
    "make_machine",
]
