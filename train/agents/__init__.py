"""Trained policies: one file each, which NumPy alone reads and runs.

The shipped agents are made by name, any other from its file::

    from motion_cueing.train.agents import Agent, agent_names, get_agent

    agent = get_agent("learned")
    agent = Agent.load("runs/ppo-1/best.safetensors")
    action, _ = agent.predict(observation)

A model of Stable-Baselines3 becomes one by ``motion_cueing.train.algorithms.sb3.policy.network_of``::

    Agent("mine", task, network_of(model, normalize), Record(algo="ppo", seed=0)).save("mine.safetensors")
"""

from .agent import Agent, agent_names, get_agent
from .files import Record
from .network import Network

__all__ = ["Agent", "Network", "Record", "agent_names", "get_agent"]
