"""What the controller does when cues fail to come, when its policy fails, and when nobody means well."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import ablation_names, get_platform, platform_names
from motion_cueing.evaluation import rollout
from motion_cueing.evaluation.suite import cues_of
from motion_cueing.realtime import ControllerOptions, Cues, State, WatchdogOptions
from motion_cueing.realtime.client import LimitCheck
from motion_cueing.realtime.watchdog import BrakeOptions

from .bench import AT_ONCE, FLOATS, PAPER, SENDER, Bench, lane_change

pytestmark = pytest.mark.slow

TRACE = lane_change()


class FullAcceleration:
    """Full acceleration along all axes; raises, or answers something strange, from a call on."""

    name = "full"

    def __init__(self, strange=None, after=50) -> None:
        self.strange, self.after, self.calls = strange, after, -4

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.calls += 1
        if self.calls > self.after and self.strange is not None:
            return self.strange()
        return np.tile([2.0, -1.0, 0.5, 0.5, -0.5, 0.3, 0.3, 0.3, 1.0], (len(observation), 1)), state


def raising():
    raise RuntimeError("a user's\nmistake")


STRANGE = {
    "raises": raising,
    "NaN": lambda: (np.full(9, np.nan), None),
    "shape": lambda: (np.zeros(3), None),
    "no pair": lambda: np.zeros(9),
    "text": lambda: ("left", None),
}


def assert_within_limits(bench: Bench, platform=PAPER) -> None:
    check = LimitCheck(platform, bench.rate)
    assert [wrong for setpoint in bench.setpoints if (wrong := check(setpoint))] == []


def states_of(bench: Bench) -> list[State]:
    """The states in the order they came."""
    states = [setpoint.state for setpoint in bench.setpoints]
    return [state for k, state in enumerate(states) if k == 0 or state is not states[k - 1]]


def assert_at_rest(bench: Bench, tolerance=0.011) -> None:
    """At the start pose, but for whole turns of the table, without speed."""
    motion = bench.setpoints[-1].motion.copy()
    motion[8] -= 2.0 * np.pi * np.round(motion[8] / (2.0 * np.pi))
    assert bench.controller.state is State.NEUTRAL
    assert np.abs(motion[:18]).max() < tolerance


def test_without_cues_it_waits_at_neutral():
    bench = Bench(rate=200)
    bench.wait(0.5)
    assert states_of(bench) == [State.NEUTRAL]
    assert not np.array([setpoint.motion for setpoint in bench.setpoints]).any()
    assert bench.setpoints[-1].echo == 2**64 - 1


def test_silence_holds_then_brakes_to_neutral_and_cues_begin_anew():
    bench = Bench(watchdog=WatchdogOptions(overdue=0.03, hold=0.2, steady=0.1, fade=0.5))
    bench.stand(0.2)
    bench.drive(TRACE)
    moved = np.abs(bench.setpoints[-1].motion[:9]).max()
    assert moved > 0.05
    bench.settle(cues=False)
    bench.wait(5.0)
    assert_at_rest(bench, 1e-3)
    bench.drive(TRACE)
    assert bench.controller.state is State.RUNNING
    expected = [State.NEUTRAL, State.RUNNING, State.HOLDING, State.BRAKING]
    assert states_of(bench) == [*expected, State.NEUTRAL, State.RUNNING]
    held = sum(setpoint.state is State.HOLDING for setpoint in bench.setpoints)
    assert held == pytest.approx(100 * (0.2 - 0.03), abs=1.5)
    assert_within_limits(bench)
    assert bench.trajectory().metadata["loop_holding"] == str(held)


def test_a_machine_that_brakes_returns_before_it_follows_again():
    bench = Bench(FullAcceleration(), AT_ONCE)
    bench.stand(1.0)
    bench.wait(0.3)
    assert bench.controller.state is State.BRAKING
    while bench.controller.state is State.BRAKING:
        bench.stand(0.01)
    assert states_of(bench) == [State.RUNNING, State.HOLDING, State.BRAKING, State.RUNNING]
    again = next(k for k in range(200, len(bench.setpoints)) if bench.setpoints[k].state is State.RUNNING)
    assert np.abs(bench.setpoints[again - 1].motion[:18]).max() < 0.011
    assert_within_limits(bench)


def test_cues_fade_in_when_the_policy_begins():
    bench = Bench(watchdog=WatchdogOptions(steady=0.0, fade=0.5))
    for k in range(100):
        # A car that moves never repeats its cues to the bit.
        bench.send(force=(1.0, 1e-9 * k, -9.81), rate=(0.0, 1e-9 * k, 0.2))
        bench.step()
    logged = bench.trajectory()
    np.testing.assert_allclose(logged.f_reference[:, 0], np.minimum(np.arange(100) / 50, 1.0), atol=1e-12)
    np.testing.assert_allclose(
        logged.w_reference[:, 2], 0.2 * np.minimum(np.arange(100) / 50, 1.0), atol=1e-12
    )
    np.testing.assert_allclose(logged.f_reference[:, 2], -9.81)


def test_cues_fade_out_when_the_drive_pauses_and_in_when_it_goes_on():
    bench = Bench(watchdog=WatchdogOptions(steady=0.0, fade=0.0))
    for k in range(600):
        paused = 100 <= k < 300
        # What a menu sends means nothing.
        bench.send((9.0, -9.0, 0.0) if paused else (1.0, 1e-9 * k, -9.81), (0.0, 1e-9 * k, 0.2), paused)
        bench.step()
    logged = bench.trajectory()
    share = logged.f_reference[:, 0]
    np.testing.assert_allclose(logged.w_reference[:, 2], 0.2 * share, atol=1e-4)
    np.testing.assert_allclose(share[:100], 1.0)
    np.testing.assert_allclose(share[[250, 325, 599]], [0.0, 0.0, 1.0], atol=2e-3)
    # 2 % are left after the fade of a second, and nothing steps or swings over.
    assert share[200] == pytest.approx(0.02, abs=2e-3)
    assert share[429] == pytest.approx(0.98, abs=5e-3)
    assert np.abs(np.diff(share)).max() < 0.025
    assert np.abs(np.diff(share, 2)).max() < 0.005
    assert 0.0 <= share.min() <= share.max() < 1.0001
    np.testing.assert_allclose(logged.f_reference[:, 1:], np.tile([0.0, -9.81], (600, 1)), atol=1e-6)
    assert states_of(bench) == [State.RUNNING]
    assert bench.setpoints[250].echo == 99
    assert bench.controller.guard.counts["pauses"] == 1


def test_a_pause_is_not_felt_as_a_jerk():
    def largest_jerk(pause):
        bench = Bench(watchdog=WatchdogOptions(steady=0.0, fade=1.0))
        bench.drive(lane_change(4.0))
        for _ in range(pause):
            bench.send((0.0, 0.0, 0.0), paused=True)
            bench.step()
        bench.drive(lane_change(4.0))
        return np.abs(np.diff(bench.trajectory().f_simulator, axis=0)).max() / 0.01

    assert largest_jerk(pause=200) < 2.0 * largest_jerk(pause=0)


@pytest.mark.parametrize("strange", STRANGE.values(), ids=STRANGE)
def test_a_policy_that_fails_is_not_called_again(strange):
    policy = FullAcceleration(strange)
    bench = Bench(policy)
    bench.settle()
    bench.stand(0.2)
    assert states_of(bench) == [State.RUNNING, State.BRAKING, State.NEUTRAL]
    assert len(bench.controller.faults) == 1
    assert policy.calls == policy.after + 1
    assert_at_rest(bench)
    assert_within_limits(bench)
    assert len(bench.trajectory()) == len(bench.setpoints)


def test_a_machine_that_would_move_to_nowhere_stays_where_it_is(monkeypatch):
    bench = Bench(FullAcceleration())
    bench.stand(0.5)
    # Accelerations that are finite lead nowhere, so the motion is broken by hand.
    view, where = bench.machine._view, bench.machine.motion.copy()
    answers = iter([np.full((2, 15), np.nan)])
    monkeypatch.setattr(bench.machine, "_view", lambda: next(answers, view()))
    bench.stand(0.01)
    assert bench.controller.faults == ["the policy requested accelerations beyond all numbers"]
    assert np.abs(bench.machine.motion[0] - where[0]).max() < 0.1
    bench.settle()
    bench.stand(0.2)
    assert_at_rest(bench)
    assert_within_limits(bench)


def test_stopping_brakes_and_finishes_at_neutral():
    bench = Bench(FullAcceleration())
    bench.stand(1.0)
    bench.controller.stop()
    assert not bench.controller.finished
    bench.settle()
    assert bench.controller.finished
    assert states_of(bench) == [State.RUNNING, State.BRAKING, State.NEUTRAL]


def test_a_number_from_nowhere_costs_no_more_than_a_moment():
    bench = Bench(watchdog=WatchdogOptions(steady=0.05, fade=0.0))
    bench.stand(0.2)
    bench.sequence += 5000
    assert bench.send() == "used"
    bench.sequence -= 5000
    bench.stand(0.5)
    assert bench.controller.state is State.RUNNING
    assert bench.controller.inbox.counts["late"] > 0


@pytest.mark.parametrize("name", [*platform_names(), *ablation_names()])
def test_every_machine_returns_from_full_motion(name):
    platform = get_platform(name)
    bench = Bench(FullAcceleration(), platform=platform)
    bench.stand(1.5)
    assert np.abs(bench.setpoints[-1].motion[:9]).max() > 0.02
    bench.settle(cues=False)
    assert_at_rest(bench)
    assert_within_limits(bench, platform)


class Wild:
    """Accelerations of any size, drawn anew at each step."""

    name = "wild"

    def __init__(self, seed, scale) -> None:
        self.random, self.scale = np.random.default_rng(seed), scale

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return self.scale * self.random.normal(size=(1, 9)), state


DATAGRAMS = st.lists(
    st.one_of(
        st.binary(max_size=80),
        st.tuples(st.integers(0, 300), st.floats(), st.lists(st.floats(-2e3, 2e3), min_size=6, max_size=6)),
    ),
    max_size=60,
)


# The walls are met at every scale: limits of acceleration, velocity and travel, and singular poses.
@settings(max_examples=12, deadline=None)
@given(
    data=DATAGRAMS, seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([1.0, 10.0, 1e3, 1e6, 1e150, 1e306])
)
def test_no_setpoint_leaves_the_limits_whatever_comes_and_whatever_the_policy_does(data, seed, scale):
    bench = Bench(Wild(seed, scale), WatchdogOptions(steady=0.0), rate=500)
    for item in data:
        if isinstance(item, tuple):
            sequence, time, cues = item
            item = FLOATS.pack_cues(Cues(sequence, time, tuple(cues[:3]), tuple(cues[3:])))
        bench.controller.inbox.take(item, SENDER, bench.now)
        bench.wait(0.03)
    bench.controller.inbox.reset()
    for _ in range(150):
        bench.send()
        bench.wait(0.01)
    bench.wait(0.5)
    assert State.RUNNING in states_of(bench)
    assert State.BRAKING in states_of(bench)
    assert_within_limits(bench)


def test_the_log_drives_again_as_it_was():
    bench = Bench(rate=200)
    sent = bench.drive(TRACE)
    logged = bench.trajectory()
    again = rollout(bench.policy, cues_of(logged, "again"))
    np.testing.assert_array_equal(again.carriage, logged.carriage)
    np.testing.assert_array_equal(again.hexapod, logged.hexapod)
    np.testing.assert_array_equal(logged.hexapod[1:], sent[:-1, 2:8])
    assert np.isfinite(logged.step_time[1:]).all()


@pytest.mark.parametrize("rate", [50, 150, 0, -100])
def test_a_rate_that_does_not_fit_the_policies_is_refused(rate):
    with pytest.raises(ConfigurationError, match="multiple of 100"):
        ControllerOptions(rate=rate)


def test_a_brake_without_acceleration_is_refused():
    with pytest.raises(ConfigurationError, match="share"):
        BrakeOptions(share=0.0)
