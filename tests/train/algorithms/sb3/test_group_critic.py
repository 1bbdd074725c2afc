"""A critic that sees deviations from the group: what it is shown, and what the actor is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from sb3_contrib import TRPO
from stable_baselines3 import PPO

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.task.options import load_task
from motion_cueing.train.algorithms.sb3.group_critic import Deviations, GroupCriticPolicy
from motion_cueing.train.algorithms.sb3.policy import agent_of
from motion_cueing.train.algorithms.sb3.saved import load_model
from motion_cueing.train.algorithms.sb3.sb3 import SB3Learner
from motion_cueing.train.config import load_config
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

TASK = load_task(
    "cueing-preview",
    episode={"library": 2, "drive_duration": 12.0, "duration": 2.0},
    observation={"against_base": False},
)
GROUP, N, SIZE = 3, 6, 155


def machines() -> DrivingSimulatorVecEnv:
    env = DrivingSimulatorVecEnv(N, TASK, group=GROUP)
    env.seed(4)
    return env


def expected(observation: np.ndarray) -> np.ndarray:
    """The observation, then four times what it is above the mean of the other two, clipped to 10."""
    rows = []
    for i, row in enumerate(observation):
        first = i - i % GROUP
        others = [observation[k] for k in range(first, first + GROUP) if k != i]
        rows.append(np.concatenate([row, np.clip(4.0 * (row - np.mean(others, axis=0)), -10.0, 10.0)]))
    return np.array(rows)


def test_deviations_are_from_the_mean_of_the_others():
    env, plain = Deviations(machines()), machines()
    rng = np.random.default_rng(0)
    np.testing.assert_allclose(env.reset(), expected(plain.reset()), atol=1e-5)
    for _ in range(30):
        action = rng.normal(0.0, 0.5, (N, 4)).astype(np.float32)
        seen, reward, ended, infos = env.step(action)
        observation, same_reward, same_ends, plain_infos = plain.step(action)
        np.testing.assert_allclose(seen, expected(observation), atol=1e-4)
        np.testing.assert_array_equal(reward, same_reward)
        np.testing.assert_array_equal(ended, same_ends)
        if ended.any():
            # Those of a group end together: the last observations deviate from each other.
            last = expected(np.stack([info["terminal_observation"] for info in plain_infos]))
            np.testing.assert_allclose([info["terminal_observation"] for info in infos], last, atol=1e-4)
    assert env.observation_space.contains(seen[0])
    assert np.abs(seen[:, SIZE:]).max() > 0.1


def test_without_groups_there_is_nothing_to_deviate_from():
    with pytest.raises(ConfigurationError, match="group must be above 1, found 1"):
        Deviations(DrivingSimulatorVecEnv(2, TASK))


@pytest.mark.parametrize("algorithm", [PPO, TRPO])
def test_the_actor_does_not_see_them_and_the_critic_does(algorithm, tmp_path):
    env = Deviations(machines())
    model = algorithm(
        GroupCriticPolicy, env, n_steps=8, batch_size=24, seed=0, policy_kwargs={"net_arch": [9]}
    )
    model.learn(96)
    rng = np.random.default_rng(1)
    seen = torch.as_tensor(rng.normal(size=(5, 2 * SIZE)), dtype=torch.float32)
    other = torch.cat([seen[:, :SIZE], torch.randn(5, SIZE)], dim=1)
    with torch.no_grad():
        first, second = (model.policy.get_distribution(one).mode() for one in (seen, other))
        values = [model.policy.predict_values(one) for one in (seen, other)]
    torch.testing.assert_close(first, second)
    assert not torch.allclose(*values)
    model.save(tmp_path / "model.zip")
    agent = agent_of(load_model(tmp_path / "model.zip"), TASK, "mine")
    np.testing.assert_allclose(
        agent.predict(seen[:, :SIZE].numpy())[0], first.clamp(-1.0, 1.0).numpy(), atol=1e-5
    )


def test_the_critic_has_a_learning_rate_of_its_own():
    kwargs = {"net_arch": [9], "critic_learning_rate": 0.0}
    model = PPO(
        GroupCriticPolicy, Deviations(machines()), n_steps=8, batch_size=24, seed=0, policy_kwargs=kwargs
    )
    before = {name: value.clone() for name, value in model.policy.state_dict().items()}
    model.learn(96)
    same = {name for name, value in model.policy.state_dict().items() if torch.equal(value, before[name])}
    assert same == {name for name in before if "value" in name}
    assert model.policy.optimizer.param_groups[0]["lr"] == 3e-4


def test_a_training_makes_an_agent_of_the_actor():
    own = {"policy": "GroupCriticPolicy", "n_steps": 8, "batch_size": 48, "annealed_std": [0.5, 0.1]}
    config = load_config("ppo", task=TASK, n_envs=N, group=GROUP, steps=96, hyperparameters=own)
    learner = SB3Learner(config)
    learner.learn(lambda: None)
    network = learner.network()
    seen = learner.simulators.reset()
    assert (network.size, network.action_size) == (SIZE, 4)
    with learner.exploring(N) as act:
        noisy = act(seen)
    # About the deterministic action, with the deviation of half of the training: from 0.5 to 0.1.
    assert np.std(noisy - network(seen)) == pytest.approx(np.sqrt(0.5 * 0.1), rel=0.4)


def test_a_configuration_that_cannot_be_is_refused():
    config = load_config(
        "ppo", None, task=TASK, n_envs=N, group=GROUP, hyperparameters={"policy": "GroupCriticPolicy"}
    )
    with pytest.raises(ConfigurationError, match="needs groups: set group to 8"):
        SB3Learner(replace(config, group=1))
    with pytest.raises(ConfigurationError, match=r"normalize\.observation must be off"):
        SB3Learner(replace(config, normalize=replace(config.normalize, observation=True)))
