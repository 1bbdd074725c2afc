"""A washout of any family as a policy; the memory of its filters is the policy's state."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Final, Generic, TypeVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ...envs.arrays import real, vec9
from ...envs.launch import Launch
from ...envs.platform.machines import Cab, Platform
from ...envs.settings import read_yaml
from ...envs.simulator.kernels.observation import OBSERVATION_SIZE
from ...envs.simulator.simulator import N_AXES, TIME_STEP
from ..policy import Array, Policy, Starts, checked_episode_start, checked_observation, wrong_state
from .families import (
    FAMILIES,
    FamilyParameters,
    algorithm_of,
    check_algorithm,
    family_of,
    load_of,
    load_parameters,
)
from .kernels.launch import Kernels

P = TypeVar("P", bound=FamilyParameters)

_PREDICTIVE: Final = ("mpc", "nmpc")
"""Algorithms of predictive control, as files name them."""


def start_pose(p: FamilyParameters) -> Array:
    """(9,) pose to begin a drive at: C'(0) and S'(0)."""
    pose = np.zeros(N_AXES)
    pose[:2], pose[2:5] = p.start_carriage, p.start_hexapod
    return pose


class _Buffers:
    """Arrays of one batch size and the launch recorded on them."""

    def __init__(self, kernels: Kernels, n: int, parameters: Any, parameters_of: Any, dt: float) -> None:
        self.observation = wp.zeros((n, OBSERVATION_SIZE), dtype=real, device="cpu")
        self.begins = wp.zeros(n, dtype=wp.bool, device="cpu")
        self.memory = wp.zeros(n, dtype=kernels.memory, device="cpu")
        self.after = wp.zeros(n, dtype=kernels.memory, device="cpu")
        self.action = wp.zeros(n, dtype=vec9, device="cpu")
        self.launch = Launch(
            kernels.predict,
            n,
            inputs=[parameters, parameters_of, self.observation, self.begins, self.memory, real(dt)],
            outputs=[self.after, self.action],
            device="cpu",
        )
        self.views = {name: getattr(self, name).numpy() for name in ("observation", "begins", "memory")}
        self.results = self.after.numpy(), self.action.numpy()


def _checked_state(state: Any, dtype: np.dtype[Any], n: int) -> Array:
    if not isinstance(state, np.ndarray) or state.dtype != dtype or state.shape != (n,):
        raise wrong_state(state, n)
    return state


def _as_bytes(memory: NDArray[Any]) -> NDArray[np.uint8]:
    """A memory as bytes, which NumPy copies at once; structures it copies field by field."""
    return np.ascontiguousarray(memory).view(np.uint8)


class WashoutPolicy(Policy, Generic[P]):
    """A washout as a policy.

    Args:
        parameters: A parameter set, a preset name or a YAML file; default: the set by hand.
        cab: Where the driver sits on the machine.
        dt: Time step, s.

    Attributes:
        algorithm: Family of a subclass; the class itself takes sets of any family.
    """

    algorithm: ClassVar[str | None] = None

    def __init__(
        self, parameters: P | str | Path | None = None, cab: Cab | None = None, dt: float = TIME_STEP
    ) -> None:
        given: Any = FAMILIES[self.algorithm or "classical"].start if parameters is None else parameters
        if isinstance(given, str | Path):
            given = load_of(self.algorithm, given) if self.algorithm else load_parameters(given)
        self.parameters: P = given
        self.family = FAMILIES[self.algorithm] if self.algorithm else family_of(given)
        self.name = self.parameters.name
        self.cab = cab or Cab()
        self.time_step: float = dt
        self._start = start_pose(self.parameters)
        kernels = self.family.kernels
        self._kernel_parameters = wp.array(
            [kernels.values(self.parameters, self.cab, dt)], dtype=kernels.parameters, device="cpu"
        )
        self._buffers: dict[int, _Buffers] = {}
        # Compiled and loaded now, so that the first step of a drive takes no longer than the others.
        self._make_buffers(1).launch.launch()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are made anew: Warp's arrays cannot be."""
        return type(self), (self.parameters, self.cab, self.time_step)

    @property
    def start_pose(self) -> Array:
        """(9,) pose to begin a drive at."""
        return self._start.copy()

    def on(self, platform: Platform) -> Policy:
        """The washout on a machine; without a turntable it yaws with the hexapod, k_T = 0, as EST3 does."""
        if platform.turntable is not None or not self.parameters.turntable_share:
            return self
        parameters: Any = self.parameters
        return type(self)(replace(parameters, turntable_share=0.0), platform.cab, self.time_step)

    def predict(
        self, observation: Array, state: Any = None, episode_start: Starts = None, deterministic: bool = True
    ) -> tuple[Array, NDArray[Any]]:
        """Accelerations for observations; see :class:`~motion_cueing.baselines.policy.Policy`.

        Raises:
            DataError: an argument has the wrong type or shape, or the observation is not finite.
        """
        observation = checked_observation(observation)
        n = 1 if observation.ndim == 1 else len(observation)
        buffers = self._buffers.get(n) or self._make_buffers(n)
        memory, action = buffers.results
        if episode_start is not None:
            episode_start = checked_episode_start(episode_start, n)
        if state is not None:
            _as_bytes(buffers.views["memory"])[...] = _as_bytes(_checked_state(state, memory.dtype, n))
        buffers.views["observation"][...] = observation
        buffers.views["begins"][...] = (
            True if state is None else episode_start if episode_start is not None else False
        )
        buffers.launch.launch()
        remembered = _as_bytes(memory).copy().view(memory.dtype)
        return action.reshape(*observation.shape[:-1], N_AXES).copy(), remembered

    def _make_buffers(self, n: int) -> _Buffers:
        parameters_of = wp.zeros(n, dtype=int, device="cpu")
        return self._buffers_with(n, self._kernel_parameters, parameters_of)

    def _buffers_with(self, n: int, parameters: Any, parameters_of: Any) -> _Buffers:
        self._buffers[n] = _Buffers(self.family.kernels, n, parameters, parameters_of, self.time_step)
        return self._buffers[n]


def make_washout(parameters: FamilyParameters, cab: Cab) -> WashoutPolicy[Any]:
    """The policy of a parameter set of any family, for a cab; of the family's own class where it has one."""
    own: dict[str | None, Any] = {kind.algorithm: kind for kind in WashoutPolicy.__subclasses__()}
    policy: WashoutPolicy[Any] = own.get(family_of(parameters).name, WashoutPolicy)(parameters, cab)
    return policy


def policy_of_file(path: Path, platform: Platform) -> Policy:
    """The policy of a YAML file, for a machine: a washout, or predictive control.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: a field of it is wrong.
    """
    algorithm = check_algorithm(algorithm_of(read_yaml(path)), path, (*FAMILIES, *_PREDICTIVE))
    if algorithm not in _PREDICTIVE:
        return make_washout(load_parameters(path), platform.cab)
    from ..mpc import load_mpc, make_mpc

    return make_mpc(platform, load_mpc(path), path.stem)
