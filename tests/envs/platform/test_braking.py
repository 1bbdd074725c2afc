"""Limits are used to the full: stops come late but in time, and the way back is open at once."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from motion_cueing.envs.platform import Platform, actuator_limits
from motion_cueing.envs.platform.kernels import ACTUATORS, AXES

from .platforms_under_test import DT, PRESETS
from .storms import simulator

END, VELOCITY, ACCELERATION, SINGULAR = 1, 2, 4, 8


def along(axis: str, value: float) -> np.ndarray:
    """(1, 9) acceleration of one axis."""
    return value * np.eye(9)[[AXES.index(axis)]]


def bits(state: np.ndarray, actuator: str) -> int:
    """The four limit bits of an actuator of the first environment."""
    return int(state["limits"][0]) >> 4 * ACTUATORS.index(actuator) & 15


def push(platform: Platform, action: np.ndarray, steps: int) -> np.ndarray:
    """Set-point positions and rates (steps, 2, 9) under a constant command from rest at neutral."""
    batch = simulator(platform, 1)
    batch.reset()
    path = []
    for _ in range(steps):
        motion = batch.step(action)["setpoint"][0]
        path.append([motion["position"].copy(), motion["rate"].copy()])
    return np.array(path)


@pytest.mark.parametrize("name", ["paper", "nads-1"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_carriage_reaches_its_end_as_fast_as_its_limits_allow(name, sign):
    limits = {key: values[0] for key, values in actuator_limits(PRESETS[name]).items()}
    travel, speed, acceleration = limits["position_max"], limits["velocity"], limits["acceleration"]
    path = push(PRESETS[name], along("carriage_x", sign * 1e3), 600)[:, :, 0] * sign
    # Up to full speed, along, and down again: D / V + V / A.
    soonest = travel / speed + speed / acceleration
    left = travel - path[:, 0]
    assert (left >= 0.0).all()
    arrived = int(np.argmax(left < acceleration * DT**2))
    assert soonest - 2 * DT <= (arrived + 1) * DT <= soonest + 5 * DT
    assert left[-1] < acceleration * DT**2 / 2.0
    assert path[-1, 1] == 0.0
    assert path[:, 1].max() == pytest.approx(speed, rel=1e-12)
    assert np.abs(np.diff(path[:, 1])).max() / DT == pytest.approx(acceleration, rel=1e-9)


def test_a_turntable_with_an_end_reaches_it():
    limit = actuator_limits(PRESETS["24-inch"])["position_max"][8]
    path = push(PRESETS["24-inch"], along("turntable", 1e3), 500)[:, :, 8]
    assert 0.0 <= limit - path[-1, 0] < np.radians(120.0) * DT**2 / 2.0
    assert path[-1, 1] == 0.0


def test_an_unlimited_turntable_turns_on_at_full_speed():
    path = push(PRESETS["paper"], along("turntable", 1e3), 2000)[:, :, 8]
    assert path[100:, 1] == pytest.approx(np.radians(60.0), rel=1e-12)
    assert path[-1, 0] > 15.0


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_legs_reach_their_ends_in_heave(direction):
    # In pure heave the legs of this symmetric hexapod all do the same.
    platform = PRESETS["dim-hexapod"]
    low, high = platform.hexapod.extension
    path = push(platform, along("heave", direction * 1e3), 200)[:, :, 2:8]
    stop = low if direction > 0.0 else high  # z points down: up is longer
    assert np.abs(path[-1, 0] - stop).max() < 10.0 * DT**2
    assert np.abs(path[-1, 1]).max() == 0.0
    assert np.abs(np.diff(path[:, 1], axis=0)).max() / DT == pytest.approx(10.0, rel=1e-6)


@pytest.mark.parametrize("axis", ["carriage_x", "carriage_y", "turntable"])
def test_the_way_back_is_open_at_once(axis):
    platform = PRESETS["24-inch"] if axis == "turntable" else PRESETS["paper"]
    push(platform, along(axis, 50.0), 800)
    state = simulator(platform, 1).step(along(axis, -1.0))
    assert state["setpoint"]["rate"][0, ACTUATORS.index(axis)] == pytest.approx(-DT, rel=1e-12)
    assert state["limits"][0] == 0


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("axis", ["surge", "sway", "heave", "roll", "pitch", "yaw"])
def test_the_platform_follows_back_at_once(name, axis):
    batch = simulator(PRESETS[name], 1)
    push(PRESETS[name], along(axis, 2.0), 700)
    before = batch.state["setpoint"][0].copy()
    after = batch.step(along(axis, -0.1))["setpoint"][0]
    rate = np.concatenate([after["velocity"] - before["velocity"], after["beta_rate"] - before["beta_rate"]])
    # A platform that still slides along a limit may go back faster than asked, never slower.
    assert rate[AXES.index(axis) - 2] <= -0.099 * DT


def test_gentle_commands_meet_no_limit():
    batch = simulator(PRESETS["paper"], 1)
    batch.reset()
    for k in range(300):
        state = batch.step(0.2 * np.cos(2.0 * DT * k) * np.ones((1, 9)))
        assert state["limits"][0] == 0, k


def test_the_limits_of_a_carriage_axis_are_told_apart():
    batch = simulator(PRESETS["paper"], 1)
    batch.reset()
    assert bits(batch.step(along("carriage_y", 100.0)), "carriage_y") == ACCELERATION
    seen = [bits(batch.step(along("carriage_y", 3.0)), "carriage_y") for _ in range(600)]
    changes = [seen[0]] + [b for a, b in pairwise(seen) if a != b]
    assert changes == [0, VELOCITY, END]
    assert bits(batch.state, "carriage_x") == 0


def test_a_leg_at_its_end_is_named():
    batch = simulator(PRESETS["dim-hexapod"], 1)
    push(PRESETS["dim-hexapod"], along("heave", -20.0), 200)
    assert [bits(batch.state, f"leg_{i}") for i in range(1, 7)] == [END] * 6


def test_a_singular_pose_ahead_is_told_by_every_leg():
    batch = simulator(PRESETS["24-inch"], 1)
    batch.reset()
    met = set()
    for _ in range(400):
        state = batch.step(along("yaw", 2.0))
        met |= {tuple(bits(state, f"leg_{i}") & SINGULAR for i in range(1, 7))}
    assert (SINGULAR,) * 6 in met
