"""The reinforcement-learning task: options, the single and the vector environment."""

from .environment import DrivingSimulator
from .kernels.reward import RewardOptions, RewardWeights
from .options import (
    ActionOptions,
    EpisodeOptions,
    ObservationOptions,
    RandomizationOptions,
    TaskOptions,
)
from .vector import DrivingSimulatorVector

__all__ = [
    "ActionOptions",
    "DrivingSimulator",
    "DrivingSimulatorVector",
    "EpisodeOptions",
    "ObservationOptions",
    "RandomizationOptions",
    "RewardOptions",
    "RewardWeights",
    "TaskOptions",
]
