"""Adaptive washout: the paper's algorithm with gains that a steepest descent adapts as it drives."""

from .parameters import Adaptation, AdaptiveParameters, adaptive_presets, load_adaptive
from .policy import AdaptiveWashout

__all__ = ["Adaptation", "AdaptiveParameters", "AdaptiveWashout", "adaptive_presets", "load_adaptive"]
