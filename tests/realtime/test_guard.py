"""The guard: clean drives pass to the bit, and every fault is found, smoothed and counted."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from benchmarks.loop_faults import FAULTS, NORMAL_RANGE, OTHER_DRIVES, RATE, cues_of, felt
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import (
    RandomDrives,
    get_maneuver,
    get_recording,
    maneuver_names,
    random_drives,
    recording_names,
)
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime import Cues, FloatsFormat, GuardOptions, make_machine
from motion_cueing.realtime.guard import GUARD_KINDS, Blend, Guard
from motion_cueing.realtime.inbox import Inbox
from motion_cueing.realtime.machine import AT_REST

from .bench import PAPER

OVERDUE = 0.03


def guarded(sent):
    """(n, 6) cues that the guard gives at each step while packets arrive; the guard."""
    guard, form = Guard(GuardOptions(), OVERDUE), FloatsFormat()
    inbox = Inbox(form, 0.05, OVERDUE)
    rows, waiting = [], 0
    for k in range(sent[-1].arrival + 1):
        while waiting < len(sent) and sent[waiting].arrival <= k:
            cues = sent[waiting].cues
            inbox.take(b"noise" if cues is None else form.pack_cues(cues), ("127.0.0.1", 9), k / RATE)
            waiting += 1
        if inbox.newest is not None:
            rows.append(guard(inbox.newest, inbox.paused, inbox.accepted))
    return np.array(rows), guard


def given(rows, rate, options=None):
    """What the guard gives at 100 Hz for a sender of another rate; and the newest row of each step."""
    guard, newest, out = Guard(options or GuardOptions(), OVERDUE), [], []
    arrival = np.ceil(np.arange(len(rows)) * RATE / rate - 1e-9)
    for step in range(int(arrival[-1])):
        k = int(np.searchsorted(arrival, step, side="right")) - 1
        out.append(guard(Cues(k, k / rate, tuple(rows[k, :3]), tuple(rows[k, 3:])), False, k + 1))
        newest.append(rows[k])
    return np.array(out), np.array(newest), guard


def clean_drives():
    yield from ((name, get_maneuver(name).drive()) for name in maneuver_names())
    yield from ((name, get_recording(name)) for name in recording_names())
    for kind in ("urban", "rural", "highway", "track", "hilly", "strip", "cones"):
        for drive in random_drives(4, 30.0, 11, kind=kind, drives=RandomDrives(roughness=(16.0, 256.0))):
            yield drive.name, drive


@pytest.mark.slow
def test_drives_without_faults_pass_to_the_bit():
    for name, drive in clean_drives():
        for rate in (60, 100, 1000):
            trace = drive.resampled(1.0 / rate)
            rows = np.hstack([trace.specific_force, trace.angular_velocity])
            out, newest, guard = given(rows, rate)
            np.testing.assert_array_equal(out, newest, err_msg=f"{name}, {rate} Hz")
            assert not any(guard.counts.values()), (name, rate, guard.counts)


@lru_cache
def lane_change():
    return cues_of(get_maneuver("double-lane-change").drive())


EXPECTED = {
    "spike of 15 m/s^2": {"spikes": 1},
    "Euler wrap of 4 rad/s": {"spikes": 1},
    "Euler wrap of 99 rad/s": {"gaps": 1},
    "paused, last packet for 10 s": {"stuck": 1},
    "flag of a pause for 5 s": {"pauses": 1},
    "reset to standing": {"jumps": 1},
    "teleport to 2 s before": {"jumps": 1},
    "force frozen for 3 s": {"stuck": 1},
    "lost for 0.15 s": {"gaps": 1},
    "stalled for 0.1 s": {"gaps": 1},
}


@pytest.mark.parametrize("fault", EXPECTED)
def test_faults_are_counted_by_kind(fault):
    rows, at = lane_change()
    _, guard = guarded(FAULTS[fault](rows, at, np.random.default_rng(0)))
    counts = {kind: n for kind, n in guard.counts.items() if n and kind != "copies"}
    assert counts == EXPECTED[fault]
    assert set(guard.counts) == set(GUARD_KINDS)


@pytest.mark.parametrize("fault", [name for name in FAULTS if name not in OTHER_DRIVES])
def test_no_fault_steps_the_cues(fault):
    rows, at = lane_change()
    out, _ = guarded(FAULTS[fault](rows, at, np.random.default_rng(0)))
    slope = np.abs(np.diff(rows, axis=0)).max(axis=0)
    # Beyond twice the drive's own slope only as a fade has it: 2.1 times its distance in a second.
    reach = np.abs(rows - AT_REST).max(axis=0)
    assert (
        np.abs(np.diff(out, axis=0)).max(axis=0) <= np.maximum(2.0 * slope, slope + 2.2 * 0.01 * reach)
    ).all()
    for part in (slice(0, 3), slice(3, 6)):
        assert np.abs(out - AT_REST)[:, part].max() <= 1.1 * reach[part].max()


def test_cues_come_back_after_a_fault():
    rows, at = lane_change()
    for fault in (
        "spike of 15 m/s^2",
        "flag of a pause for 5 s",
        "lost for 0.15 s",
        "paused, last packet for 10 s",
    ):
        out, guard = guarded(FAULTS[fault](rows, at, np.random.default_rng(0)))
        assert guard.follows
        np.testing.assert_array_equal(out[-100:], rows[-100:])


def test_cues_beyond_the_slew_for_ever_stay_those_of_a_standing_car():
    random = np.random.default_rng(0)
    rows = AT_REST + random.normal(size=(1000, 6)) * [5.0, 5.0, 0.0, 0.0, 0.0, 0.0]
    out, newest, guard = given(rows, RATE)
    assert not guard.follows
    np.testing.assert_allclose(out[300:], np.tile(AT_REST, (len(out) - 300, 1)), atol=1e-9)
    wide, newest, guard = given(rows, RATE, GuardOptions(force_slew=1e5))
    np.testing.assert_array_equal(wide, newest)
    assert guard.follows


def test_a_standing_car_is_never_stuck_and_one_that_moves_is():
    for axis, offset, stuck in ((0, 0.0, 0), (0, 0.5, 1), (5, 0.1, 1)):
        row = AT_REST.copy()
        row[axis] += offset
        _, guard = guarded(FAULTS["none"](np.tile(row, (200, 1)), 0, None))
        assert guard.counts["stuck"] == stuck


def test_a_blend_is_a_critically_damped_spring():
    blend, w = Blend(np.full(6, 1e9)), 5.83
    x0, v0 = np.arange(1.0, 7.0), np.array([0.0, 1.0, -1.0, 5.0, -20.0, 0.5])
    blend.start(x0, v0, 1.0)
    for k in range(1, 200):
        t = 0.01 * k
        np.testing.assert_allclose(
            blend.step(), (x0 + (v0 + w * x0) * t) * np.exp(-w * t), rtol=1e-9, atol=1e-12
        )


def test_a_blend_keeps_its_slope_within_the_bound_and_ends():
    blend = Blend(np.full(6, 2.0))
    blend.start(np.array([10.0, -10.0, 1.0, 0.1, 0.0, 3.0]), np.zeros(6), 0.1)
    rows = [np.array([10.0, -10.0, 1.0, 0.1, 0.0, 3.0])]
    while not blend.over:
        rows.append(blend.step())
        assert len(rows) < 1000
    assert np.abs(np.diff(rows, axis=0)).max() <= 0.02 + 1e-12
    # It does not swing over.
    assert np.array(rows)[:, 0].min() >= 0.0


def test_nonsense_is_refused():
    with pytest.raises(ConfigurationError, match="force_slew"):
        GuardOptions(force_slew=0.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["classical-tuned", "learned"])
def test_what_is_felt_stays_normal(name):
    rows, at = lane_change()
    policy = make_policy(name, PAPER)
    machine = make_machine(policy, PAPER)
    own = felt(machine, policy, FAULTS["none"](rows, at, np.random.default_rng(0)))
    for fault, make in FAULTS.items():
        if fault in OTHER_DRIVES:
            continue
        found = felt(machine, policy, make(rows, at, np.random.default_rng(0)))
        assert found.jerk <= 2.0 * own.jerk, fault
        assert found.reach <= NORMAL_RANGE * own.reach, fault
