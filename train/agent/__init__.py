"""Trained policies: one file each, which NumPy alone can read and run."""

from .agent import Agent
from .network import Network
from .record import Record
from .shipped import agent_names, get_agent

__all__ = ["Agent", "Network", "Record", "agent_names", "get_agent"]
