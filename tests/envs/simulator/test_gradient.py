"""Gradients of the cue cost through the machine, against central finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs import CueTrace
from motion_cueing.envs.errors import ActionError
from motion_cueing.envs.platform import Platform, get_platform
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.envs.simulator.kernels.gradient import Unroll
from motion_cueing.envs.simulator.simulator import Simulator

STEPS, BATCH = 200, 2


def drive() -> CueTrace:
    t = np.arange(400) * 0.01
    force = np.column_stack([np.sin(t), np.cos(t) - 1.0, np.full_like(t, -9.81)])
    return CueTrace("weave", t, force, np.column_stack([0.05 * np.sin(t), 0.05 * np.sin(t), 0.3 * np.sin(t)]))


def lagging() -> Platform:
    paper = get_platform("paper")
    assert paper.carriage is not None
    assert paper.turntable is not None
    return replace(
        paper,
        hexapod=replace(paper.hexapod, dynamics=ActuatorDynamics(30.0, 1.0, 0.03)),
        carriage=replace(paper.carriage, dynamics=ActuatorDynamics(20.0, 1.2, 0.02)),
        turntable=replace(paper.turntable, dynamics=ActuatorDynamics(None, 1.0, 0.01)),
    )


def unroll(platform: Platform) -> Unroll:
    simulator = Simulator(platform, drive(), drive_of=np.zeros(BATCH, dtype=int))
    simulator.reset()
    return Unroll(simulator, STEPS)


@pytest.mark.parametrize(
    "platform", [get_platform("paper"), get_platform("nads-1"), lagging()], ids=["paper", "nads-1", "lag"]
)
def test_gradients_through_200_steps(platform):
    """To 1e-5 relative, every axis, early and late actions, where no limit is active."""
    unrolled = unroll(platform)
    actions = np.random.default_rng(0).normal(size=(STEPS, BATCH, 9)) * 0.3
    _, gradient = unrolled.gradient(actions)
    assert all(not state.numpy()["limits"].any() for state in unrolled.states)
    h = 1e-4
    for step in (0, 9, 60, 150, 190):
        for axis in range(9):
            sides = []
            for sign in (1.0, -1.0):
                moved = actions.copy()
                moved[step, :, axis] += sign * h
                sides.append(unrolled.value(moved))
            expected = (sides[0] - sides[1]) / (2.0 * h)
            # A floor for what rounding leaves of a difference of costs of about 30.
            np.testing.assert_allclose(gradient[step, :, axis], expected, rtol=1e-5, atol=1e-8)


def test_value_and_gradient_agree_on_the_cost_and_leave_the_simulator_alone():
    unrolled = unroll(get_platform("paper"))
    before = unrolled.simulator.state.copy()
    actions = np.full((STEPS, BATCH, 9), 0.1)
    cost, _ = unrolled.gradient(actions)
    np.testing.assert_array_equal(unrolled.value(actions), cost)
    np.testing.assert_array_equal(unrolled.simulator.state, before)


def test_the_cost_is_that_of_the_simulator():
    unrolled = unroll(get_platform("paper"))
    simulator, total = unrolled.simulator, np.zeros(BATCH)
    actions = np.random.default_rng(1).normal(size=(STEPS, BATCH, 9)) * 0.3
    expected = unrolled.value(actions)
    for action in actions:
        state = simulator.step(action)
        df = state["simulator_cue"]["force"] - state["reference_cue"]["force"]
        dw = state["simulator_cue"]["rate"] - state["reference_cue"]["rate"]
        total += (df**2).sum(axis=1) / 0.6**2 + (dw**2).sum(axis=1) / np.radians(3.0) ** 2
    np.testing.assert_allclose(total / STEPS, expected, rtol=1e-12)


def test_bad_actions_are_refused():
    unrolled = unroll(get_platform("paper"))
    with pytest.raises(ActionError, match="shape"):
        unrolled.value(np.zeros((3, 9)))
    with pytest.raises(ActionError, match="finite"):
        unrolled.value(np.full((STEPS, BATCH, 9), np.nan))
