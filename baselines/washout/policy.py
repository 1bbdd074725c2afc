"""What the classical, the adaptive and the optimal washout have in common: kernels that act, and a start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Final, Generic, Protocol, TypeVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ...envs.arrays import real, vec3, vec9
from ...envs.platform.machines import Cab, Platform
from ...envs.settings import Vector2, Vector3
from ...envs.simulator.kernels.observation import OBSERVATION_SIZE
from ...envs.simulator.simulator import N_AXES, TIME_STEP
from ..policy import Array, Policy, checked_episode_start, checked_observation, wrong_state
from .kernels.blocks import HighPassParameters, Memory, Parameters, initial_memory
from .kernels.launch import drive_kernel, predict_kernel
from .kernels.step import washout
from .parameters import HighPass, LowPass, TiltCoordination, WashoutParameters, load_washout


class FamilyParameters(Protocol):
    """A parameter set of any family."""

    @property
    def name(self) -> str:
        """Of the set."""
        ...

    @property
    def description(self) -> str:
        """One line for people."""
        ...

    @property
    def turntable_share(self) -> float:
        """k_T: 1 turns the cab with the turntable, 0 with the hexapod."""
        ...

    @property
    def start_carriage(self) -> Vector2:
        """Where the carriage begins a drive, m."""
        ...

    @property
    def start_hexapod(self) -> Vector3:
        """Where the hexapod begins a drive, m from neutral."""
        ...


@dataclass(frozen=True)
class Family:
    """An algorithm of the washout kind, as kernels.

    Args:
        parameters: Kernel's struct of a parameter set.
        memory: Kernel's struct of the filters' states.
        values: (set, cab, time step in s) -> the kernel's form of a set.
        predict: Kernel from observations, see :func:`~.kernels.predict_kernel`.
        drive_through: Kernel fused with the machine, see :func:`~.kernels.drive_kernel`.
    """

    parameters: Any
    memory: Any
    values: Callable[[Any, Cab, float], Any]
    predict: Any
    drive_through: Any


def make_family(
    parameters: Any, memory: Any, begin: Any, step: Any, values: Callable[[Any, Cab, float], Any]
) -> Family:
    """A family of its structs, its first memory and its step; see :class:`Family`."""
    return Family(
        parameters,
        memory,
        values,
        predict_kernel(parameters, memory, begin, step),
        drive_kernel(parameters, begin, step),
    )


def start_pose(p: FamilyParameters) -> Array:
    """(9,) pose to begin a drive at: C'(0) and S'(0)."""
    pose = np.zeros(N_AXES)
    pose[:2], pose[2:5] = p.start_carriage, p.start_hexapod
    return pose


# The classical washout's parameters as its kernels hold them.


def _high_pass(block: HighPass) -> Any:
    values: Any = HighPassParameters()
    values.order, values.frequency, values.damping = block.order, block.frequency, block.damping
    return values


def kernel_parameters(p: WashoutParameters, cab: Cab) -> Any:
    """The kernels' form of a parameter set for a cab."""
    k: Any = Parameters()
    for name in ("force_scale", "force_limit", "rate_scale", "rate_limit"):
        setattr(k, name, vec3(*getattr(p, name)))
    blocks = {"hpr_roll": p.hpr[0], "hpr_pitch": p.hpr[1], "hpr_yaw": p.hpr[2], "hps_x": p.hps[0]}
    blocks |= {"hps_y": p.hps[1], "hpi_x": p.hpi[0], "hpi_y": p.hpi[1], "hpi_z": p.hpi[2]}
    for name, block in blocks.items():
        setattr(k, name, _high_pass(block))
    tilt = p.tilt or TiltCoordination()
    k.tilt_gain = 1.0 if p.tilt else 0.0
    k.tilt_frequency, k.tilt_damping = tilt.low_pass.frequency, tilt.low_pass.damping
    k.tilt_rate, k.tilt_acceleration, k.tilt_approach = tilt.rate, tilt.acceleration, tilt.approach
    lpc = p.lpc or LowPass(1.0)
    k.carriage_share = 1.0 if p.lpc else 0.0
    k.lpc_frequency, k.lpc_damping = lpc.frequency, lpc.damping
    for name in (
        "rate_bandwidth",
        "turntable_share",
        "turntable_gain",
        "follow_frequency",
        "return_frequency",
    ):
        setattr(k, name, getattr(p, name))
    k.cab = vec3(*cab.reference_point)
    return k


def _values(p: WashoutParameters, cab: Cab, dt: float) -> Any:
    return kernel_parameters(p, cab)


CLASSICAL: Final[Family] = make_family(Parameters, Memory, initial_memory, washout, _values)
"""The paper's algorithm."""

# A washout as a policy; the classical one.


P = TypeVar("P", bound=FamilyParameters)


class _Buffers:
    """Arrays of one batch size and the launch recorded on them."""

    def __init__(self, family: Family, n: int, parameters: Any, parameters_of: Any, dt: float) -> None:
        self.observation = wp.zeros((n, OBSERVATION_SIZE), dtype=real, device="cpu")
        self.begins = wp.zeros(n, dtype=wp.bool, device="cpu")
        self.memory = wp.zeros(n, dtype=family.memory, device="cpu")
        self.after = wp.zeros(n, dtype=family.memory, device="cpu")
        self.action = wp.zeros(n, dtype=vec9, device="cpu")
        self.launch = wp.launch(
            family.predict,
            n,
            inputs=[parameters, parameters_of, self.observation, self.begins, self.memory, real(dt)],
            outputs=[self.after, self.action],
            device="cpu",
            record_cmd=True,
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
    """An algorithm of the washout kind as a policy; its memory is the policy's state.

    A subclass says which algorithm it is.

    Args:
        parameters: A parameter set, a preset name or a YAML file; default: the set by hand.
        cab: Where the driver sits on the machine.
        dt: Time step, s.

    Attributes:
        family: The algorithm as kernels.
        kind: Class of its parameter sets.
        load: A parameter set by preset name or from a YAML file.
        by_hand: Preset name of the set by hand.
    """

    family: ClassVar[Family]
    kind: ClassVar[type[Any]]
    load: ClassVar[staticmethod[[str | Path], Any]]
    by_hand: ClassVar[str]

    def __init__(
        self, parameters: P | str | Path | None = None, cab: Cab | None = None, dt: float = TIME_STEP
    ) -> None:
        given: Any = self.by_hand if parameters is None else parameters
        self.parameters: P = given if isinstance(given, self.kind) else self.load(given)
        self.name = self.parameters.name
        self.cab = cab or Cab()
        self.time_step: float = dt
        self._start = start_pose(self.parameters)
        self._kernel_parameters = wp.array(
            [self.family.values(self.parameters, self.cab, dt)], dtype=self.family.parameters, device="cpu"
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
        self,
        observation: Array,
        state: Any = None,
        episode_start: Array | None = None,
        deterministic: bool = True,
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
        self._buffers[n] = _Buffers(self.family, n, parameters, parameters_of, self.time_step)
        return self._buffers[n]


class ClassicalWashout(WashoutPolicy[WashoutParameters]):
    """The paper's algorithm as a policy; arguments as of :class:`WashoutPolicy`."""

    family = CLASSICAL
    kind = WashoutParameters
    load = staticmethod(load_washout)
    by_hand = "classical"
