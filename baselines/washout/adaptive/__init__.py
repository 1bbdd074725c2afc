"""Adaptive washout: the classical washout with gains that a steepest descent adapts as it drives."""

from .family import Adaptation, AdaptiveParameters, AdaptiveWashout

__all__ = ["Adaptation", "AdaptiveParameters", "AdaptiveWashout"]
