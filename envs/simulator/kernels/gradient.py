"""Gradients of a cue cost through many steps, by Warp's tape.

The adjoint is compiled as a module of its own, when it is first asked for (about a minute, once a machine).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ...arrays import FLOAT, real, vec9
from ...errors import ActionError
from ...platform.kernels.step import SetPoint
from ..simulator import N_AXES, Simulator
from .step import CueCost, State, Zone, cue_error, step_kernel, zone

step_with_adjoint = wp.kernel(step_kernel, enable_backward=True, module="unique")
"""The step of :mod:`.step` with its adjoint."""


@wp.kernel(enable_backward=True, module="unique")
def add_cue_error(z: Zone, state: wp.array(dtype=State), share: real, cost: wp.array(dtype=real)) -> None:
    """Add a share of the cost of this moment, for every environment."""
    i = wp.tid()
    wp.atomic_add(cost, i, share * cue_error(z, state[i]))


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
        values = np.asarray(actions, dtype=FLOAT)
        shape = (self.steps, self.simulator.n, N_AXES)
        if values.shape != shape or not np.isfinite(values).all():
            raise ActionError(f"actions must be finite and of shape {shape}, found shape {values.shape}")
        for array, value in zip(self.actions, values, strict=True):
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
