"""The motion base in motion: state, step, simulator cues, observations and gradients."""

from .simulator import N_AXES, TIME_STEP, Simulator

__all__ = ["N_AXES", "TIME_STEP", "Simulator"]
