"""Train an agent with PPO of skrl on Gymnasium's vector environment, and compare it with its washout.

Run it with ``python examples/train_with_skrl.py --steps 400000``; it needs the extras ``train`` and ``skrl``.
skrl's wrapper takes the native batch as it is. Hyperparameters are those of Stable-Baselines3.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import torch
import tyro
from comparison import Args, save_and_compare
from skrl.agents.torch.ppo import PPO
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import nn

import motion_cueing.envs  # noqa: F401  (registers the environments)
from motion_cueing.train.agents import Network
from motion_cueing.train.networks import linear_layers, weights_of


def layers(inputs: int, outputs: int) -> nn.Sequential:
    """Two hidden layers."""
    hidden = nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()
    return nn.Sequential(*hidden, nn.Linear(64, outputs))


class Actor(GaussianMixin, Model):
    """Mean actions, which begin at zero with the washout alone, and their standard deviation."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)
        self.net = layers(self.num_observations, self.num_actions)
        nn.init.zeros_(self.net[-1].weight)
        nn.init.zeros_(self.net[-1].bias)
        self.log_std = nn.Parameter(torch.zeros(self.num_actions))

    def compute(self, inputs: dict[str, Any], role: str = "") -> tuple[torch.Tensor, dict[str, Any]]:
        return self.net(inputs["observations"]), {"log_std": self.log_std}


class Critic(DeterministicMixin, Model):
    """Expected returns."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = layers(self.num_observations, 1)

    def compute(self, inputs: dict[str, Any], role: str = "") -> tuple[torch.Tensor, dict[str, Any]]:
        return self.net(inputs["observations"]), {}


def main(args: Args) -> None:
    """Train, save, and print J of the agent and of its washout."""
    torch.set_num_threads(1)
    set_seed(args.seed)
    # Gymnasium's own way of beginning anew, in the step after the last, keeps the last observation: skrl
    # needs its value where an episode is cut off.
    batch = gymnasium.make_vec(
        "motion_cueing/CueingPreview-v0", num_envs=args.num_envs, episode={"library": args.library}
    )
    env: Any = wrap_env(batch, wrapper="gymnasium", verbose=False)
    spaces = {
        "observation_space": env.observation_space,
        "action_space": env.action_space,
        "device": env.device,
    }
    actor = Actor(**spaces)
    agent = PPO(
        models={"policy": actor, "value": Critic(**spaces)},
        memory=RandomMemory(memory_size=args.rollout, num_envs=args.num_envs, device=env.device),
        cfg={
            "rollouts": args.rollout,
            "learning_epochs": 10,
            "mini_batches": max(1, args.rollout * args.num_envs // 64),
            "learning_rate": 3e-4,
            "value_clip": 0.0,
            "value_loss_scale": 0.5,
            "time_limit_bootstrap": True,
            "experiment": {"write_interval": 0, "checkpoint_interval": 0},
        },
        **spaces,
    )
    rollouts = max(1, args.steps // (args.rollout * args.num_envs))
    timesteps = rollouts * args.rollout
    trainer = {"timesteps": timesteps, "headless": True, "close_environment_at_exit": False}
    SequentialTrainer(env=env, agents=agent, cfg=trainer).train()
    network = Network(*weights_of(linear_layers(actor.net.cpu())))
    save_and_compare(network, timesteps * args.num_envs, args)


if __name__ == "__main__":
    main(tyro.cli(Args))
