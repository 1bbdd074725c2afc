"""Train an agent with Stable-Baselines3, and compare it with the washout that it corrects.

Run it with ``python examples/train_with_stable_baselines3.py``, with a number of actions and a maneuver
if you like; it needs the extra ``train``. ``motion-cueing train`` does more: validation, checkpoints,
resuming. The training uses random drives; maneuvers are for the comparison.
"""

from __future__ import annotations

import sys

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.task import ActionOptions, EpisodeOptions, ObservationOptions, TaskOptions
from motion_cueing.evaluation import measure, rollout
from motion_cueing.train.agents import Agent
from motion_cueing.train.algorithms.sb3.policy import agent_of
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

TASK = TaskOptions(
    observation=ObservationOptions(preview=10, preview_spacing=0.1, frame="cab"),
    action=ActionOptions(mode="residual", authority=0.1, repeat=5, frame="cab"),
    episode=EpisodeOptions(duration=15.0, random_start=True),
)
FILE = "stable-baselines3.safetensors"


def train(steps: int) -> Agent:
    """An agent after at least this many actions, in whole rollouts."""
    torch.set_num_threads(1)
    envs = VecNormalize(DrivingSimulatorVecEnv(64, TASK, base=ClassicalWashout()), gamma=0.97)
    model = PPO("MlpPolicy", envs, n_steps=128, batch_size=2048, gamma=0.97, seed=0, device="cpu",
                learning_rate=1e-3, policy_kwargs={"log_std_init": -1.5})  # fmt: skip
    model.learn(steps)
    return agent_of(model, TASK, "stable-baselines3", base="classical")


def main(steps: str = "200000", maneuver: str = "lane-change") -> None:
    """Train, save, and print J of the agent and of the washout: 0 is perfect."""
    train(int(steps)).save(FILE)
    cues = get_maneuver(maneuver).drive()
    for policy in (ClassicalWashout(), Agent.load(FILE)):
        print(f"{policy.name:<20} J = {measure(rollout(policy, cues)).cue_error:6.3f}")
    print(f"motion-cueing evaluate --policies {FILE} classical")


if __name__ == "__main__":
    main(*sys.argv[1:3])
