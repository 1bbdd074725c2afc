"""Compensation of late machines: policies that know the lag and dead time of their machine.

Every real machine answers late. :class:`Compensated` stands before any policy and lets it drive an ideal
machine, whose cues come as much earlier as the real machine is late:

- Set-points of a slow subsystem are led, and those of a quick one delayed, until all are equally late
  (:class:`~.setpoints.SetPointLead`).
- A policy with preview is shown the cues that much earlier. One without is shown a prediction
  (:mod:`.cues`).

On a machine without lag and dead time the policy is what it is without compensation, bit for bit.
"""

from .options import CompensationOptions, Lateness, lateness_of
from .policy import Compensated

__all__ = ["Compensated", "CompensationOptions", "Lateness", "lateness_of"]
