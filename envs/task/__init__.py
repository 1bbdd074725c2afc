"""The reinforcement-learning task: options, the single and the vector environment."""

from .environment import DrivingSimulator
from .kernels.action import ActionOptions
from .kernels.observation import ObservationOptions
from .kernels.reward import RewardOptions, RewardWeights
from .options import EpisodeOptions, RandomizationOptions, TaskOptions
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
