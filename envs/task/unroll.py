"""Differentiable unroll: a batch of drives over many actions, with gradients by the kernels' adjoints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ..arrays import real, vec9
from ..errors import ConfigurationError
from ..launch import Launch
from ..platform.kernels.step import SetPoint
from ..simulator.kernels.observation import OBSERVATION_SIZE
from ..simulator.kernels.step import State
from ..simulator.simulator import Snapshot, bytes_of, put_bytes
from .batch import Batch
from .kernels.episode import look_with_adjoint, play_with_adjoint
from .kernels.reward import vec_terms

_MODES: Final = ("acceleration", "jerk", "velocity")


class TaskUnroll:
    """What a batch would do over a number of actions, with everything that the gradients need.

    Forward: :meth:`begin` or :meth:`go_on`, then for each action k = 0, 1, ...: :meth:`observe`,
    :meth:`act`; and once more :meth:`observe` where the end counts. Backward, after :meth:`weigh`, from the
    last to the first: :meth:`back_through_observe` with the gradient with respect to the observation, and
    :meth:`back_through_act`, which returns that with respect to the action.

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
        if options.reward.floor is not None:
            raise ConfigurationError("reward.floor must be None for gradients: where it holds there are none")
        self.batch, self.actions = batch, actions
        self.repeat = options.action.repeat
        self._allocate()
        self._looks, self._plays = self._record(adjoint=False)
        self._looks_back, self._plays_back = self._record(adjoint=True)

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
        looks = range(self.actions + 1)
        self._fixed = [wp.zeros((n, OBSERVATION_SIZE), dtype=real, **keep) for _ in looks]
        self._seen = [wp.zeros((n, batch.layout.size), dtype=wp.float32, **keep) for _ in looks]
        self._costs = wp.zeros((self.actions, n), dtype=real, **keep)
        self._terms = wp.zeros(n, dtype=vec_terms, device=device)
        self._all = [*self._states, *self._delays, *self._own, *self._taken, *self._fixed, *self._seen]

    def _record(self, adjoint: bool) -> tuple[list[Launch], list[list[Launch]]]:
        """The launches of all observations, and of the time steps of all actions."""
        looks = [
            self._launch(look_with_adjoint, self._look_arguments(k), adjoint) for k in range(self.actions + 1)
        ]
        plays = [
            [
                self._launch(play_with_adjoint, self._play_arguments(k, step), adjoint)
                for step in range(self.repeat)
            ]
            for k in range(self.actions)
        ]
        return looks, plays

    def _launch(self, kernel: Any, arguments: list[Any], adjoint: bool) -> Launch:
        return Launch(
            kernel,
            self.batch.n,
            arguments,
            device=self.batch.simulator.device,
            adjoint=adjoint,
            adj_inputs=[_adjoint(a) for a in arguments] if adjoint else [],
        )

    def _look_arguments(self, k: int) -> list[Any]:
        batch = self.batch
        machines, _, drives, machine_of, drive_of, _ = batch.simulator.constants
        arrays, step = batch.arrays, k * self.repeat
        return [
            batch.rules, arrays.episode.array, machines, drives, machine_of, drive_of, arrays.memory.array,
            arrays.known.array, arrays.bounds.array, self._taken[k], self._own[step], self._states[step],
            self._fixed[k], self._seen[k],
        ]  # fmt: skip

    def _play_arguments(self, k: int, step: int) -> list[Any]:
        batch = self.batch
        *constants, _ = batch.simulator.constants
        i = k * self.repeat + step
        return [
            batch.rules, batch.arrays.episode.array, *constants, step,
            self._taken[k + 1], self._taken[k], self._own[i], self._states[i], self._delays[i],
            self._own[i + 1], self._states[i + 1], self._delays[i + 1],
            self._terms, self._costs[k],
        ]  # fmt: skip

    def begin(self) -> None:
        """Take the batch's episodes as they are now, at their beginning."""
        self._take_over(np.ones(self.batch.n, dtype=bool))

    def go_on(self, begins: NDArray[np.bool_]) -> None:
        """Go on from the end of the last unroll; where ``begins`` (n,) with the batch's next episode."""
        wp.copy(self.batch.simulator.state_array, self._states[-1])
        wp.copy(self.batch.simulator.delay_array, self._delays[-1])
        if begins.any():
            self.batch.begin(begins)
        self._take_over(begins)

    def _take_over(self, begins: NDArray[np.bool_]) -> None:
        """Begin with the batch's state, and with the last actions but where an episode begins."""
        simulator = self.batch.simulator
        wp.copy(self._states[0], simulator.state_array)
        wp.copy(self._delays[0], simulator.delay_array)
        for arrays in (self._own, self._taken):
            last = arrays[-1].numpy()
            arrays[0].assign(np.where(begins[:, None], np.zeros_like(last), last))
        self._costs.zero_()
        self._terms.zero_()

    def snapshot(self) -> Snapshot:
        """What :meth:`go_on` needs, for :meth:`restore` of an unroll made alike."""
        return {name: bytes_of(array) for name, array in self._carried()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Let :meth:`go_on` go on from a snapshot.

        Raises:
            DataError: it is of another unroll or version.
        """
        for name, array in self._carried():
            put_bytes(array, name, snapshot)

    def _carried(self) -> list[tuple[str, Any]]:
        """The last of what changes, by name."""
        return [
            ("state", self._states[-1]),
            ("delay", self._delays[-1]),
            ("own", self._own[-1]),
            ("taken", self._taken[-1]),
        ]

    def observe(self, k: int) -> NDArray[np.float32]:
        """(n, size) what is seen before action k, or after the last; the array is the unroll's own."""
        self._looks[k].launch()
        return np.asarray(self._seen[k].numpy())

    def act(self, k: int, action: NDArray[np.float32]) -> None:
        """Take action k, (n, action_size) within [-1, 1]."""
        self._taken[k + 1].assign(action)
        for play in self._plays[k]:
            play.launch()

    @property
    def costs(self) -> NDArray[np.float64]:
        """(actions, n) minus the reward of each action."""
        return np.array(self._costs.numpy(), dtype=np.float64)

    @property
    def terms(self) -> NDArray[np.float64]:
        """(N_TERMS,) mean of every term of the reward that belongs to the state, unweighted."""
        means: NDArray[np.float64] = self._terms.numpy().mean(axis=0) / self.actions
        return means

    def weigh(self, weights: NDArray[np.float64]) -> None:
        """Begin the way back: gradients will be those of the sum of ``weights`` (actions, n) times costs."""
        for array in self._all:
            array.grad.zero_()
        self._costs.grad.assign(weights)

    def back_through_act(self, k: int) -> NDArray[np.float32]:
        """(n, action_size) gradient with respect to action k; the array is the unroll's own."""
        for play in reversed(self._plays_back[k]):
            play.launch()
        return np.asarray(self._taken[k + 1].grad.numpy())

    def back_through_observe(self, k: int, gradient: NDArray[np.float32]) -> None:
        """Lead the gradient (n, size) with respect to the observation k back to the machine."""
        self._seen[k].grad.assign(gradient)
        self._looks_back[k].launch()


def _adjoint(argument: Any) -> Any:
    """Where the adjoint of a kernel's argument is gathered; nowhere for constants."""
    if isinstance(argument, wp.array):
        return argument.grad
    # Structs and numbers are constants, whose adjoints nobody asks for.
    return type(argument)() if not isinstance(argument, int) else 0
