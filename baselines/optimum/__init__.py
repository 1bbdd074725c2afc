"""The offline optimum: the whole drive known, the whole motion planned, within all limits of the machine.

:mod:`.program` states the optimal control problem, :mod:`.transcription` makes it a nonlinear program,
:mod:`.windows` solves it, :mod:`.plan` plays and stores the result, and :mod:`.policy` drives it.
"""

from .plan import Plan, PlanReport
from .policy import Optimum, PlannedDrive
from .program import OptimumOptions

__all__ = ["Optimum", "OptimumOptions", "Plan", "PlanReport", "PlannedDrive"]
