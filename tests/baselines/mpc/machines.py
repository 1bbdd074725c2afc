"""Small controllers, so that tests are quick."""

from __future__ import annotations

from dataclasses import replace

from motion_cueing.baselines.mpc import Forecast, MpcParameters
from motion_cueing.envs.platform import get_platform

PAPER = get_platform("paper")
NODES = (0.01, 0.05, 0.15, 0.3, 0.5, 0.8, 1.2, 1.8)


def quick(preview: float = 0.0, every: int = 2, **fields: object) -> MpcParameters:
    """Parameters with few nodes, not compiled."""
    parameters = MpcParameters(nodes=NODES, every=every, forecast=Forecast(preview=preview), compile=False)
    return replace(parameters, **fields)
