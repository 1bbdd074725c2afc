"""Sensors of the cues: each error as large as its option says, the same in any batch, none by default."""

import numpy as np
import pytest

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.simulator.kernels.observation import FIRST, SCALES
from motion_cueing.envs.task import RandomizationOptions
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.options import load_task
from motion_cueing.envs.task.sensors import CarSensors, sensed_drives

N = 20_000
FLAT = CueTrace("flat", 0.01 * np.arange(N), np.zeros((N, 3)), np.zeros((N, 3)))
RISING = CueTrace("rising", 0.01 * np.arange(N), np.outer(np.arange(N), np.ones(3)), np.zeros((N, 3)))


def seen(drive, seeds=range(12), **errors):
    return [sensed_drives([drive], CarSensors(**errors), seed)[0] for seed in seeds]


def test_perfect_sensors_give_the_drive_itself():
    assert sensed_drives([FLAT], CarSensors(), 0)[0] is FLAT
    assert RandomizationOptions().car_sensors.perfect


def test_noise_and_bias_are_within_their_bounds_and_reach_for_them():
    spread = [drive.specific_force.std() for drive in seen(FLAT, force_noise=0.2)]
    assert max(spread) < 0.21
    assert max(spread) > 0.12
    bias = np.array([drive.angular_velocity[0] for drive in seen(FLAT, rate_bias=0.05)])
    assert np.abs(bias).max() < 0.05
    assert np.ptp(bias) > 0.05


def test_quantized_cues_are_multiples_of_a_step():
    coarse = 0
    for noisy in seen(FLAT, range(6), force_noise=0.2, force_step=0.1):
        levels = np.unique(np.round(noisy.specific_force, 9))
        step = np.diff(levels).min()
        assert step < 0.1
        # Where steps are fine, what rounding leaves of them adds up.
        if step > 0.005:
            np.testing.assert_allclose(np.diff(levels) / step, np.round(np.diff(levels) / step), atol=0.01)
            coarse += 1
    assert coarse >= 3


def test_drop_outs_hold_the_last_cue_for_their_share_and_duration():
    for drive in seen(RISING, range(4), dropout=0.4, dropout_time=0.2):
        held = np.diff(drive.specific_force[:, 0]) == 0.0
        assert held.mean() < 0.45
        changes = np.diff(np.concatenate(([0], held.astype(int), [0])))
        lengths = np.flatnonzero(changes == -1) - np.flatnonzero(changes == 1)
        assert lengths.mean() == pytest.approx(20.0, rel=0.35)


def test_a_low_pass_halves_the_power_at_its_cutoff():
    time = 0.01 * np.arange(N)
    wave = CueTrace("wave", time, np.outer(np.sin(2.0 * np.pi * 3.0 * time), np.ones(3)), np.zeros((N, 3)))
    passed = seen(wave, [0], low_pass=(3.0, 3.0))[0].specific_force[2000:, 0]
    assert passed.std() == pytest.approx(np.sqrt(0.5) * np.sqrt(0.5), rel=0.02)


@pytest.fixture(scope="module")
def drive():
    return get_maneuver("lane-change").drive()


def observed(drive, n, sensors):
    """Observations and rewards of ``n`` environments over 60 steps without action."""
    task = load_task(None, randomization={"car_sensors": sensors}, observation={"memory": (0.3,)})
    batch = Batch(n, task, drives=[drive])
    everywhere = np.ones(n, dtype=bool)
    batch.seed(everywhere, list(range(n)))
    batch.begin(everywhere)
    batch.observe(everywhere)
    rows, rewards = [], []
    for _ in range(60):
        batch.write(np.zeros((n, batch.action_size)))
        batch.step()
        rows.append(batch.arrays.observation.pull().copy())
        rewards.append(batch.arrays.reward.pull().copy())
    return batch, np.array(rows), np.array(rewards)


def test_an_agent_sees_the_sensors_cues_and_is_rewarded_for_the_true_ones(drive):
    errors = {"force_noise": 0.3, "rate_noise": 0.02, "dropout": 0.3}
    batch, true, rewards = observed(drive, 2, {})
    _, noisy, same = observed(drive, 2, errors)
    _, alone, _ = observed(drive, 1, errors)
    np.testing.assert_array_equal(rewards, same)
    np.testing.assert_array_equal(noisy[:, :1], alone)
    force = slice(FIRST["reference_force"], FIRST["reference_force"] + 3)
    sensed = sensed_drives([drive], CarSensors(**errors), 0)[0]
    steps = np.arange(1, 61) * batch.options.action.repeat
    expected = (sensed.specific_force - drive.specific_force)[steps]
    shown = expected / SCALES["reference_force"] * batch.layout.gains[force]
    np.testing.assert_allclose((noisy - true)[:, 0, force], shown, atol=1e-4)
