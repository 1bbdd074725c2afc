"""Runs every policy on every maneuver and says which is better, by how much, and why."""

from .criteria import Criteria
from .metrics import Metrics, measure
from .rollout import rollout
from .trajectory import LimitTable, Trajectory
from .verdict import judge

__all__ = ["Criteria", "LimitTable", "Metrics", "Trajectory", "judge", "measure", "rollout"]
