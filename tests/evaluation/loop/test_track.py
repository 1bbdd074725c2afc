"""Set-points within a step: where constant acceleration leads, or as near as two states tell."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.platform.kinematics import legs_of_pose
from motion_cueing.realtime.machine import Track
from motion_cueing.realtime.packets import MOTION

from .loops import PAPER, Bench

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
    bench.calm(2.0)
    motion = np.array([setpoint.motion for setpoint in bench.made])
    assert np.abs(motion[:, MOTION["leg_rates"]]).max() > 0.3
    legs = legs_of_pose(PAPER.hexapod, motion[:, 2:8])
    np.testing.assert_allclose(motion[:, MOTION["legs"]], legs, atol=2e-8)
