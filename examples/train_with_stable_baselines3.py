"""Train an agent with PPO of Stable-Baselines3, and compare it with the washout that it corrects.

Run it with ``python examples/train_with_stable_baselines3.py``; it needs the extra ``train``. Eight
environments at a time drive the same drive, and their rewards are relative to each other's: see ``group`` of
``DrivingSimulatorVecEnv``. A rollout is a whole episode, credited to its end. ``motion-cueing train`` does
more: validation, checkpoints, resuming.
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

    steps: int = 4_000_000
    """Actions in all, over all environments, in whole rollouts: two to three minutes of one core."""
    num_envs: int = 128
    """Environments in the batch."""
    rollout: int = 250
    """Actions of each environment between two updates: an episode of 20 s."""
    group: int = 8
    """Environments in the same drive."""


def main(args: Args) -> None:
    """Train, save, and print J of the agent and of its washout."""
    torch.set_num_threads(1)
    envs = DrivingSimulatorVecEnv(args.num_envs, args.task, group=args.group)
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=args.rollout,
        batch_size=args.rollout * args.num_envs // 8,
        n_epochs=5,
        learning_rate=5e-4,
        gae_lambda=1.0,
        target_kl=0.02,
        seed=args.seed,
        device="cpu",
    )
    model.learn(args.steps)
    comparison.save_and_compare(network_of(model), model.num_timesteps, args)
    print(f"motion-cueing evaluate --policies {args.out} classical")


if __name__ == "__main__":
    main(tyro.cli(Args))
