"""A batch of episodes over many actions, differentiable: for training by the machine's own gradients."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..errors import ConfigurationError
from ..observation import OBSERVATION_SIZE
from ..platform.state import SetPoint
from ..precision import real, vec9
from ..state import State
from .batch import Batch
from .reward_kernel import vec_terms
from .unroll_kernels import look_with_adjoint, play_with_adjoint

_MODES: Final = ("acceleration", "jerk", "velocity")


class TaskUnroll:
    """What a batch would do over a number of actions, kept so that gradients can be led back through it.

    Forward: :meth:`begin`, then for each action k = 0, 1, ...: :meth:`observe`, :meth:`act`. Backward, after
    :meth:`weigh`, for k from the last to the first: :meth:`back_through_act`, which tells the gradient with
    respect to action k, and :meth:`back_through_observe` with that of what was seen.

    Args:
        batch: Where episodes are drawn; its own state stays where it is.
        actions: How many are unrolled.

    Raises:
        ConfigurationError: the batch stacks observations, or its actions need a base policy.
    """

    def __init__(self, batch: Batch, actions: int) -> None:
        options = batch.options
        if options.observation.stack > 1:
            raise ConfigurationError(
                "observation.stack must be 1 for gradients; observation.memory serves instead"
            )
        if options.action.mode not in _MODES:
            raise ConfigurationError(
                f"action.mode {options.action.mode!r} has no gradients; one of {', '.join(_MODES)} has"
            )
        self.batch, self.actions = batch, actions
        self.repeat = options.action.repeat
        self._allocate()
        self._forward = [self._record(k, adjoint=False) for k in range(actions)]
        self._backward = [self._record(k, adjoint=True) for k in range(actions)]

    def _allocate(self) -> None:
        batch, n = self.batch, self.batch.n
        device = batch.simulator.device
        keep: dict[str, Any] = {"device": device, "requires_grad": True}
        steps = self.actions * self.repeat
        self._states = [wp.zeros(n, dtype=State, **keep) for _ in range(steps + 1)]
        self._delays = [
            wp.zeros(batch.simulator.delay_array.shape, dtype=SetPoint, **keep) for _ in range(steps + 1)
        ]
        self._own = [wp.zeros(n, dtype=vec9, **keep) for _ in range(steps + 1)]
        # The first is the action before the unroll, none at all.
        self._taken = [
            wp.zeros((n, batch.action_size), dtype=wp.float32, **keep) for _ in range(self.actions + 1)
        ]
        self._fixed = [wp.zeros((n, OBSERVATION_SIZE), dtype=real, **keep) for _ in range(self.actions)]
        self._seen = [wp.zeros((n, batch.layout.size), dtype=wp.float32, **keep) for _ in range(self.actions)]
        self._costs = wp.zeros(n, dtype=real, **keep)
        self._terms = wp.zeros(n, dtype=vec_terms, device=device)
        self._all = [*self._states, *self._delays, *self._own, *self._taken, *self._fixed, *self._seen]

    def _record(self, k: int, adjoint: bool) -> tuple[Any, list[Any]]:
        """The launches around action k: of the observation, and of its time steps."""
        look = self._launch(look_with_adjoint, self._look_arguments(k), adjoint)
        plays = [
            self._launch(play_with_adjoint, self._play_arguments(k, step), adjoint)
            for step in range(self.repeat)
        ]
        return look, plays

    def _launch(self, kernel: Any, arguments: list[Any], adjoint: bool) -> Any:
        adjoints = {"adj_inputs": [_adjoint(a) for a in arguments], "adj_outputs": []} if adjoint else {}
        return wp.launch(
            kernel,
            self.batch.n,
            inputs=arguments,
            device=self.batch.simulator.device,
            adjoint=adjoint,
            record_cmd=True,
            **adjoints,
        )

    def _look_arguments(self, k: int) -> list[Any]:
        batch = self.batch
        machines, _, drives, machine_of, drive_of, _ = batch.simulator.constants
        arrays, step = batch.arrays, k * self.repeat
        return [
            batch.rules, arrays.episode.array, machines, drives, machine_of, drive_of, arrays.memory.array,
            arrays.bounds.array, self._taken[k], self._own[step], self._states[step],
            self._fixed[k], self._seen[k],
        ]  # fmt: skip

    def _play_arguments(self, k: int, step: int) -> list[Any]:
        batch = self.batch
        *constants, _ = batch.simulator.constants
        i = k * self.repeat + step
        return [
            batch.rules, batch.arrays.episode.array, *constants, int(step == 0),
            self._taken[k + 1], self._taken[k], self._own[i], self._states[i], self._delays[i],
            self._own[i + 1], self._states[i + 1], self._delays[i + 1],
            self._terms, self._costs,
        ]  # fmt: skip

    def begin(self) -> None:
        """Take the batch's episodes as they are now, at their beginning."""
        simulator = self.batch.simulator
        wp.copy(self._states[0], simulator.state_array)
        wp.copy(self._delays[0], simulator.delay_array)
        self._costs.zero_()
        self._terms.zero_()

    def observe(self, k: int) -> NDArray[np.float32]:
        """(n, size) what is seen before action k; the array is the unroll's own."""
        self._forward[k][0].launch()
        return np.asarray(self._seen[k].numpy())

    def act(self, k: int, action: NDArray[np.float32]) -> None:
        """Take action k, (n, action_size) within [-1, 1]."""
        self._taken[k + 1].assign(action)
        for play in self._forward[k][1]:
            play.launch()

    @property
    def costs(self) -> NDArray[np.float64]:
        """(n,) minus the mean reward an action."""
        return np.asarray(self._costs.numpy()) / self.actions

    @property
    def terms(self) -> NDArray[np.float64]:
        """(N_TERMS,) mean of every term of the reward that belongs to the state, unweighted."""
        means: NDArray[np.float64] = self._terms.numpy().mean(axis=0) / self.actions
        return means

    def weigh(self, weights: NDArray[np.float64]) -> None:
        """Begin the way back: the gradients will be those of the sum of ``weights`` (n,) times the costs."""
        for array in self._all:
            array.grad.zero_()
        self._costs.grad.assign(weights / self.actions)

    def back_through_act(self, k: int) -> NDArray[np.float32]:
        """(n, action_size) gradient with respect to action k."""
        for play in reversed(self._backward[k][1]):
            play.launch()
        return np.asarray(self._taken[k + 1].grad.numpy())

    def back_through_observe(self, k: int, gradient: NDArray[np.float32]) -> None:
        """Lead the gradient (n, size) with respect to what was seen before action k back to the machine."""
        self._seen[k].grad.assign(gradient)
        self._backward[k][0].launch()


def _adjoint(argument: Any) -> Any:
    """Where the adjoint of a kernel's argument is gathered; nowhere for constants."""
    if isinstance(argument, wp.array):
        return argument.grad
    # Structs and numbers are constants, whose adjoints nobody asks for.
    return type(argument)() if not isinstance(argument, int) else 0
