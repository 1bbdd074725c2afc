"""Batches for tuning: many parameter sets through many drives at once, and the gradient of J."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ...envs.arrays import real, vec9
from ...envs.cues import CueTrace
from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ...envs.platform.kernels.step import SetPoint
from ...envs.simulator.kernels.step import CueCost, State, add_cue_error, step_with_adjoint, zone
from ...envs.simulator.simulator import Simulator
from .families import FamilyParameters, family_of
from .kernels.launch import Score
from .policy import start_pose

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scores:
    """Means over drives, each (sets, drives).

    Args:
        cue_error: J.
        perceived_error: Perceived J.
        at_limit: Share of the steps in which a limit is met.
    """

    cue_error: Floats
    perceived_error: Floats
    at_limit: Floats


class WashoutBatch:
    """Every parameter set on every drive: one environment for each pair.

    Args:
        sets: Parameter sets of one family.
        drives: Cue traces of the same time step.
        platform: The machine, without lag or dead time.

    Raises:
        ConfigurationError: the machine has a lag or a dead time, which one fused launch does not simulate.
    """

    def __init__(
        self, sets: Sequence[FamilyParameters], drives: Sequence[CueTrace], platform: Platform
    ) -> None:
        if not sets or not drives:
            raise ConfigurationError("a washout batch needs at least one parameter set and one drive")
        self.shape = len(sets), len(drives)
        drive_of = np.tile(np.arange(len(drives)), len(sets))
        self.simulator = Simulator(platform, drives, drive_of=drive_of, dt=drives[0].dt)
        if self.simulator.machines.numpy()[0]["has_dynamics"]:
            raise ConfigurationError(
                "actuator dynamics must be unity in a washout batch; use rollout instead"
            )
        self.family = family_of(sets[0])
        self.kernels = kernels = self.family.kernels
        values = [kernels.values(p, platform.cab, self.simulator.dt) for p in sets]
        self.parameters = wp.array(values, dtype=kernels.parameters, requires_grad=kernels.act is not None)
        self.parameters_of = wp.array(np.repeat(np.arange(len(sets)), len(drives)), dtype=int)
        self.simulator.reset(np.repeat([start_pose(p) for p in sets], len(drives), axis=0))

    def scores(self, cost: CueCost | None = None, threads: int = 1) -> Scores:
        """Drive all sets through all drives.

        Args:
            cost: Indifference zones of J.
            threads: Launches side by side; a launch on the CPU uses one core and lets others run.
        """
        if threads < 1:
            raise ConfigurationError(f"threads must be at least 1, found {threads}")
        simulator, n = self.simulator, self.simulator.n
        score = wp.zeros(n, dtype=Score)
        bounds = np.linspace(0, n, min(threads, n) + 1).astype(int)

        def launch(part: int) -> None:
            first, last = int(bounds[part]), int(bounds[part + 1])
            inputs = [*simulator.constants, simulator.delay_array, self.parameters, self.parameters_of]
            inputs += [zone(cost or CueCost()), simulator.state_array, first]
            wp.launch(self.kernels.drive_through, last - first, inputs=inputs, outputs=[score], device="cpu")

        self.kernels.drive_through.module.load(simulator.device)
        with ThreadPoolExecutor(len(bounds) - 1) as pool:
            list(pool.map(launch, range(len(bounds) - 1)))
        values = score.numpy()
        return Scores(
            **{name: values[name].reshape(self.shape).astype(np.float64) for name in values.dtype.names}
        )

    def gradient(self, steps: int, cost: CueCost | None = None) -> tuple[Floats, NDArray[Any]]:
        """Mean J of each set over the first steps of all drives, and its gradient in every parameter.

        Returns:
            (sets,) costs and (sets,) structured gradients with the fields of the kernel's ``Parameters``.

        Raises:
            ConfigurationError: there is not one step, or the algorithm has no gradient.
        """
        if self.kernels.act is None:
            raise ConfigurationError(f"{self.family.title} has no gradient; use method cma")
        if steps < 1:
            raise ConfigurationError(f"steps must be at least 1, found {steps}")
        n, keep = self.simulator.n, {"requires_grad": True}
        states = [wp.zeros(n, dtype=State, **keep) for _ in range(steps + 1)]
        memories = [wp.zeros(n, dtype=self.kernels.memory, **keep) for _ in range(steps + 1)]
        actions = [wp.zeros(n, dtype=vec9, **keep) for _ in range(steps)]
        costs = wp.zeros(n, dtype=real, **keep)
        wp.copy(states[0], self.simulator.state_array)
        with wp.Tape() as tape:
            self._unroll(states, memories, actions, costs, zone(cost or CueCost()))
        tape.backward(grads={costs: wp.full(n, 1.0 / self.shape[1], dtype=real)})
        gradient = self.parameters.grad.numpy().copy()
        tape.zero()
        return costs.numpy().reshape(self.shape).mean(axis=1), gradient

    def _unroll(self, states: list[Any], memories: list[Any], actions: list[Any], costs: Any, z: Any) -> None:
        simulator = self.simulator
        delay = wp.zeros((simulator.n, 1), dtype=SetPoint)
        for k in range(len(actions)):
            wp.launch(
                self.kernels.act,
                simulator.n,
                inputs=[
                    self.parameters,
                    self.parameters_of,
                    states[k],
                    memories[k],
                    int(k == 0),
                    simulator.dt,
                ],
                outputs=[memories[k + 1], actions[k]],
            )
            wp.launch(
                step_with_adjoint,
                simulator.n,
                inputs=[*simulator.constants, states[k], delay, actions[k]],
                outputs=[states[k + 1], delay],
            )
            weight = real(1.0 / len(actions))
            wp.launch(add_cue_error, simulator.n, inputs=[z, states[k + 1], weight], outputs=[costs])
