"""Optimal washout: linear filters that minimize the perceived error, by the Riccati equation."""

from .design import HeaveWeights, OptimalParameters, PlaneWeights, YawWeights
from .family import OptimalWashout

__all__ = ["HeaveWeights", "OptimalParameters", "OptimalWashout", "PlaneWeights", "YawWeights"]
