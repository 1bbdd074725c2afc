"""Metrics of the use of one actuator."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...envs.settings import configuration
from ..reporting.text import percent
from ..trajectory import Floats
from .declaration import PERCENT, Display, documented, metric
from .formulas import Mask


@dataclasses.dataclass(eq=False)
class ActuatorSignals:
    """The (n,) position of one actuator from neutral, its limits, and where any of them is active."""

    position: Floats
    low: float
    high: float
    active: Mask

    @property
    def stroke_share(self) -> float | None:
        """Largest share of the way from neutral to a limit; None without a limit or without travel."""
        low, high, position = self.low, self.high, self.position
        if not (np.isfinite(low) and np.isfinite(high) and low < 0.0 < high):
            return None
        return float(max(position.max() / high, position.min() / low, 0.0))


@documented
@configuration
class ActuatorMetrics:
    """Use of one actuator of :data:`~.trajectory.ACTUATORS`: carriage x and y, legs 1 to 6, turntable."""

    stroke: float = metric(
        lambda a: float(np.abs(a.position).max()),
        "Largest distance from neutral.",
        "m or rad", over_drives=max, better="",
    )  # fmt: skip
    stroke_share: float | None = metric(
        lambda a: a.stroke_share,
        "Largest share of the way from neutral to a limit. Undefined where there is no limit or no travel.",
        header="stroke % of the limit", display=Display("", percent), over_drives=max, better="",
    )  # fmt: skip
    at_limit: float = metric(
        lambda a: float(a.active.mean()),
        "Share of samples at any limit.",
        header="time at a limit", display=PERCENT,
    )  # fmt: skip
