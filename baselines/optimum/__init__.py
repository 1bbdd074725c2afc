"""The offline optimum: the whole drive known, the whole motion planned, within all limits of the machine."""

from .plan import Account, Plan
from .policy import Optimum, PlannedDrive
from .program import OptimumOptions

__all__ = ["Account", "Optimum", "OptimumOptions", "Plan", "PlannedDrive"]
