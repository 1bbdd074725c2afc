"""What the examples of training share: arguments, and a comparison on drives that no training has seen.

It is no example itself. Whatever library has trained the policy, its network becomes an agent: a file that
needs none of them, for ``motion-cueing evaluate`` and every other command.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from motion_cueing.envs.task.options import TaskOptions, load_task
from motion_cueing.train.agents import Agent, Network, Record
from motion_cueing.train.config import TrainingConfig, ValidationOptions
from motion_cueing.train.validation import Validation

TASK = load_task("cueing-preview")
"""The task of ``motion_cueing/CueingPreview-v0``: commands on a linear washout, 2 s of the drive ahead."""


@dataclass
class Args:
    """PPO on random drives, with commands on a linear washout."""

    steps: int = 400_000
    """Actions in all, over all environments, in whole rollouts."""
    num_envs: int = 16
    """Environments in the batch."""
    rollout: int = 2048
    """Actions of each environment between two updates."""
    library: int = TASK.episode.library
    """Random drives, of one minute each, to train on."""
    seed: int = 0
    """Of weights, noise and drives."""
    out: Path = Path("agent.safetensors")
    """File of the agent."""
    drives: int = 16
    """Unseen random drives, of one minute each, in the comparison."""

    @property
    def task(self) -> TaskOptions:
        """The task, with the drives asked for."""
        return replace(TASK, episode=replace(TASK.episode, library=self.library))


def save_and_compare(network: Network, steps: int, args: Args) -> None:
    """Save the agent, and print J on unseen drives of it and of the washout that it corrects: 0 is perfect.

    Args:
        network: The trained policy's, from observations to mean actions.
        steps: Actions taken in training, over all environments.
        args: Of the example.
    """
    task = args.task
    agent = Agent(args.out.stem, task, network, Record(algo="ppo", seed=args.seed, steps=steps))
    agent.save(args.out)
    unseen = Validation(TrainingConfig("ppo", task=task, validation=ValidationOptions(drives=args.drives)))
    scores = {
        str(task.action.base): unseen.score_base(),
        agent.name: unseen.score(network),
    }
    for name, score in scores.items():
        print(f"{name:<20} J = {score.cue_error:6.3f}")
