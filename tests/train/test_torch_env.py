"""The PyTorch environment against the Stable-Baselines3 one, here on the CPU."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from motion_cueing.envs.errors import ActionError
from motion_cueing.envs.task import EpisodeOptions
from motion_cueing.envs.task.kernels.reward import TERMS
from motion_cueing.train.torch_env import DrivingSimulatorTorch
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

from ..envs.task.tasks import SHORT, options

N = 4
DEVICES = ["cpu"] + ["cuda:0"] * torch.cuda.is_available()


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", ["defaults", "stack", "residual", "gains", "actuators"])
def test_tensors_are_those_of_the_batch(name, device):
    tensors = DrivingSimulatorTorch(N, device=device, **options(name))
    arrays = DrivingSimulatorVecEnv(N, **options(name))
    arrays.seed(3)
    assert np.allclose(tensors.reset(3).cpu(), arrays.reset(), atol=1e-6)
    rng, ends = np.random.default_rng(0), 0
    for _ in range(100):
        action = rng.uniform(-1.0, 1.0, (N, arrays.action_space.shape[0])).astype(np.float32)
        got, wanted = tensors.step(torch.tensor(action, device=device)), arrays.step(action)
        assert np.allclose(got.observation.cpu(), wanted[0], atol=1e-5)
        assert np.allclose(got.reward.cpu(), wanted[1], rtol=1e-5)
        assert np.array_equal((got.terminated | got.truncated).cpu(), wanted[2])
        assert got.terms.shape == (N, len(TERMS))
        for row, i in enumerate(got.ended.tolist()):
            final = wanted[3][i]["terminal_observation"]
            assert np.allclose(got.final_observation[row].cpu(), final, atol=1e-5)
            ends += 1
    assert ends > 0


@pytest.mark.parametrize("device", DEVICES)
def test_tensors_are_views_on_the_device_and_actions_are_checked(device):
    envs = DrivingSimulatorTorch(2, device=device, episode=SHORT)
    first = envs.reset(0)
    assert str(first.device) == device
    step = envs.step(torch.zeros(2, 9, device=device))
    assert step.observation.data_ptr() == first.data_ptr()
    with pytest.raises(ActionError, match=r"shape \(2, 8\), expected \(2, 9\)"):
        envs.step(torch.zeros(2, 8, device=device))
    before = envs.batch.simulator.state["sample"].copy()
    with pytest.raises(ActionError, match="not finite"):
        envs.step(torch.full((2, 9), float("nan"), device=device))
    assert np.array_equal(envs.batch.simulator.state["sample"], before)


def test_failure_begins_an_episode_anew():
    episode = EpisodeOptions(library=1, drive_duration=20.0, terminate_on_failure=True)
    envs = DrivingSimulatorTorch(1, device="cpu", episode=episode)
    envs.reset(0)
    action = torch.zeros(1, 9)
    action[0, 0] = 1.0
    while not len((step := envs.step(action)).ended):
        pass
    assert bool(step.terminated)
    assert float(step.observation[0, 12]) == 0.0
    assert float(step.final_observation[0, 12]) > 0.5
