"""Trained policies: one file each, which NumPy alone can read and run."""

from .agent import Agent, agent_names, get_agent
from .files import Record
from .network import Network

__all__ = ["Agent", "Network", "Record", "agent_names", "get_agent"]
