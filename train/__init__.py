"""Training of motion cueing agents.

The shipped agents by name, and one of your own by file::

    from motion_cueing.train.agents import Agent, get_agent

    agent = get_agent("learned")
    agent = Agent.load("runs/ppo-1/best.safetensors")
    action, _ = agent.predict(observation)

A model of Stable-Baselines3 becomes an agent by ``motion_cueing.train.algorithms.sb3.policy.agent_of``, its
file by ``motion-cueing convert``. An algorithm of another package takes part by :func:`register`.
"""

from .registry import Learner, register

__all__ = ["Learner", "register"]
