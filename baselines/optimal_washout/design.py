"""From weights to the filters of the optimal washout."""

from __future__ import annotations

from dataclasses import dataclass

from scipy import signal

from ...envs.perception import get_vestibular_model
from .channels import heave, plane, yaw
from .parameters import OptimalParameters
from .regulator import Solution, StateSpace, solve


@dataclass(frozen=True, eq=False)
class Design:
    """The regulators of all channels; see ``channels`` for what goes in and comes out.

    Args:
        surge: Surge and pitch.
        sway: Sway and roll.
        heave: Heave.
        yaw: Yaw.
    """

    surge: Solution
    sway: Solution
    heave: Solution
    yaw: Solution


def design(p: OptimalParameters) -> Design:
    """Solve the four Riccati equations.

    Raises:
        ConfigurationError: one of them has no solution in floating point.
    """
    model = get_vestibular_model(p.vestibular)
    canals, otoliths = model.canals, model.otoliths
    bandwidth = p.rate_bandwidth, p.force_bandwidth
    return Design(
        solve(plane(p.surge, canals, otoliths, 1, 1.0, bandwidth)),
        solve(plane(p.sway, canals, otoliths, 0, -1.0, bandwidth)),
        solve(heave(p.heave, otoliths, p.force_bandwidth)),
        solve(yaw(p.yaw, canals, p.rate_bandwidth)),
    )


def discrete(filter: StateSpace, dt: float) -> StateSpace:
    """The filter at a time step, s, implicit: accelerations follow from the states at the end of the step.

    Weights that ask for loops faster than the time step then give the acceleration that ends the error in one
    step; the bilinear transform would make them ring, and a machine at a limit would make the ringing grow.
    """
    parts = filter.a, filter.b, filter.c, filter.d
    a, b, c, d, _ = signal.cont2discrete(parts, dt, method="backward_diff")
    return StateSpace(a, b, c, d)
