"""Gradients of the cue cost through the machine, against central finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import ArrayLike, NDArray

from motion_cueing.envs import CueTrace
from motion_cueing.envs.arrays import FLOAT, real, vec9
from motion_cueing.envs.platform import Braking, Platform, get_platform
from motion_cueing.envs.platform.kernels import ActuatorDynamics
from motion_cueing.envs.platform.kernels.step import SetPoint
from motion_cueing.envs.simulator.kernels.step import CueCost, State, add_cue_error, step_with_adjoint, zone
from motion_cueing.envs.simulator.simulator import Simulator

STEPS, BATCH = 200, 2


class Unroll:
    """A simulator's drive over a number of steps, differentiable in its actions.

    The drive begins at the state the simulator has when :meth:`gradient` is called, and leaves it there.

    Args:
        simulator: The batch; its actuator set-point history is taken along.
        steps: Length of the unrolled drive.
        cost: What is averaged over the steps, for each environment.
    """

    def __init__(self, simulator: Simulator, steps: int, cost: CueCost | None = None) -> None:
        self.simulator, self.steps, self._zone = simulator, steps, zone(cost or CueCost())
        n, device = simulator.n, simulator.device
        keep: dict[str, Any] = {"device": device, "requires_grad": True}
        self.states = [wp.zeros(n, dtype=State, **keep) for _ in range(steps + 1)]
        shape = simulator.delay_array.shape
        self.delays = [wp.zeros(shape, dtype=SetPoint, **keep) for _ in range(steps + 1)]
        self.actions = [wp.zeros(n, dtype=vec9, **keep) for _ in range(steps)]
        self.costs = wp.zeros(n, dtype=real, **keep)

    def value(self, actions: ArrayLike) -> NDArray[np.float64]:
        """(n,) mean cost over the steps with ``actions`` (steps, n, 9)."""
        self._load(actions)
        self._run()
        return np.array(self.costs.numpy(), dtype=np.float64)

    def gradient(self, actions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n,) mean costs, and their gradient (steps, n, 9) with respect to ``actions`` (steps, n, 9)."""
        self._load(actions)
        with wp.Tape() as tape:
            self._run()
        one = wp.full(self.simulator.n, 1.0, dtype=real, device=self.simulator.device)
        tape.backward(grads={self.costs: one})
        gradient = np.stack([action.grad.numpy() for action in self.actions])
        tape.zero()
        return np.array(self.costs.numpy(), dtype=np.float64), np.asarray(gradient, dtype=np.float64)

    def _load(self, actions: ArrayLike) -> None:
        for array, value in zip(self.actions, np.asarray(actions, dtype=FLOAT), strict=True):
            array.assign(value)
        wp.copy(self.states[0], self.simulator.state_array)
        wp.copy(self.delays[0], self.simulator.delay_array)
        self.costs.zero_()

    def _run(self) -> None:
        simulator = self.simulator
        constants = simulator.constants
        for k in range(self.steps):
            wp.launch(
                step_with_adjoint,
                simulator.n,
                inputs=[*constants, self.states[k], self.delays[k], self.actions[k]],
                outputs=[self.states[k + 1], self.delays[k + 1]],
                device=simulator.device,
            )
            wp.launch(
                add_cue_error,
                simulator.n,
                inputs=[self._zone, self.states[k + 1], real(1.0 / self.steps)],
                outputs=[self.costs],
                device=simulator.device,
            )


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


@pytest.mark.slow
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


@pytest.mark.slow
def test_gradients_through_limits_that_brake_with_bounded_jerk():
    simulator = Simulator(
        replace(get_platform("paper"), braking=Braking(150.0)), drive(), drive_of=np.zeros(BATCH, dtype=int)
    )
    simulator.reset()
    for _ in range(80):
        simulator.step(np.tile([0.0, 0, 2, 0, 0, 0, 0, 0, 0], (BATCH, 1)))
    unrolled = Unroll(simulator, 40)
    actions = np.tile([0.1, 0.0, 1.5, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0], (40, BATCH, 1))
    _, gradient = unrolled.gradient(actions)
    # The legs brake for their speed limits, then for their ends.
    assert unrolled.states[0].numpy()["limits"][0] == 0
    assert unrolled.states[-1].numpy()["limits"][0] != 0
    h = 1e-5
    for step in (2, 10, 25, 38):
        for axis in (0, 2, 6):
            sides = []
            for sign in (1.0, -1.0):
                moved = actions.copy()
                moved[step, :, axis] += sign * h
                sides.append(unrolled.value(moved))
            np.testing.assert_allclose(
                gradient[step, :, axis], (sides[0] - sides[1]) / (2.0 * h), rtol=1e-5, atol=1e-7
            )


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
