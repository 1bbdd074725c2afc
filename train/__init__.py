"""Training of motion cueing agents."""

from .registry import Learner, register

__all__ = ["Learner", "register"]
