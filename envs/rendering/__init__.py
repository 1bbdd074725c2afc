"""Pictures of a machine in motion; they need the extra ``render``."""

from .backend import RenderingUnavailableError
from .cue_history import CueHistory
from .from_state import append_state, motion_of
from .motion_view import MotionView
from .renderer import FRAMES_PER_SECOND, Renderer

__all__ = [
    "FRAMES_PER_SECOND",
    "CueHistory",
    "MotionView",
    "Renderer",
    "RenderingUnavailableError",
    "append_state",
    "motion_of",
]
