"""The motion base: carriage, hexapod, turntable, their limits and kinematics."""

from .ablations import ablations
from .actuators import ActuatorDynamics
from .kinematics import legs_of_pose, pose_of_legs
from .machines import Cab, Carriage, Hexapod, Platform, Turntable
from .parameters import actuator_limits
from .presets import ablation_names, get_platform, load_platform, platform_names
from .state import ACTUATORS, AXES

__all__ = [
    "ACTUATORS",
    "AXES",
    "ActuatorDynamics",
    "Cab",
    "Carriage",
    "Hexapod",
    "Platform",
    "Turntable",
    "ablation_names",
    "ablations",
    "actuator_limits",
    "get_platform",
    "legs_of_pose",
    "load_platform",
    "platform_names",
    "pose_of_legs",
]
