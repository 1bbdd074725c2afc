"""The machine about a plan, against finite differences of the kernels."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.baselines.mpc import Margins
from motion_cueing.baselines.mpc.prediction import N_CUES, MachineModel, cue_scales
from motion_cueing.baselines.mpc.solver import moving_axes
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.simulator.simulator import TIME_STEP, Simulator

from .machines import PAPER

PUSH = 0.3
STILL = CueTrace("still", np.arange(100) * 0.01, np.tile([0.0, 0.0, -9.81], (100, 1)), np.zeros((100, 3)))


def row_of(simulator: Simulator, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, rate and acceleration (9,) of one environment."""
    state = simulator.state[i]
    motion = state["motion"]
    place, rate = motion["position"], motion["rate"]
    q = np.concatenate([place[:2], motion["displacement"], motion["beta"], place[8:]])
    v = np.concatenate([rate[:2], motion["velocity"], motion["beta_rate"], rate[8:]])
    return q, v, np.array(state["acceleration"])


def moved(actions: np.ndarray, last: np.ndarray) -> Simulator:
    """A batch after the same actions (k, 9), but each with its own last one (n, 9)."""
    simulator = Simulator(PAPER, STILL, drive_of=np.zeros(len(last), dtype=np.int32))
    simulator.reset(np.array([1.0, -2.0, 0.05, 0.1, -0.05, 0.05, -0.08, 0.1, 0.7]))
    for action in actions:
        simulator.step(np.tile(action, (len(last), 1)))
    simulator.step(last)
    return simulator


def felt(simulator: Simulator) -> np.ndarray:
    """(n, 6) cues at the cab."""
    state = simulator.state
    return np.hstack([state["simulator_cue"]["force"], state["simulator_cue"]["rate"]])


def test_slopes_are_differences_of_the_kernel():
    rng = np.random.default_rng(4)
    actions = rng.normal(size=(20, 9))
    base = np.tile(actions[-1], (19, 1))
    base[1:10] += PUSH * np.eye(9)
    base[10:] -= PUSH * np.eye(9)
    simulator = moved(actions[:-1], base)
    q, v, a = row_of(simulator, 0)
    linear = MachineModel(PAPER, 1, Margins(), compile=False)(q[None], v[None], a[None])
    cues = felt(simulator) / cue_scales()
    assert np.abs(linear.values[0, :N_CUES] - cues[0]).max() < 1e-9
    measured = (cues[1:10] - cues[10:]) / (2.0 * PUSH)  # (9, 6)
    by_q, by_v, by_a = (linear.slopes[0, :N_CUES, 9 * i : 9 * i + 9] for i in range(3))
    predicted = 0.5 * TIME_STEP**2 * by_q + TIME_STEP * by_v + by_a
    assert np.abs(predicted.T - measured).max() < 1e-6 * np.abs(measured).max()


def test_limit_rows_are_shares_of_the_actuators_limits():
    rng = np.random.default_rng(5)
    simulator = moved(rng.normal(size=(30, 9)), rng.normal(size=(1, 9)))
    q, v, a = row_of(simulator, 0)
    margins = Margins(position=1.0, rate=1.0, acceleration=1.0, braking=1.0)
    linearized = MachineModel(PAPER, 1, margins, compile=False)
    rows = linearized(q[None], v[None], a[None]).values[0, N_CUES:]
    motion, limits = simulator.state[0]["motion"], simulator.machines.numpy()[0]
    place, rate = motion["position"], motion["rate"]
    stop = place + rate * np.abs(rate) / (2.0 * limits["acceleration"])
    assert np.abs(rows[:8] - (stop / limits["position_max"])[:8]).max() < 1e-9
    assert np.abs(rows[8:17] - rate / limits["velocity"]).max() < 1e-9
    assert np.all(linearized.upper == 1.0)
    assert np.all(linearized.lower == -1.0)


def test_slopes_are_differences_of_the_rows():
    rng = np.random.default_rng(6)
    linearized = MachineModel(PAPER, 1, Margins(), compile=False)
    x = 0.1 * rng.normal(size=27)
    slopes = linearized(*x.reshape(3, 1, 9)).slopes[0].copy()
    h = 1e-6
    for i in range(27):
        ends = [
            linearized(*(x + sign * h * np.eye(27)[i]).reshape(3, 1, 9)).values[0].copy()
            for sign in (1.0, -1.0)
        ]
        assert np.abs((ends[0] - ends[1]) / (2.0 * h) - slopes[:, i]).max() < 1e-5


@pytest.mark.parametrize(
    ("name", "axes", "rows"),
    [("paper", 9, 26), ("dim-hexapod", 6, 18), ("24-inch", 7, 21)],
)
def test_a_missing_subsystem_has_no_rows_and_does_not_move(name, axes, rows):
    platform = get_platform(name)
    assert len(moving_axes(platform)) == axes
    assert len(MachineModel(platform, 1, Margins(), compile=False).upper) == rows
