"""A policy in the loop moves the machine as in a rollout, to the bit; set-points between steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.baselines.compensation import Compensated
from motion_cueing.baselines.washout import ScheduledWashout
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.maneuvers import random_drives
from motion_cueing.envs.platform import legs_of_pose
from motion_cueing.envs.platform.machines import ActuatorDynamics
from motion_cueing.envs.road import ROAD_TIMES
from motion_cueing.envs.task import ActionOptions, ObservationOptions, TaskOptions
from motion_cueing.envs.task.kernels.observation import layout_of
from motion_cueing.envs.task.options import load_task
from motion_cueing.envs.task.predictor import Predictor, PredictorOptions, inputs_of, with_preview
from motion_cueing.evaluation import rollout
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime import Cues, State, make_machine
from motion_cueing.realtime.machine import Track
from motion_cueing.realtime.packets import MOTION
from motion_cueing.realtime.server import Endpoint

from .bench import FLOATS, PAPER, Bench, lane_change

pytestmark = pytest.mark.slow

TRACE = lane_change()


class Feedback:
    """Tanh of a random matrix times the observation, with a leaky memory: whatever it sees counts."""

    def __init__(self, task, base_policy=None, size=9) -> None:
        self.task, self.base_policy = task, base_policy
        columns = layout_of(task.observation, task.action.mode, size).size
        self.weights = np.random.default_rng(3).normal(size=(size, columns)) / columns**0.5

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        memory = np.zeros(observation.shape) if state is None else state
        memory = 0.9 * memory + 0.1 * observation
        return 0.5 * np.tanh((observation + memory) @ self.weights.T), memory


def axes_of(trajectory) -> np.ndarray:
    return np.hstack([trajectory.carriage, trajectory.hexapod, trajectory.turntable[:, None]])


def assert_same_motion(bench: Bench, sent: np.ndarray, expected) -> None:
    """The set-points are those of a rollout, one sample later; and the log tells the same drive."""
    assert not bench.controller.faults
    last = len(sent) - bench.machine.ahead_steps - 1
    np.testing.assert_array_equal(sent[:last, :9], axes_of(expected)[1 : last + 1])
    np.testing.assert_array_equal(sent[:last, 27:33], expected.legs[1 : last + 1])
    assert np.abs(axes_of(expected)).max() > 0.01
    logged = bench.trajectory()
    for name in (
        "carriage",
        "hexapod",
        "turntable",
        "f_simulator",
        "w_simulator",
        "f_reference",
        "w_reference",
    ):
        np.testing.assert_allclose(getattr(logged, name)[:last], getattr(expected, name)[:last], atol=1e-12)


TASKS = {
    "plain": {},
    "memory": {"observation": ObservationOptions(memory=(0.5, 3.0), frame="cab")},
    "stack": {"observation": ObservationOptions(stack=3)},
    "true motion": {"observation": ObservationOptions(true_motion=True)},
    "jerk, held": {"action": ActionOptions(mode="jerk", repeat=3)},
    "velocity in the cab": {"action": ActionOptions(mode="velocity", frame="cab")},
}


@pytest.mark.parametrize("rate", [100, 300])
def test_a_washout(rate):
    bench = Bench(ClassicalWashout(), rate=rate)
    sent = bench.drive(TRACE)
    assert_same_motion(bench, sent, rollout(ClassicalWashout(), TRACE))
    assert {setpoint.state for setpoint in bench.setpoints} == {State.RUNNING}


@pytest.mark.parametrize("options", TASKS.values(), ids=TASKS)
def test_a_policy_of_an_environment(options):
    policy = Feedback(TaskOptions(**options))
    bench = Bench(policy)
    assert_same_motion(bench, bench.drive(TRACE), rollout(policy, TRACE))


def known_drive():
    """Two seconds of a random drive in a bend, with its controls and its road."""
    return random_drives(1, 12.0, 5, "urban")[0]


def test_a_policy_that_sees_controls_and_road():
    seen = ObservationOptions(controls=True, road=ROAD_TIMES[2:6])
    policy, drive = Feedback(TaskOptions(observation=seen)), known_drive()
    bench = Bench(policy)
    sent, expected = bench.drive(drive), rollout(policy, drive)
    assert not bench.controller.faults
    # Rows sample by sample differ from those of the whole drive by rounding.
    np.testing.assert_allclose(sent[:-1, :9], axes_of(expected)[1:], atol=1e-4)


def untrained(path):
    """A predictor with weights by chance, in a file."""
    rng, options = np.random.default_rng(1), PredictorOptions()
    size, outputs = inputs_of(known_drive(), options).shape[1], 12 * len(options.leads)
    arrays = [rng.normal(size=shape).astype(np.float32) for shape in ((16, size), (outputs, 16))]
    weights = tuple(a / a.shape[1] ** 0.5 for a in arrays)
    biases = np.zeros(16, np.float32), np.zeros(outputs, np.float32)
    ones = np.zeros(size, np.float32), np.ones(size, np.float32)
    Predictor(options, *ones, weights, biases, {}).save(path)
    return str(path)


@pytest.mark.parametrize("preview", ["held", "predicted"])
def test_expected_cues_in_place_of_a_preview(preview, tmp_path):
    predictor = untrained(tmp_path / "any.safetensors")
    seen = ObservationOptions(preview=3, preview_spacing=0.2, controls=True)
    policy, drive = Feedback(TaskOptions(observation=seen)), known_drive()
    bench = Bench(policy, preview=preview, predictor=predictor)
    assert bench.machine.ahead_steps == 0
    sent, expected = bench.drive(drive), rollout(policy, with_preview(drive, preview, predictor))
    assert not bench.controller.faults
    np.testing.assert_allclose(sent[:-1, :9], axes_of(expected)[1:], atol=1e-3)
    true = axes_of(rollout(policy, drive))
    assert np.abs(true - axes_of(expected)).max() > 0.01


def test_packets_without_what_the_policy_sees_brake_the_machine():
    bench = Bench(Feedback(TaskOptions(observation=ObservationOptions(controls=True))))
    bench.drive(TRACE)
    assert bench.controller.faults == ["the policy sees the car's speed, which the packets do not have"]
    assert bench.controller.state is State.BRAKING or bench.controller.state is State.NEUTRAL


@pytest.mark.parametrize("repeat", [1, 3])
@pytest.mark.parametrize(
    ("mode", "base", "size"), [("residual", ClassicalWashout, 9), ("gains", ScheduledWashout, 7)]
)
def test_a_policy_on_a_washout(mode, base, size, repeat):
    size = len(ScheduledWashout().gain_names) if mode == "gains" else size
    policy = Feedback(TaskOptions(action=ActionOptions(mode=mode, repeat=repeat)), base(), size)
    bench = Bench(policy)
    assert_same_motion(bench, bench.drive(TRACE), rollout(policy, TRACE))


@pytest.mark.parametrize("against", [False, True])
@pytest.mark.parametrize("base", ["linear-washout", "classical"])
def test_a_policy_of_the_cueing_task(base, against):
    seen, reward = {"against_base": against}, {"against_base": False}
    task = load_task("cueing", action={"base": base}, observation=seen, reward=reward)
    policy = Feedback(task, make_policy(base, PAPER), size=4)
    bench = Bench(policy)
    assert_same_motion(bench, bench.drive(TRACE), rollout(policy, TRACE))


def test_a_policy_with_preview_sees_the_newest_cues_that_far_ahead():
    policy = Feedback(TaskOptions(observation=ObservationOptions(preview=3, preview_spacing=0.2)))
    bench = Bench(policy)
    assert bench.machine.ahead_steps == 60
    sent = bench.drive(TRACE)
    # What is felt now is what came 0.6 s ago; before the first packet the car stood.
    force = np.vstack([np.tile([0.0, 0.0, -9.81], (60, 1)), TRACE.specific_force])
    rate = np.vstack([np.zeros((60, 3)), TRACE.angular_velocity])
    later = CueTrace("later", 0.01 * np.arange(len(force)), force, rate)
    assert_same_motion(bench, sent, rollout(policy, later))


def test_a_machine_that_lags():
    lagging = replace(
        PAPER, carriage=replace(PAPER.carriage, dynamics=PAPER.carriage.dynamics.__class__(20.0, 1.0, 0.03))
    )
    bench = Bench(ClassicalWashout(), platform=lagging)
    expected = rollout(ClassicalWashout(), TRACE, lagging)
    # Set-points are sent; the machine follows them.
    np.testing.assert_array_equal(bench.drive(TRACE)[:-1, 2:8], expected.hexapod[1:])
    assert np.abs(bench.setpoints[-2].motion[:2] - expected.carriage[-1]).max() > 1e-3
    logged = bench.trajectory(lagging)
    np.testing.assert_allclose(logged.carriage, expected.carriage, atol=1e-12)


LATE = PAPER.with_dynamics(
    {
        "carriage": ActuatorDynamics(natural_frequency=25.0, dead_time=0.02),
        "hexapod": ActuatorDynamics(natural_frequency=70.0, dead_time=0.03),
    }
)


def assert_same_late_motion(bench: Bench, expected) -> None:
    """The log tells the drive of a rollout, on the machine as it is."""
    assert not bench.controller.faults
    logged = bench.trajectory(LATE)
    for name in ("carriage", "hexapod", "turntable", "f_simulator"):
        last = len(logged.time) - bench.machine.ahead_steps - 1
        np.testing.assert_allclose(getattr(logged, name)[:last], getattr(expected, name)[:last], atol=1e-9)
    assert np.abs(expected.hexapod).max() > 0.005


@pytest.mark.parametrize("name", ["classical", "learned", "residual"])
def test_a_compensated_policy_on_a_late_machine(name):
    if name == "residual":
        task = TaskOptions(action=ActionOptions(mode="residual", repeat=3))
        policy = Compensated(Feedback(task, ClassicalWashout(), 9)).on(LATE)
    else:
        policy = make_policy(name, LATE.with_dynamics(ActuatorDynamics()))
        policy = Compensated(policy).for_platform(LATE)
    bench = Bench(policy, platform=LATE)
    bench.drive(TRACE)
    assert_same_late_motion(bench, rollout(policy, TRACE, LATE))


def test_a_compensated_policy_goes_on_after_it_braked():
    """The ideal machine begins again where the late one's set-points are."""
    policy = Compensated(make_policy("learned", PAPER)).for_platform(LATE)
    bench = Bench(policy, platform=LATE)
    bench.drive(TRACE)
    bench.settle(cues=False)
    first = bench.drive(TRACE)
    assert not bench.controller.faults
    assert np.abs(np.diff(first[:, :9], axis=0)).max() < 0.05
    assert {State.BRAKING, State.RUNNING} <= {setpoint.state for setpoint in bench.setpoints}


def test_a_compensated_preview_reaches_further():
    policy = Feedback(TaskOptions(observation=ObservationOptions(preview=3, preview_spacing=0.2)))
    compensated = Compensated(policy).on(LATE)
    bench = Bench(compensated, platform=LATE)
    ahead = bench.machine.ahead_steps
    # 0.6 s, and 20 ms and 2 / 45 of the carriage behind its lead.
    assert ahead == 60 + round(100 * (0.02 + 2.0 / 45.0))
    bench.drive(TRACE)
    force = np.vstack([np.tile([0.0, 0.0, -9.81], (ahead, 1)), TRACE.specific_force])
    rate = np.vstack([np.zeros((ahead, 3)), TRACE.angular_velocity])
    later = CueTrace("later", 0.01 * np.arange(len(force)), force, rate)
    assert_same_late_motion(bench, rollout(compensated, later, LATE))


def test_the_shipped_agents_and_cues_over_the_network():
    policy = make_policy("learned-preview", PAPER)
    bench, expected = Bench(policy), Bench(policy).drive(TRACE)
    here, there = Endpoint(("127.0.0.1", 0)), Endpoint(("127.0.0.1", 0))
    received: list[bytes] = []
    inbox = bench.controller.inbox
    for k, (force, rate) in enumerate(zip(TRACE.specific_force, TRACE.angular_velocity, strict=True)):
        there.send(FLOATS.pack_cues(Cues(k, bench.now, tuple(force), tuple(rate))), here.address)
        here.listen(0, lambda data, sender, _: inbox.take(data, sender, bench.now))
        here.send(FLOATS.pack_setpoint(bench.step()), inbox.sender)
        there.listen(0, lambda data, sender, _: received.append(data))
    assert inbox.counts["used"] == len(received) == len(TRACE)
    np.testing.assert_array_equal([FLOATS.unpack_setpoint(data).motion for data in received], expected)
    here.close()
    there.close()


def test_policies_that_cannot_be_served_are_refused():
    class Foreknowing:
        name = "seer"

        def for_drive(self, cues):
            return ClassicalWashout()

    class Broken:
        name = "broken"

        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            raise RuntimeError("no")

    for policy, told in [
        (Foreknowing(), "seer must know the drive"),
        (Broken(), "broken fails with a car that stands: broken raised RuntimeError: no at step 1"),
        (ClassicalWashout(dt=0.02), "time step"),
        (Feedback(TaskOptions(platform="nads-1")), "made for the motion base"),
    ]:
        with pytest.raises(ConfigurationError, match=told):
            make_machine(policy, PAPER)


DT = 0.01
VECTORS = st.lists(st.floats(-2.0, 2.0), min_size=15, max_size=15).map(np.array)


@given(position=VECTORS, rate=VECTORS, acceleration=VECTORS, periods=st.integers(1, 20))
def test_constant_acceleration_is_met_exactly(position, rate, acceleration, periods):
    end = np.array([position + DT * rate + 0.5 * DT**2 * acceleration, rate + DT * acceleration])
    rows = Track(periods, DT).between(np.array([position, rate]), end)
    time = DT * np.arange(1, periods + 1)[:, None] / periods
    expected = position + rate * time + 0.5 * acceleration * time**2
    moved = rate + acceleration * time
    np.testing.assert_allclose(rows[:, MOTION["position"]], expected[:, :9], atol=1e-14)
    np.testing.assert_allclose(rows[:, MOTION["legs"]], expected[:, 9:], atol=1e-14)
    np.testing.assert_allclose(rows[:, MOTION["velocity"]], moved[:, :9], atol=1e-14)
    np.testing.assert_allclose(rows[:, MOTION["leg_rates"]], moved[:, 9:], atol=1e-14)
    np.testing.assert_allclose(
        rows[:, MOTION["acceleration"]], np.tile(acceleration[:9], (periods, 1)), atol=1e-11
    )
    np.testing.assert_array_equal(rows[-1, MOTION["position"]], end[0, :9])


@settings(max_examples=25)
@given(begin=VECTORS, end=VECTORS, rates=st.tuples(VECTORS, VECTORS))
def test_position_is_the_cubic_with_the_right_ends_and_slopes(begin, end, rates):
    rows = Track(4, DT).between(np.array([begin, rates[0]]), np.array([end, rates[1]]))
    for k in range(15):
        part = MOTION["position"] if k < 9 else MOTION["legs"]
        # The cubic through both ends with both slopes, by solving for its coefficients.
        powers = np.array([[1, 0, 0, 0], [1, DT, DT**2, DT**3], [0, 1, 0, 0], [0, 1, 2 * DT, 3 * DT**2]])
        coefficients = np.linalg.solve(powers, [begin[k], end[k], rates[0][k], rates[1][k]])
        time = DT * np.arange(1, 5) / 4
        found = rows[:, part][:, k if k < 9 else k - 9]
        np.testing.assert_allclose(found, np.polyval(coefficients[::-1], time), atol=1e-9)


def test_legs_between_steps_hold_the_platform_where_it_is_said_to_be():
    class Swaying:
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            t = 0.01 * (state or 0)
            return np.sin(t * np.arange(3.0, 12.0))[None] * [0, 0, 2, 2, 1, 1.5, 1.5, 1, 0], (state or 0) + 1

    bench = Bench(Swaying(), rate=1000)
    bench.stand(2.0)
    motion = np.array([setpoint.motion for setpoint in bench.setpoints])
    assert np.abs(motion[:, MOTION["leg_rates"]]).max() > 0.3
    legs = legs_of_pose(PAPER.hexapod, motion[:, 2:8])
    np.testing.assert_allclose(motion[:, MOTION["legs"]], legs, atol=2e-8)
