"""Pictures of a machine in motion; they need the extra ``render``."""

from .drawing import RenderingUnavailableError
from .instruments import CueHistory
from .machine_model import MotionView
from .renderer import FRAMES_PER_SECOND, Renderer, append_state, motion_of

__all__ = [
    "FRAMES_PER_SECOND",
    "CueHistory",
    "MotionView",
    "Renderer",
    "RenderingUnavailableError",
    "append_state",
    "motion_of",
]
