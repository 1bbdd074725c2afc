"""The environment's reward: its terms and their weights.

``python -m motion_cueing.envs.task.reward`` prints every term as a table in Markdown.
"""

from __future__ import annotations

from .kernels.reward import DECLARED, TERMS, RewardOptions, RewardWeights, Term, reward_table

__all__ = ["DECLARED", "TERMS", "RewardOptions", "RewardWeights", "Term", "reward_table"]

if __name__ == "__main__":
    print(reward_table())
