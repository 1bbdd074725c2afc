"""Lag and dead time: the true machine against its differential equation and its earlier set-point."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from motion_cueing.envs.platform import legs_of_pose
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.envs.platform.parameters import lag_transition

from ...reference.actuators import lag
from ...reference.comparison import bits
from .platforms_under_test import DT, PRESETS, with_dynamics
from .storms import simulator

N_STEPS = 120


def drive(platform, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Set-points and true motion (steps + 1, ...) of a machine under smooth random commands."""
    batch = simulator(platform, 1)
    state = batch.reset()
    rng = np.random.default_rng(seed)
    action = np.zeros((1, 9))
    rows = [state[0].copy()]
    for _ in range(N_STEPS):
        action = 0.9 * action + 0.2 * rng.normal(size=(1, 9))
        rows.append(batch.step(action)[0].copy())
    record = np.array(rows)
    return record["setpoint"], record["motion"]


@pytest.mark.parametrize("damping", [1.0, 1.7])
def test_a_lagging_carriage_solves_its_differential_equation(damping):
    omega = 8.0
    dynamics = ActuatorDynamics(natural_frequency=omega, damping=damping)
    setpoint, motion = drive(with_dynamics(PRESETS["paper"], carriage=dynamics))
    q, v = setpoint["position"][:, 0], setpoint["rate"][:, 0]

    def equation(t: float, y: np.ndarray, k: int) -> list[float]:
        since = t - k * DT
        u = q[k] + v[k] * since + 0.5 * (v[k + 1] - v[k]) / DT * since**2
        return [y[1], omega**2 * (u - y[0]) - 2.0 * damping * omega * y[1]]

    y = np.zeros(2)
    for k in range(N_STEPS):
        span = (k * DT, (k + 1) * DT)
        y = solve_ivp(equation, span, y, args=(k,), method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        found = motion["position"][k + 1, 0], motion["rate"][k + 1, 0]
        np.testing.assert_allclose(found, y, atol=1e-9)


@settings(max_examples=100)
@given(
    omega=st.floats(0.5, 200.0),
    damping=st.one_of(st.just(1.0), st.floats(1.01, 5.0)),
    state=st.tuples(*[st.floats(-2.0, 2.0)] * 5),
)
def test_the_transition_is_the_closed_form(omega, damping, state):
    y, y_rate, u, u_rate, u_next = state
    dynamics = ActuatorDynamics(natural_frequency=omega, damping=damping)
    found = lag_transition(dynamics, DT) @ [y, y_rate, u, u_rate, (u_next - u_rate) / DT]
    expected = lag(dynamics, *(np.array(x) for x in state), DT)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(
    ("subsystem", "actuators", "steps"),
    [("carriage", slice(0, 2), 5), ("hexapod", slice(2, 8), 3), ("turntable", slice(8, 9), 1)],
)
def test_dead_time_is_exact(subsystem, actuators, steps):
    dynamics = ActuatorDynamics(dead_time=steps * DT)
    setpoint, motion = drive(with_dynamics(PRESETS["paper"], **{subsystem: dynamics}))
    for field in ("position", "rate"):
        late, asked = motion[field][:, actuators], setpoint[field][:, actuators]
        np.testing.assert_array_equal(late[steps:], asked[:-steps])
        np.testing.assert_array_equal(late[:steps], np.broadcast_to(asked[0], late[:steps].shape))
        others = np.delete(np.arange(9), actuators)
        np.testing.assert_array_equal(motion[field][:, others], setpoint[field][:, others])


def test_dead_time_is_rounded_to_whole_steps():
    setpoint, motion = drive(with_dynamics(PRESETS["paper"], carriage=ActuatorDynamics(dead_time=0.0249)))
    np.testing.assert_array_equal(motion["position"][2:, 0], setpoint["position"][:-2, 0])


def test_without_dynamics_the_machine_is_its_setpoint():
    setpoint, motion = drive(PRESETS["paper"])
    assert bits(motion) == bits(setpoint)


def test_lagging_legs_hold_the_platform_where_forward_kinematics_says():
    dynamics = ActuatorDynamics(natural_frequency=12.0, dead_time=0.02)
    platform = with_dynamics(PRESETS["dim-hexapod"], hexapod=dynamics)
    _, motion = drive(platform)
    pose = np.concatenate([motion["displacement"], motion["beta"]], axis=1)
    np.testing.assert_allclose(legs_of_pose(platform.hexapod, pose), motion["position"][:, 2:8], atol=1e-12)
    # The pose's own differences are its rates, to the order of the step.
    middle = 0.5 * (motion["velocity"][1:] + motion["velocity"][:-1])
    np.testing.assert_allclose(np.diff(motion["displacement"], axis=0) / DT, middle, atol=1e-4)


def test_a_lag_settles_without_overshoot():
    platform = with_dynamics(PRESETS["paper"], carriage=ActuatorDynamics(natural_frequency=10.0))
    batch = simulator(platform, 1)
    batch.reset()
    path = []
    for k in range(600):
        state = batch.step(np.eye(9)[[0]] * (1.0 if k < 50 else -1.0 if k < 100 else 0.0))
        path.append(state["motion"]["position"][0, 0])
    assert path[-1] == pytest.approx(batch.state["setpoint"]["position"][0, 0], abs=1e-9)
    assert np.diff(path).min() > -1e-12
