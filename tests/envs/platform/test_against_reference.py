"""The kernel and the independent NumPy reference take the same steps."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import Platform
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.envs.simulator.simulator import Simulator

from ...reference import ReferenceSimulator
from ...reference.comparison import adopt, differences, restless_drive
from .platforms_under_test import PRESETS, sluggish, with_dynamics

pytestmark = pytest.mark.slow

AGREE = 1e-9  # SI units, every field
DRIVE = restless_drive(2101)


def pair(platform: Platform, n: int, model: str = "zacharias") -> tuple[Simulator, ReferenceSimulator]:
    vestibular = get_vestibular_model(model)
    kernel = Simulator(platform, DRIVE, drive_of=np.zeros(n, dtype=int), vestibular=vestibular)
    reference = ReferenceSimulator(platform, DRIVE, n, vestibular)
    kernel.reset()
    reference.reset()
    return kernel, reference


def smooth_commands(n: int, steps: int, seed: int) -> np.ndarray:
    """Sines of acceleration (steps, n, 9) whose integrals stay inside every preset's travel."""
    rng = np.random.default_rng(seed)
    frequency = rng.uniform(1.0, 5.0, size=(n, 9))
    amplitude = rng.uniform(0.2, 1.0, size=(n, 9)) * frequency**2
    amplitude *= np.array([0.5, 0.5, 0.015, 0.015, 0.015, 0.02, 0.02, 0.02, 0.1])
    time = 0.01 * np.arange(steps)[:, None, None]
    return amplitude * np.cos(frequency * time)


def colored_noise(n: int, steps: int, scale: float, seed: int) -> np.ndarray:
    """Accelerations (steps, n, 9) that wander, with a memory of a third of a second."""
    rng = np.random.default_rng(seed)
    actions = rng.normal(size=(steps, n, 9)) * 0.3 * scale
    for k in range(1, steps):
        actions[k] += 0.97 * actions[k - 1]
    return actions


def worst(platform: Platform, actions: np.ndarray, free: bool, model: str = "zacharias") -> tuple[str, float]:
    """The field that deviates most in a run, and by how much; free, or each step from the kernel's state."""
    kernel, reference = pair(platform, actions.shape[1], model)
    largest = ("", 0.0)
    for action in actions:
        if not free:
            adopt(reference, kernel.state)
        found = differences(kernel.step(action), reference.step(action))
        largest = max(largest, max(found.items(), key=lambda item: item[1]), key=lambda item: item[1])
    return largest


@pytest.mark.parametrize("name", PRESETS)
def test_gentle_drives_agree_over_2000_steps(name):
    field, value = worst(PRESETS[name], smooth_commands(2, 2000, seed=1), free=True)
    assert value < AGREE, field


@pytest.mark.parametrize("name", PRESETS)
def test_gentle_drives_agree_with_lag_and_dead_time(name):
    field, value = worst(sluggish(PRESETS[name]), smooth_commands(2, 600, seed=2), free=True, model="telban")
    assert value < AGREE, field


# A leg that slides along a limit amplifies round-off at each decision taken, so here each step starts anew.
@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_violent_drives_agree_step_by_step(name, scale):
    actions = colored_noise(8, 300, scale, seed=3)
    field, value = worst(PRESETS[name], actions, free=False)
    assert value < AGREE, field


def test_violent_drives_agree_step_by_step_for_2000_steps():
    field, value = worst(PRESETS["paper"], colored_noise(1, 2000, 3.0, seed=4), free=False)
    assert value < AGREE, field


def test_steps_that_brake_before_a_singular_pose_agree():
    kernel, reference = pair(PRESETS["24-inch"], 24)
    rng = np.random.default_rng(9)
    action = np.sign(rng.normal(size=(24, 9))) * (rng.random((24, 9)) < 0.5)
    met = 0
    for _ in range(250):
        adopt(reference, kernel.state)
        state = kernel.step(action)
        found = differences(state, reference.step(action))
        assert max(found.values()) < AGREE, found
        met += int(np.count_nonzero(state["limits"] & np.uint64(0x888888 << 8)))
    assert met > 100


@pytest.mark.parametrize("name", PRESETS)
def test_violent_drives_agree_with_lag_and_dead_time(name):
    field, value = worst(sluggish(PRESETS[name]), colored_noise(4, 150, 3.0, seed=5), free=True)
    assert value < AGREE, field


@pytest.mark.parametrize(
    "dynamics",
    [
        {"carriage": ActuatorDynamics(natural_frequency=10.0)},
        {"hexapod": ActuatorDynamics(dead_time=0.02)},
        {"turntable": ActuatorDynamics(natural_frequency=20.0, damping=2.0, dead_time=0.01)},
    ],
    ids=["carriage lags", "hexapod late", "turntable lags"],
)
def test_a_subsystem_without_dynamics_stays_exact_beside_one_with(dynamics):
    platform = with_dynamics(PRESETS["paper"], **dynamics)
    field, value = worst(platform, smooth_commands(2, 300, seed=6), free=True)
    assert value < AGREE, field


def test_random_starts_agree():
    kernel, reference = pair(PRESETS["24-inch"], 16)
    start = np.random.default_rng(7).uniform(-1.0, 1.0, size=(16, 9))
    start *= np.array([0.0, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 1.0])
    kernel.reset(start=start)
    reference.reset(start)
    for action in smooth_commands(16, 50, seed=8):
        found = differences(kernel.step(action), reference.step(action))
        assert max(found.values()) < AGREE, found
