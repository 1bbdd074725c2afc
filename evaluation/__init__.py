"""Evaluation: policies drive maneuvers and are compared: which is better, by how much, and why."""

from .comparison import judge
from .metrics import Criteria, Metrics, measure
from .results import Results
from .rollout import rollout
from .trajectory import LimitTable, Trajectory

__all__ = ["Criteria", "LimitTable", "Metrics", "Results", "Trajectory", "judge", "measure", "rollout"]
