"""Nonlinear model predictive control: each plan is the solution of the nonlinear program.

The machine's nine axes are double integrators, so shooting from node to node is exact whatever the
accelerations, and the states are eliminated. What is nonlinear are the cues (rotating frames) and the
legs; sequential quadratic programming linearises them again about each new plan until it no longer
changes, with a search along each change that takes the exact cost and the exact limits.
"""

from __future__ import annotations

from ...envs.platform import Platform
from ..mpc.planner import Planner
from ..mpc.policy import PredictiveController, PreviewController, make_controller
from .parameters import NmpcParameters


def make_nmpc(
    platform: Platform, parameters: NmpcParameters | None = None, name: str = "nmpc"
) -> PredictiveController | PreviewController:
    """Nonlinear predictive control.

    Args:
        platform: The machine.
        parameters: Of the controller; default: without preview.
        name: In tables.
    """
    parameters = parameters or NmpcParameters()
    planner = Planner(platform, parameters.mpc, parameters.iterations, parameters.tolerance)
    return make_controller(platform, parameters.mpc, planner, name, parameters)
