"""The offline optimum: the whole drive known, the whole motion planned, within all limits of the machine."""

from .options import OptimumOptions
from .plan import Account, Plan
from .policy import Optimum, PlannedDrive

__all__ = ["Account", "Optimum", "OptimumOptions", "Plan", "PlannedDrive"]
