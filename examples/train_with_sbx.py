"""Train an agent with PPO of SBX, which is Stable-Baselines3 in JAX, and compare it with its washout.

Run it with ``python examples/train_with_sbx.py --steps 400000``; it needs the extras ``train`` and ``sbx``.
The environment is the one of Stable-Baselines3. The weights leave JAX as arrays of NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass

import comparison
import numpy as np
import tyro
from sbx import PPO

from motion_cueing.train.agents import Network
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv


@dataclass
class Args(comparison.Args):
    """PPO of SBX on random drives, with commands on a linear washout."""

    group: int = 8
    """Environments in the same drive, whose rewards are relative to each other's."""


def network_of(model: PPO) -> Network:
    """The actor's mean action: two hidden layers with a tanh, and a linear one."""
    parameters = model.policy.actor_state.params["params"]
    layers = [parameters[f"Dense_{k}"] for k in range(3)]
    return Network(
        weights=tuple(np.asarray(layer["kernel"]).T for layer in layers),
        biases=tuple(np.asarray(layer["bias"]) for layer in layers),
    )


def main(args: Args) -> None:
    """Train, save, and print J of the agent and of its washout."""
    envs = DrivingSimulatorVecEnv(args.num_envs, args.task, group=args.group)
    # With ortho_init the mean action begins near zero, as in Stable-Baselines3: with the washout alone.
    model = PPO("MlpPolicy", envs, n_steps=args.rollout, seed=args.seed, policy_kwargs={"ortho_init": True})
    model.learn(args.steps)
    comparison.save_and_compare(network_of(model), model.num_timesteps, args)


if __name__ == "__main__":
    main(tyro.cli(Args))
