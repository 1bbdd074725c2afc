"""The motion base: carriage, hexapod, turntable, their limits and kinematics."""

from .kinematics import legs_of_pose, pose_of_legs
from .machines import Braking, Cab, Carriage, Hexapod, Platform, Turntable, actuator_limits
from .presets import (
    ablation_names,
    ablations,
    describe_platform,
    get_platform,
    load_platform,
    platform_names,
    register,
)

__all__ = [
    "Braking",
    "Cab",
    "Carriage",
    "Hexapod",
    "Platform",
    "Turntable",
    "ablation_names",
    "ablations",
    "actuator_limits",
    "describe_platform",
    "get_platform",
    "legs_of_pose",
    "load_platform",
    "platform_names",
    "pose_of_legs",
    "register",
]
