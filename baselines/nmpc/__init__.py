"""Nonlinear model predictive control of the nine axes."""

from .parameters import NmpcParameters
from .policy import make_nmpc

__all__ = ["NmpcParameters", "make_nmpc"]
