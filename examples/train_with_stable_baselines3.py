"""Train an agent with PPO of Stable-Baselines3, and compare it with the washout that it corrects.

Run it with ``python examples/train_with_stable_baselines3.py --steps 400000``; it needs the extra ``train``.
Hyperparameters are the library's own. Eight environments at a time drive the same drive, and their rewards
are relative to each other's: see ``group`` of ``DrivingSimulatorVecEnv``. ``motion-cueing train`` does more:
validation, checkpoints, resuming.
"""

from __future__ import annotations

from dataclasses import dataclass

import comparison
import torch
import tyro
from stable_baselines3 import PPO

from motion_cueing.train.algorithms.sb3.policy import network_of
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv


@dataclass
class Args(comparison.Args):
    """PPO of Stable-Baselines3 on random drives, with commands on a linear washout."""

    group: int = 8
    """Environments in the same drive."""


def main(args: Args) -> None:
    """Train, save, and print J of the agent and of its washout."""
    torch.set_num_threads(1)
    envs = DrivingSimulatorVecEnv(args.num_envs, comparison.TASK, group=args.group)
    model = PPO("MlpPolicy", envs, n_steps=args.rollout, seed=args.seed, device="cpu")
    model.learn(args.steps)
    comparison.save_and_compare(network_of(model), model.num_timesteps, args)
    print(f"motion-cueing evaluate --policies {args.out} classical")


if __name__ == "__main__":
    main(tyro.cli(Args))
