"""Model predictive control of the nine axes."""

from .parameters import AxisWeights, Forecast, Margins, MpcParameters, TiltRate, Weights
from .policy import make_mpc

__all__ = ["AxisWeights", "Forecast", "Margins", "MpcParameters", "TiltRate", "Weights", "make_mpc"]
