"""What the nonlinear controller is told beside what the linear one is."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ...envs.settings import Positive, configuration
from ..mpc.parameters import MpcParameters


@configuration
class NmpcParameters:
    """A nonlinear predictive controller.

    Args:
        algorithm: What a file of such parameters says it is.
        mpc: Horizon, forecast, weights and margins, as of the linear one.
        iterations: Most programs a plan. 1 is the real-time iteration, which is the linear controller.
        tolerance: A step that changes no acceleration by more ends the search, m/s^2 and rad/s^2.
    """

    algorithm: Literal["nmpc"] = "nmpc"
    mpc: MpcParameters = MpcParameters()
    iterations: Annotated[int, Field(ge=1, le=100)] = 10
    tolerance: Positive = 0.05
