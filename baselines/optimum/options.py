"""What can be chosen about the optimum, as a configuration."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from ...envs.errors import ConfigurationError
from ...envs.settings import NonNegative, Positive, configuration

Share = Annotated[float, Field(ge=0.0, lt=0.5)]


@configuration
class OptimumOptions:
    """The problem that is solved, and how.

    Args:
        objective: "J" for the cues at the cab, "perceived" for what the driver senses of them at the head.
        steps: Time steps of the machine (10 ms) from one node to the next; accelerations are straight
            lines between nodes. Raise it and a solve is faster, and sharp cues are cut off.
        window: Greatest length of a drive that is solved as a whole, s. Longer ones are solved in windows.
        keep: Of each window that is kept before the next one begins, s; the rest is looking ahead.
        force_zone: Error of specific force no driver minds, m/s^2; as in J (Slob et al.).
        rate_zone: Error of angular velocity no driver minds, rad/s; as in J.
        effort: Weight of the machine's own motion, so that axes that do the same share it. Raise it and the
            machine stays nearer to neutral, with a higher J.
        margin: Share of the limits of speed and acceleration that is left free between nodes.
        widenings: How often a plan that meets a limit between nodes is solved anew: with three times the
            margin, or, where it came near a singular pose, clear of those.
        barrier: Weight of IPOPT's logarithmic barrier at the end. Lower it and plans come nearer to the
            limits, with a J lower by a percent at most and more iterations.
        tolerance: Of IPOPT: largest violation of the conditions of a minimum.
        iterations: Greatest number of IPOPT's iterations for a window.
    """

    objective: Literal["J", "perceived"] = "J"
    steps: Annotated[int, Field(ge=1, le=50)] = 5
    window: Positive = 60.0
    keep: Positive = 45.0
    force_zone: Positive = 0.6
    rate_zone: Positive = math.radians(3.0)
    effort: NonNegative = 1e-4
    margin: Share = 0.01
    widenings: Annotated[int, Field(ge=0, le=4)] = 2
    barrier: Positive = 1e-3
    tolerance: Positive = 2e-3
    iterations: Annotated[int, Field(ge=1)] = 200

    def __post_init__(self) -> None:
        if self.keep > self.window:
            raise ConfigurationError(
                f"keep = {self.keep:g} s must not be longer than window = {self.window:g} s"
            )
