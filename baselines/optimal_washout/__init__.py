"""Optimal washout: linear filters that minimise what the driver senses wrongly, by the Riccati equation."""

from .parameters import (
    HeaveWeights,
    OptimalParameters,
    PlaneWeights,
    YawWeights,
    load_optimal,
    optimal_presets,
)
from .policy import OptimalWashout

__all__ = [
    "HeaveWeights",
    "OptimalParameters",
    "OptimalWashout",
    "PlaneWeights",
    "YawWeights",
    "load_optimal",
    "optimal_presets",
]
