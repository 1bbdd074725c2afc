"""Whatever the commands, no actuator leaves its limits in position, speed or acceleration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.platform import Platform

from .platforms_under_test import PRESETS, sluggish
from .storms import Watch, every_direction, simulator, storm

pytestmark = pytest.mark.slow

EXACT = 1e-9
LAGGED = 1e-6
BATCH = 256
SCALES = st.sampled_from([0.3, 3.0, 30.0, 1e3, 1e6])


def weather(platform: Platform, scale: float, seed: int, steps: int, tolerance: float) -> Watch:
    watch, batch = Watch(platform, tolerance), simulator(platform, BATCH)
    batch.reset()
    for k, action in enumerate(storm(BATCH, steps, scale, seed)):
        state = batch.step(action)
        watch.check(state)
        if k % 25 == 0:
            watch.check_pose(state)
    return watch


# 4 presets x 6 examples x 256 sequences = 6144 random sequences, each of 250 steps.
@pytest.mark.parametrize("name", PRESETS)
@settings(max_examples=6)
@given(scale=SCALES, seed=st.integers(0, 2**32 - 1))
def test_random_commands_break_no_limit(name, scale, seed):
    weather(PRESETS[name], scale, seed, steps=250, tolerance=EXACT)


@pytest.mark.parametrize("name", PRESETS)
@settings(max_examples=2)
@given(scale=SCALES, seed=st.integers(0, 2**32 - 1))
def test_random_commands_break_no_limit_with_lag_and_dead_time(name, scale, seed):
    weather(sluggish(PRESETS[name]), scale, seed, steps=150, tolerance=LAGGED)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("scale", [2.0, 1e6])
def test_constant_full_acceleration_in_every_direction_breaks_no_limit(name, scale):
    action = every_direction(scale)
    watch, batch = Watch(PRESETS[name], EXACT), simulator(PRESETS[name], len(action))
    batch.reset()
    for k in range(300):
        watch.check(batch.step(action))
        if k % 25 == 0:
            watch.check_pose(batch.state)


@pytest.mark.parametrize("name", PRESETS)
def test_braking_from_a_storm_leads_to_rest_clear_of_singular_poses(name):
    # Commands of zero leave the platform coasting, so each environment brakes its own velocity.
    weather(PRESETS[name], 1e3, seed=11, steps=200, tolerance=EXACT)
    watch, batch = Watch(PRESETS[name], EXACT), simulator(PRESETS[name], BATCH)
    for k in range(600):
        motion = batch.state["setpoint"]
        if k == 0:
            watch.before = {field: batch.state[field]["rate"].copy() for field in ("setpoint", "motion")}
        rate = np.concatenate(
            [motion["rate"][:, :2], motion["velocity"], motion["beta_rate"], motion["rate"][:, 8:]], axis=1
        )
        watch.check(batch.step(-2.0 * rate))
    watch.check_pose(batch.state)
    assert np.abs(batch.state["motion"]["rate"]).max() < 1e-3
    assert watch.least_clearance > 0.14


@pytest.mark.parametrize("name", PRESETS)
def test_every_machine_comes_home_from_wherever_it_was_driven(name):
    platform = PRESETS[name]
    weather(platform, 1e3, seed=12, steps=150, tolerance=EXACT)
    batch = simulator(platform, BATCH)
    for _ in range(1500):
        motion = batch.state["setpoint"]
        pose = np.concatenate([motion["position"][:, :2], motion["displacement"], motion["beta"]], axis=1)
        rate = np.concatenate([motion["rate"][:, :2], motion["velocity"], motion["beta_rate"]], axis=1)
        home = np.concatenate([-pose - 2.0 * rate, -2.0 * motion["rate"][:, 8:]], axis=1)
        batch.step(home)
    motion = batch.state["setpoint"]
    assert np.abs(motion["position"][:, :8]).max() < 1e-3
    assert np.abs(motion["beta"]).max() < 1e-3
