"""Adaptive washout: the classical washout with gains that a steepest descent adapts as it drives."""

from .policy import Adaptation, AdaptiveParameters, AdaptiveWashout, adaptive_presets, load_adaptive

__all__ = ["Adaptation", "AdaptiveParameters", "AdaptiveWashout", "adaptive_presets", "load_adaptive"]
