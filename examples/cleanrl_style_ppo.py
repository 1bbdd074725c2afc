"""PPO in one file, in the style of CleanRL: a plain loop over the native batch, with PyTorch alone.

Run it with ``python examples/cleanrl_style_ppo.py --steps 400000``; ``--help`` shows every argument. The
loop is that of CleanRL's ``ppo_continuous_action.py`` (Huang et al. 2022, JMLR 23:274), with one
difference: the value of the last state counts where an episode is truncated. A batch that begins anew in
the same step has that state in ``final_obs``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import comparison
import gymnasium
import numpy as np
import torch
import tyro
from torch import nn

import motion_cueing.envs  # noqa: F401  (registers the environments)
from motion_cueing.train.agents import Network
from motion_cueing.train.networks import linear_layers, weights_of


@dataclass
class Args(comparison.Args):
    """PPO on random drives, with commands on a linear washout."""

    epochs: int = 10
    """Passes over a rollout."""
    minibatch: int = 64
    """Actions in a gradient."""
    learning_rate: float = 3e-4
    """At the beginning; it falls to zero."""
    gamma: float = 0.99
    """Discount."""
    gae_lambda: float = 0.95
    """Of the generalized advantage estimation."""
    clip: float = 0.2
    """Largest change of a probability ratio that pays."""


class ActorCritic(nn.Module):
    """Two small networks and a standard deviation; the actor begins as the washout alone."""

    def __init__(self, size: int, action_size: int) -> None:
        super().__init__()
        self.actor = nn.Sequential(
            nn.Linear(size, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, action_size)
        )
        self.critic = nn.Sequential(
            nn.Linear(size, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1)
        )
        self.log_std = nn.Parameter(torch.zeros(action_size))
        nn.init.zeros_(self.actor[-1].weight)
        nn.init.zeros_(self.actor[-1].bias)

    def value(self, observation: torch.Tensor) -> torch.Tensor:
        """(n,) expected returns."""
        return self.critic(observation).squeeze(-1)

    def distribution(self, observation: torch.Tensor) -> torch.distributions.Normal:
        """Of the actions (n, k), each entry by itself."""
        return torch.distributions.Normal(self.actor(observation), self.log_std.exp())


@dataclass
class Rollout:
    """Experience: (steps, environments, ...) each."""

    observation: torch.Tensor
    action: torch.Tensor
    log_prob: torch.Tensor
    reward: torch.Tensor
    future: torch.Tensor  # discounted value after the step, where an episode was cut off
    ended: torch.Tensor
    value: torch.Tensor


def play(
    envs: Any, agent: ActorCritic, observation: torch.Tensor, args: Args
) -> tuple[Rollout, torch.Tensor]:
    """The next rollout, and the observation after it."""
    rows: list[tuple[torch.Tensor, ...]] = []
    for _ in range(args.rollout):
        with torch.no_grad():
            distribution, value = agent.distribution(observation), agent.value(observation)
            action = distribution.sample()
            log_prob = distribution.log_prob(action).sum(-1)
        # The environment clips actions to its box, and so the policy needs no squashing.
        following, reward, terminated, truncated, info = envs.step(action.numpy())
        future = torch.zeros(len(reward))
        cut = truncated & ~terminated
        if cut.any():
            last = torch.as_tensor(np.stack(info["final_obs"][cut]))
            with torch.no_grad():
                future[torch.as_tensor(cut)] = args.gamma * agent.value(last)
        gained = torch.as_tensor(reward, dtype=torch.float32)
        ended = torch.as_tensor(terminated | truncated)
        rows.append((observation, action, log_prob, gained, future, ended, value))
        observation = torch.as_tensor(following)
    return Rollout(*(torch.stack(column) for column in zip(*rows, strict=True))), observation


def advantages(played: Rollout, value_after: torch.Tensor, args: Args) -> torch.Tensor:
    """(steps, environments) by generalized advantage estimation, within each episode."""
    found, carried, following = torch.zeros_like(played.reward), torch.zeros_like(value_after), value_after
    for k in reversed(range(len(found))):
        goes_on = 1.0 - played.ended[k].float()
        ahead = played.future[k] + args.gamma * goes_on * following
        error = played.reward[k] + ahead - played.value[k]
        carried = error + args.gamma * args.gae_lambda * goes_on * carried
        found[k], following = carried, played.value[k]
    return found


def loss(
    agent: ActorCritic, batch: Rollout, advantage: torch.Tensor, goal: torch.Tensor, args: Args
) -> torch.Tensor:
    """PPO's clipped objective, and the critic's error."""
    ratio = (agent.distribution(batch.observation).log_prob(batch.action).sum(-1) - batch.log_prob).exp()
    advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    clipped = ratio.clamp(1.0 - args.clip, 1.0 + args.clip)
    policy = -torch.min(ratio * advantage, clipped * advantage).mean()
    return policy + 0.5 * (agent.value(batch.observation) - goal).square().mean()


def update(
    agent: ActorCritic, optimizer: torch.optim.Optimizer, played: Rollout, advantage: torch.Tensor, args: Args
) -> None:
    """Some epochs of minibatches over a rollout."""
    flat = Rollout(*(column.flatten(0, 1) for column in vars(played).values()))
    goal, advantage = (advantage + played.value).flatten(), advantage.flatten()
    for _ in range(args.epochs):
        for rows in torch.randperm(len(goal)).split(args.minibatch):
            batch = Rollout(*(column[rows] for column in vars(flat).values()))
            optimizer.zero_grad()
            loss(agent, batch, advantage[rows], goal[rows], args).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()


def train(args: Args) -> tuple[ActorCritic, int]:
    """Play and update, until the actions are used up; returns what has learned, and the actions taken."""
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    envs = gymnasium.make_vec(
        "motion_cueing/CueingPreview-v0",
        num_envs=args.num_envs,
        autoreset_mode="SameStep",
        episode={"library": args.library},
    )
    (size,), (action_size,) = envs.single_observation_space.shape, envs.single_action_space.shape
    agent = ActorCritic(size, action_size)
    optimizer = torch.optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)
    observation = torch.as_tensor(envs.reset(seed=args.seed)[0])
    updates = max(1, args.steps // (args.num_envs * args.rollout))
    for k in range(updates):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1.0 - k / updates)
        played, observation = play(envs, agent, observation, args)
        with torch.no_grad():
            after = agent.value(observation)
        update(agent, optimizer, played, advantages(played, after, args), args)
        print(f"update {k + 1} of {updates}: mean reward {played.reward.mean():.3f}")
    return agent, updates * args.num_envs * args.rollout


def main(args: Args) -> None:
    """Train, save, and print J of the agent and of its washout."""
    agent, steps = train(args)
    comparison.save_and_compare(Network(*weights_of(linear_layers(agent.actor))), steps, args)


if __name__ == "__main__":
    main(tyro.cli(Args))
