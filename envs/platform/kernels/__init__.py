"""Warp functions of the motion base: kinematics, limits and actuators."""

from ..machines import ACTUATORS, AXES, ActuatorDynamics

__all__ = ["ACTUATORS", "AXES", "ActuatorDynamics"]
