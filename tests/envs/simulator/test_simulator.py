"""The batch simulator: rows are environments of their own, bit for bit; bad input moves nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ActionError, ConfigurationError, DataError
from motion_cueing.envs.platform import Cab, get_platform
from motion_cueing.envs.simulator.simulator import TIME_STEP, Simulator

from ...reference.comparison import bits

REST = np.array([0.0, 0.0, -9.81])
PLATFORMS = [get_platform(name) for name in ("paper", "24-inch", "nads-1")]


def drive(name: str, samples: int, seed: int) -> CueTrace:
    rng = np.random.default_rng(seed)
    time = TIME_STEP * np.arange(samples)
    force = np.cumsum(0.05 * rng.normal(size=(samples, 3)), axis=0) + REST
    return CueTrace(name, time, force, np.cumsum(0.005 * rng.normal(size=(samples, 3)), axis=0))


DRIVES = [drive("short", 40, 1), drive("long", 400, 2)]


def commands(n: int, steps: int) -> np.ndarray:
    return 3.0 * np.cumsum(0.3 * np.random.default_rng(3).normal(size=(steps, n, 9)), axis=0)


def mixed(n: int = 24) -> Simulator:
    """Every environment with its own machine, drive and start."""
    rng = np.random.default_rng(4)
    batch = Simulator(PLATFORMS, DRIVES, platform_of=rng.integers(0, 3, n), drive_of=rng.integers(0, 2, n))
    start = 0.03 * rng.normal(size=(n, 9))
    start[batch.platform_of == 1, :2] = 0.0
    batch.reset(start=start, sample=rng.integers(0, 30, n))
    return batch


def test_every_row_is_a_single_simulator_bit_for_bit():
    batch = mixed()
    actions = commands(batch.n, 120)
    begin = batch.state.copy()
    record = np.array([batch.step(action).copy() for action in actions])
    for i in range(batch.n):
        single = Simulator(batch.platforms[batch.platform_of[i]], batch.drives[batch.drive_of[i]])
        pose = begin["motion"][i]
        start = [*pose["position"][:2], *pose["displacement"], *pose["beta"], pose["position"][8]]
        single.reset(start=start, sample=[begin["sample"][i]])
        for k, action in enumerate(actions):
            assert bits(single.step(action[i])[0]) == bits(record[k, i]), (i, k)


def test_every_platform_has_its_own_head():
    other = replace(PLATFORMS[0], cab=Cab(head=(0.4, 0.3, -1.0)))
    batch = Simulator([PLATFORMS[0], other], DRIVES[1], platform_of=[0, 1], drive_of=[0, 0])
    batch.reset()
    wanted = batch.step(np.zeros((2, 9)))["reference_cue"]["head_force"]
    for i, platform in enumerate(batch.platforms):
        np.testing.assert_allclose(wanted[i], DRIVES[1].at_point(platform.cab.head)[1], atol=1e-12)


def test_the_same_commands_give_the_same_bits():
    runs = []
    for _ in range(2):
        batch = mixed()
        runs.append([bits(batch.step(action)) for action in commands(batch.n, 100)])
    assert runs[0] == runs[1]


def test_a_reset_forgets_everything():
    batch = Simulator(PLATFORMS[0], DRIVES[1])
    actions = commands(1, 100)
    batch.reset()
    first = [bits(batch.step(action)) for action in actions]
    batch.reset()
    assert [bits(batch.step(action)) for action in actions] == first


def test_a_masked_reset_leaves_the_others_alone():
    batch = mixed()
    for action in commands(batch.n, 30):
        batch.step(action)
    before = batch.state.copy()
    mask = np.arange(batch.n) % 3 == 0
    after = batch.reset(mask=mask).copy()
    assert bits(after[~mask]) == bits(before[~mask])
    assert not after["motion"]["rate"][mask].any()
    assert not after["sample"][mask].any()


def test_the_first_state_is_at_rest_where_it_was_put():
    batch = Simulator(PLATFORMS[0], DRIVES[1])
    pose = np.array([1.0, -2.0, 0.1, 0.05, -0.1, 0.05, -0.04, 0.1, 0.7])
    state = batch.reset(start=pose, sample=[5])[0]
    motion = state["motion"]
    np.testing.assert_array_equal(motion["position"][[0, 1, 8]], pose[[0, 1, 8]])
    np.testing.assert_array_equal(np.concatenate([motion["displacement"], motion["beta"]]), pose[2:8])
    assert not motion["rate"].any()
    assert not state["acceleration"].any()
    assert state["limits"] == 0
    assert np.linalg.norm(state["simulator_cue"]["force"]) == pytest.approx(9.81, rel=1e-13)
    np.testing.assert_allclose(
        state["perceived_simulator"]["force"], state["simulator_cue"]["head_force"], atol=1e-10
    )
    np.testing.assert_array_equal(state["reference_cue"]["force"], DRIVES[1].specific_force[5])
    np.testing.assert_allclose(
        state["reference_cue"]["head_force"], DRIVES[1].at_point(PLATFORMS[0].cab.head)[5], atol=1e-12
    )


def test_wanted_cues_walk_through_the_drive_and_stay_at_its_end():
    batch = Simulator(PLATFORMS[0], DRIVES[0])
    batch.reset()
    for k in range(1, 60):
        state = batch.step(np.zeros(9))[0]
        sample = min(k, len(DRIVES[0]) - 1)
        assert state["sample"] == k
        np.testing.assert_array_equal(state["reference_cue"]["force"], DRIVES[0].specific_force[sample])
        np.testing.assert_array_equal(state["reference_cue"]["rate"], DRIVES[0].angular_velocity[sample])
        assert batch.finished[0] == (k >= len(DRIVES[0]) - 1)


def test_the_state_before_a_step_stays_readable():
    batch = Simulator(PLATFORMS[0], DRIVES[1])
    before = batch.reset()
    copy = before.copy()
    after = batch.step(np.ones(9))
    assert bits(before) == bits(copy)
    assert bits(after) != bits(copy)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_actions_that_are_not_finite_are_refused_and_nothing_moves(bad):
    batch = mixed()
    batch.step(commands(batch.n, 1)[0])
    before, asked = batch.state.copy(), batch.action_array.numpy().copy()
    action = np.zeros((batch.n, 9))
    action[7, 4] = bad
    with pytest.raises(ActionError, match="not finite"):
        batch.step(action)
    assert bits(batch.state) == bits(before)
    np.testing.assert_array_equal(batch.action_array.numpy(), asked)


@pytest.mark.parametrize("shape", [(9,), (24, 8), (23, 9), (24, 9, 1), (1, 9), ()])
def test_actions_of_another_shape_are_refused_and_nothing_moves(shape):
    batch = mixed()
    before = batch.state.copy()
    with pytest.raises(ActionError, match="shape"):
        batch.step(np.zeros(shape))
    assert bits(batch.state) == bits(before)


def test_actions_that_are_no_numbers_are_refused():
    with pytest.raises(ActionError):
        Simulator(PLATFORMS[0], DRIVES[0]).step(["fast"] * 9)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"platform_of": [0, 3], "drive_of": [0, 1]}, "platform_of must hold indices from 0 to 2"),
        ({"drive_of": [0, -1]}, "drive_of must hold indices from 0 to 1"),
        ({"drive_of": []}, "drive_of"),
        ({"platform_of": [0], "drive_of": [0, 1]}, "platform_of has 1 entries, drive_of 2"),
    ],
)
def test_indices_out_of_range_are_refused(fields, message):
    with pytest.raises(ConfigurationError, match=message):
        Simulator(PLATFORMS, DRIVES, **fields)


def test_nothing_to_simulate_is_refused():
    with pytest.raises(ConfigurationError, match="at least one"):
        Simulator(PLATFORMS[0], [])


def test_drives_of_another_time_step_are_refused():
    slow = CueTrace("slow", 0.02 * np.arange(5), np.zeros((5, 3)), np.zeros((5, 3)))
    with pytest.raises(DataError, match=r"slow: time step is 0\.02 s"):
        Simulator(PLATFORMS[0], slow)
    Simulator(PLATFORMS[0], slow.resampled(TIME_STEP))


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ([14.0] + [0.0] * 8, "outside the travel of paper"),
        ([0.0, 0.0, 0.0, 0.0, 1.0] + [0.0] * 4, "outside the travel"),
        ([np.nan] * 9, "start is not finite"),
        ([0.0] * 8, "start has shape"),
    ],
)
def test_starts_outside_the_machine_are_refused(start, message):
    batch = Simulator(PLATFORMS[0], DRIVES[0])
    with pytest.raises(DataError, match=message):
        batch.reset(start=start)


def test_missing_subsystems_stay_where_they_are():
    platform = PLATFORMS[0].without_carriage().without_turntable()
    batch = Simulator(platform, DRIVES[1])
    batch.reset()
    for action in commands(1, 200):
        motion = batch.step(action)["motion"]
        assert not motion["position"][0, [0, 1, 8]].any()
        assert not motion["rate"][0, [0, 1, 8]].any()


def test_memory_of_an_environment_is_small():
    batch = Simulator(PLATFORMS[0], DRIVES[1])
    # Both copies, the command and the delay line of a machine without dead time.
    assert 2 * batch.state.itemsize + 9 * 8 <= 4096


@pytest.mark.parametrize("sample", [-1, -1_000_000_000, 10_000_000])
def test_a_sample_outside_the_drive_is_refused(sample):
    batch = Simulator(PLATFORMS[0], DRIVES[:2], drive_of=[1])
    with pytest.raises(DataError, match="sample must be"):
        batch.reset(sample=[sample])


@pytest.mark.parametrize("dt", [0.0, -0.01, np.nan])
def test_a_time_step_must_be_positive(dt):
    with pytest.raises(ConfigurationError, match="dt must be"):
        Simulator(PLATFORMS[0], DRIVES[0], dt=dt)


@pytest.mark.parametrize("device", ["gpu", "cuda:99", "cpu:1"])
def test_an_unknown_device_is_named_with_those_there_are(device):
    with pytest.raises(ConfigurationError, match=rf"^device is '{device}'; use one of 'cpu'"):
        Simulator(PLATFORMS[0], DRIVES[0], device=device)


@pytest.mark.parametrize("device", ["cuda", "cuda:0"])
def test_a_gpu_without_a_driver_is_refused_with_the_reason(device, monkeypatch):
    def missing(name):
        raise RuntimeError("not supported by the driver") if name == "cuda" else ValueError("invalid")

    monkeypatch.setattr(wp, "get_device", missing)
    monkeypatch.setattr(wp, "is_cuda_available", lambda: False)
    with pytest.raises(ConfigurationError, match=rf"'{device}'.*Warp finds no CUDA driver"):
        Simulator(PLATFORMS[0], DRIVES[0], device=device)
