"""A policy as a controller in real time: cues come in, set-points go out."""

from .controller import Controller, ControllerOptions
from .machine import make_machine
from .packets import Cues, FloatsFormat, SetPoint
from .watchdog import Patience, State

__all__ = [
    "Controller",
    "ControllerOptions",
    "Cues",
    "FloatsFormat",
    "Patience",
    "SetPoint",
    "State",
    "make_machine",
]
