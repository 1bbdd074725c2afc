"""Train an agent with PPO of TorchRL on the batch of PyTorch tensors, and compare it with its washout.

Run it with ``python examples/train_with_torchrl.py --steps 400000``; it needs the extras ``train`` and
``torchrl``. :class:`Cueing` shows how ``DrivingSimulatorTorch`` becomes an environment of TorchRL.
Hyperparameters are those of Stable-Baselines3.
"""

from __future__ import annotations

import torch
import tyro
from comparison import Args, save_and_compare
from tensordict import TensorDict
from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.data import Binary, Bounded, Composite, Unbounded
from torchrl.envs import EnvBase
from torchrl.modules import IndependentNormal, ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from motion_cueing.envs.task import TaskOptions
from motion_cueing.train.agents import Network
from motion_cueing.train.networks import linear_layers, weights_of
from motion_cueing.train.torch_env import DrivingSimulatorTorch


class Cueing(EnvBase):
    """The batch; an ended environment has begun anew before TorchRL asks for it."""

    def __init__(self, num_envs: int, task: TaskOptions, seed: int) -> None:
        super().__init__(device="cpu", batch_size=[num_envs])
        self.simulators = DrivingSimulatorTorch(num_envs, task, device="cpu")
        self.set_seed(seed)
        self.now = self.simulators.reset(seed)
        self.observation_spec = Composite(observation=Unbounded(self.now.shape), shape=[num_envs])
        actions = (num_envs, self.simulators.batch.action_size)
        self.action_spec = Bounded(-1.0, 1.0, shape=actions)
        self.reward_spec = Unbounded((num_envs, 1))
        ends = ("done", "terminated", "truncated")
        flag = Binary(1, (num_envs, 1), dtype=torch.bool)
        self.done_spec = Composite(dict.fromkeys(ends, flag), shape=[num_envs])

    def _reset(self, tensordict: TensorDict | None = None, **_: object) -> TensorDict:
        return TensorDict({"observation": self.now.clone()}, self.batch_size)

    def _step(self, tensordict: TensorDict) -> TensorDict:
        played = self.simulators.step(tensordict["action"])
        # Tensors of the batch are views, which the next step overwrites.
        self.now, last = played.observation, played.observation.clone()
        last[played.ended] = played.final_observation
        step = {
            "observation": last,
            "reward": played.reward.float()[:, None],
            "terminated": played.terminated[:, None].clone(),
            "truncated": played.truncated[:, None].clone(),
            "done": (played.terminated | played.truncated)[:, None],
        }
        return TensorDict(step, self.batch_size)

    def _set_seed(self, seed: int | None) -> None:
        self.seed = seed


def layers(inputs: int, outputs: int) -> nn.Sequential:
    """Two hidden layers."""
    hidden = nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()
    return nn.Sequential(*hidden, nn.Linear(64, outputs))


def main(args: Args) -> None:
    """Train, save, and print J of the agent and of its washout."""
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    env = Cueing(args.num_envs, args.task, args.seed)
    size, action_size = env.observation_spec["observation"].shape[-1], env.action_spec.shape[-1]
    mean = layers(size, action_size)
    # The mean action begins at zero: with the washout alone.
    nn.init.zeros_(mean[-1].weight)
    nn.init.zeros_(mean[-1].bias)
    gaussian = nn.Sequential(mean, AddStateIndependentNormalScale(action_size, scale_mapping="exp"))
    actor = ProbabilisticActor(
        TensorDictModule(gaussian, ["observation"], ["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=IndependentNormal,
        return_log_prob=True,
    )
    critic = ValueOperator(layers(size, 1), in_keys=["observation"])
    advantage = GAE(gamma=0.99, lmbda=0.95, value_network=critic)
    loss = ClipPPOLoss(
        actor, critic, entropy_bonus=False, critic_coeff=0.5, loss_critic_type="l2", normalize_advantage=True
    )
    optimizer = torch.optim.Adam(loss.parameters(), lr=3e-4, eps=1e-5)
    frames = args.rollout * args.num_envs
    updates = max(1, args.steps // frames)
    collector = Collector(
        env,
        actor,
        frames_per_batch=frames,
        total_frames=updates * frames,
        auto_register_policy_transforms=False,
    )
    for k, played in enumerate(collector):
        print(f"update {k + 1} of {updates}: mean reward {played['next', 'reward'].mean().item():.3f}")
        with torch.no_grad():
            advantage(played)
        flat = played.reshape(-1)
        for _ in range(10):
            for rows in torch.randperm(frames).split(64):
                terms = loss(flat[rows])
                optimizer.zero_grad()
                (terms["loss_objective"] + terms["loss_critic"]).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
    save_and_compare(Network(*weights_of(linear_layers(mean))), updates * frames, args)


if __name__ == "__main__":
    main(tyro.cli(Args))
