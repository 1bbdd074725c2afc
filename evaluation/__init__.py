"""Policies driven and scored: which is better, by how much, and why."""

from .comparison import judge
from .metrics import Criteria, Metrics, measure
from .rollout import rollout
from .trajectory import LimitTable, Trajectory

__all__ = ["Criteria", "LimitTable", "Metrics", "Trajectory", "judge", "measure", "rollout"]
