"""A plain NumPy simulator of the same machine, written from the equations alone."""

from .machine import MachineModel
from .perception import VestibularReference
from .simulator import ReferenceSimulator, ReferenceState

__all__ = ["MachineModel", "ReferenceSimulator", "ReferenceState", "VestibularReference"]
