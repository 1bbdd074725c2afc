"""The simulator: a batch of motion bases, each driven through its own drive, and snapshots of it.

Every environment, evaluation and real-time loop runs on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from ..arrays import FLOAT, Mirror, find_device, real, vec3, vec9
from ..cues import CueTrace
from ..errors import ActionError, ConfigurationError, DataError
from ..launch import Launch
from ..perception.kernels import Vestibular, vestibular_parameters
from ..perception.models import VestibularModel, get_vestibular_model
from ..platform.kernels.step import ACTUATORS, Machine, SetPoint
from ..platform.kinematics import legs_of_pose, pose_of_legs
from ..platform.machines import Platform
from ..platform.parameters import dead_steps, machine_parameters
from .kernels.step import Drives, State, reset_forward, step_forward

Snapshot = dict[str, NDArray[Any]]
"""Arrays by name; those of kernels as bytes, which hold structs of any layout."""


def bytes_of(array: Any) -> NDArray[np.uint8]:
    """The content of a Warp array, flat."""
    return np.frombuffer(np.ascontiguousarray(array.numpy()).tobytes(), dtype=np.uint8).copy()


def put_bytes(array: Any, name: str, snapshot: Mapping[str, NDArray[Any]]) -> None:
    """Write the content called ``name`` into a Warp array, in place.

    Raises:
        DataError: it is missing or of another size: the snapshot is of another batch or version.
    """
    like = array.numpy()
    data = snapshot.get(name)
    if data is None or data.size != like.nbytes:
        found = "nothing" if data is None else f"{data.size} bytes"
        raise DataError(
            f"snapshot: {name} needs {like.nbytes} bytes, found {found}; it is of another batch or version"
        )
    array.assign(np.frombuffer(data.tobytes(), dtype=like.dtype).reshape(like.shape))


TIME_STEP: Final = 0.01
"""Time step of the machine and its policies, s."""

_SAME_POSE: Final = 1e-4
"""Largest difference of two poses taken for one, m and rad."""

N_AXES: Final = 9
"""Degrees of freedom of an action."""


class Simulator:
    """A batch of environments stepped together; each has its own machine, drive, time and start.

    One environment is a batch of one row. There are two copies of the arrays, and a step goes from one to the
    other, so the state before a step stays readable until the next.

    Args:
        platforms: The machines in use.
        drives: The cue traces in use, all with the time step ``dt``.
        platform_of: (n,) index into ``platforms`` for each environment; default: the first.
        drive_of: (n,) index into ``drives`` for each environment; default: one environment a drive.
        vestibular: The perception model.
        dt: Time step, s.
        device: Where the arrays live: "cpu" or a CUDA device of Warp.

    Raises:
        ConfigurationError: an index is out of range, nothing to simulate is given, or the device is unknown.
        DataError: a drive has another time step.
    """

    def __init__(
        self,
        platforms: Platform | Sequence[Platform],
        drives: CueTrace | Sequence[CueTrace],
        *,
        platform_of: ArrayLike | None = None,
        drive_of: ArrayLike | None = None,
        vestibular: VestibularModel | None = None,
        dt: float = TIME_STEP,
        device: str = "cpu",
    ) -> None:
        self.platforms = [platforms] if isinstance(platforms, Platform) else list(platforms)
        self.drives = [drives] if isinstance(drives, CueTrace) else list(drives)
        if not self.platforms or not self.drives:
            raise ConfigurationError("platforms and drives must each name at least one")
        if not (np.isfinite(dt) and dt > 0.0):
            raise ConfigurationError(f"dt must be a positive time step in seconds, found {dt}")
        self.dt = dt
        self.device = find_device(device)
        self.drive_of = _indices("drive_of", drive_of, np.arange(len(self.drives)), len(self.drives))
        self.n = len(self.drive_of)
        self.platform_of = _indices(
            "platform_of", platform_of, np.zeros(self.n, dtype=np.int32), len(self.platforms)
        )
        if len(self.platform_of) != self.n:
            raise ConfigurationError(f"platform_of has {len(self.platform_of)} entries, drive_of {self.n}")
        self.vestibular = vestibular or get_vestibular_model("zacharias")
        self._upload()

    def _upload(self) -> None:
        device, n = self.device, self.n
        self.machines = wp.array(
            [machine_parameters(p, self.dt) for p in self.platforms], dtype=Machine, device=device
        )
        perception = [vestibular_parameters(self.vestibular, self.dt)]
        self._perception = wp.array(perception, dtype=Vestibular, device=device)
        self._drives = upload_drives(self.drives, self.dt, device)
        kinds = {"machine_of": int, "drive_of": int, "sample": int, "start": vec9, "mask": wp.bool}
        self._placing = {name: Mirror(n, kind, device) for name, kind in kinds.items()}
        self._placing["machine_of"].view[...] = self.platform_of
        self._placing["drive_of"].view[...] = self.drive_of
        for name in ("machine_of", "drive_of"):
            self._placing[name].push()
        self.machine_of = self._placing["machine_of"].array
        depth = 1 + max(max(dead_steps(p, self.dt)) for p in self.platforms)
        self._states = [wp.zeros(n, dtype=State, device=device) for _ in range(2)]
        self._delays = [wp.zeros((n, depth), dtype=SetPoint, device=device) for _ in range(2)]
        self.action_array = wp.zeros(n, dtype=vec9, device=device)
        self._now = 0
        self._steps: list[Launch] = []
        self._resets: list[Launch] = []
        on_host = device.is_cpu
        self._views = [state.numpy() for state in self._states] if on_host else None
        self._action_view = self.action_array.numpy() if on_host else None

    def _record(self, begin: int) -> Launch:
        """A recorded launch from copy ``begin`` of the state to the other."""
        return Launch(
            step_forward,
            self.n,
            inputs=[*self.constants, self._states[begin], self._delays[begin], self.action_array],
            outputs=[self._states[1 - begin], self._delays[1 - begin]],
            device=self.device,
        )

    def _record_reset(self, which: int) -> Launch:
        """A recorded launch that puts copy ``which`` of the state at rest."""
        placing = [self._placing[name].array for name in ("sample", "start", "mask")]
        return Launch(
            reset_forward,
            self.n,
            inputs=[*self.constants[:-1], *placing],
            outputs=[self._states[which], self._delays[which]],
            device=self.device,
        )

    @property
    def constants(self) -> list[Any]:
        """First arguments of every step kernel: machines, perception, drives, who has which, time step."""
        return [
            self.machines,
            self._perception,
            self._drives,
            self.machine_of,
            self._placing["drive_of"].array,
            real(self.dt),
        ]

    @property
    def copies(self) -> list[tuple[Any, Any]]:
        """The two pairs of Warp arrays, state and earlier set-points, that hold in turn."""
        return list(zip(self._states, self._delays, strict=True))

    @property
    def current(self) -> int:
        """Which of :attr:`copies` holds now."""
        return self._now

    @property
    def delay_array(self) -> Any:
        """The Warp array (n, depth) of earlier set-points now."""
        return self._delays[self._now]

    @property
    def state_array(self) -> Any:
        """The Warp array (n,) of :class:`~.state.State` now."""
        return self._states[self._now]

    @property
    def state(self) -> NDArray[Any]:
        """The state now as a NumPy structured array (n,), fields as in :class:`~.state.State`.

        On the CPU it is a view that the step after next overwrites.
        """
        if self._views is not None:
            return np.asarray(self._views[self._now])
        return np.asarray(self.state_array.numpy())

    @property
    def finished(self) -> NDArray[np.bool_]:
        """(n,) whether each environment is at the last sample of its drive."""
        lengths = np.array([len(drive) for drive in self.drives])[self.drive_of]
        return np.asarray(self.state["sample"] >= lengths - 1)

    def reset(
        self, start: ArrayLike | None = None, sample: ArrayLike | None = None, mask: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Put environments at rest.

        Args:
            start: (9,) or (n, 9) pose: carriage x, y; hexapod x, y, z, roll, pitch, yaw; turntable;
                m and rad from neutral. Default: neutral.
            sample: (n,) sample of the drive to begin at; default: the first.
            mask: (n,) environments to reset; default: all.

        Returns:
            The state, as :attr:`state`.

        Raises:
            DataError: a start pose lies outside the machine's travel.
        """
        poses = _finite("start", np.zeros(N_AXES) if start is None else start, (self.n, N_AXES))
        samples = np.broadcast_to(0 if sample is None else np.asarray(sample, dtype=np.int32), (self.n,))
        lengths = np.array([len(drive) for drive in self.drives])[self.drive_of]
        if np.any((samples < 0) | (samples >= lengths)):
            raise DataError(f"sample must be 0 to the last of each drive ({lengths - 1}), found {samples}")
        chosen = np.broadcast_to(True if mask is None else np.asarray(mask, dtype=bool), (self.n,))
        self._check_start(poses, chosen)
        self.place(chosen, sample=samples, start=poses)
        return self.state

    def place(self, mask: NDArray[np.bool_], **where: NDArray[Any]) -> None:
        """Put environments at rest, unchecked.

        Args:
            mask: (n,) environments to place.
            **where: ``sample`` (n,) and ``start`` (n, 9) as in :meth:`reset`; ``drive_of`` and
                ``machine_of`` (n,) move the masked environments to other drives and machines.
        """
        self._placing["mask"].view[...] = mask
        self._placing["mask"].push()
        for name, values in where.items():
            mirror = self._placing[name]
            mirror.view[mask] = values[mask]
            mirror.push()
        self.drive_of = self._placing["drive_of"].view
        self.platform_of = self._placing["machine_of"].view
        if not self._resets:
            self._resets = [self._record_reset(0), self._record_reset(1)]
        self._resets[self._now].launch()

    def _check_start(self, poses: NDArray[np.float64], chosen: NDArray[np.bool_]) -> None:
        limits = self.machines.numpy()
        moved = np.flatnonzero(chosen & np.any(poses != 0.0, axis=1))
        for i in moved:
            machine = limits[self.platform_of[i]]
            hexapod = self.platforms[self.platform_of[i]].hexapod
            legs = legs_of_pose(hexapod, poses[i, 2:8])
            position = np.concatenate([poses[i, :2], legs, poses[i, 8:]])
            if np.any(position < machine["position_min"]) or np.any(position > machine["position_max"]):
                name = self.platforms[self.platform_of[i]].name
                outside = (position < machine["position_min"]) | (position > machine["position_max"])
                which = ACTUATORS[int(np.argmax(outside))]
                raise DataError(f"start pose {i} lies outside the travel of {name}, {which}: {poses[i]}")
            # The same legs may close on the other side of a singular pose, which no motion reaches.
            if not np.allclose(pose_of_legs(hexapod, legs), poses[i, 2:8], atol=_SAME_POSE):
                raise DataError(f"start pose {i} cannot be reached from neutral: {poses[i]}")

    def step(self, action: ArrayLike) -> NDArray[Any]:
        """Advance every environment by one time step.

        Args:
            action: (n, 9) accelerations in the order of ``AXES``, m/s^2 and rad/s^2; or (9,) for one.

        Returns:
            The state, as :attr:`state`.

        Raises:
            ActionError: a wrong shape, or a value that is not finite; nothing has moved then.
        """
        try:
            values = np.asarray(action, dtype=FLOAT)
        except (TypeError, ValueError):
            raise ActionError(f"action is not an array of ({self.n}, {N_AXES}) numbers") from None
        if values.shape != (self.n, N_AXES) and not (self.n == 1 and values.shape == (N_AXES,)):
            raise ActionError(f"action has shape {values.shape}, expected ({self.n}, {N_AXES})")
        if not np.isfinite(values).all():
            raise ActionError(
                f"action is not finite: {values[~np.isfinite(values)][:3]} among its accelerations"
            )
        if self._action_view is not None:
            self._action_view[...] = values
        else:
            self.action_array.assign(values.reshape(self.n, N_AXES))
        self.advance()
        return self.state

    def advance(self) -> None:
        """Advance by one step with the accelerations in :attr:`action_array`, unchecked."""
        if not self._steps:
            self._steps = [self._record(0), self._record(1)]
        self._steps[self._now].launch()
        self.swap()

    def swap(self) -> None:
        """The other copies of state and set-points hold now: a launch has written them."""
        self._now = 1 - self._now

    def snapshot(self) -> Snapshot:
        """Everything that changes, for :meth:`restore` of a simulator made alike."""
        held = {"state": self.state_array, "delay": self.delay_array}
        placed = {name: self._placing[name].array for name in ("machine_of", "drive_of")}
        return {name: bytes_of(array) for name, array in (held | placed).items()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot.

        Raises:
            DataError: it is of another batch or version.
        """
        put_bytes(self.state_array, "state", snapshot)
        put_bytes(self.delay_array, "delay", snapshot)
        for name in ("machine_of", "drive_of"):
            put_bytes(self._placing[name].array, name, snapshot)
            self._placing[name].pull()
        self.drive_of = self._placing["drive_of"].view
        self.platform_of = self._placing["machine_of"].view


def upload_drives(drives: Sequence[CueTrace], dt: float, device: Any) -> Any:
    """The kernel's :class:`~.state.Drives`.

    Raises:
        DataError: a drive has another time step than ``dt``.
    """
    for drive in drives:
        if abs(drive.dt - dt) > 1e-6 * dt:
            raise DataError(
                f"{drive.name}: time step is {drive.dt:.6g} s, expected {dt:.6g} s; use resampled({dt})"
            )
    uploaded: Any = Drives()
    fields = {
        "force": [drive.specific_force for drive in drives],
        "rate": [drive.angular_velocity for drive in drives],
        "rate_derivative": [drive.angular_acceleration for drive in drives],
    }
    for name, parts in fields.items():
        setattr(uploaded, name, wp.array(np.concatenate(parts), dtype=vec3, device=device))
    lengths = np.array([len(drive) for drive in drives])
    uploaded.first = wp.array(np.cumsum(lengths) - lengths, dtype=int, device=device)
    uploaded.length = wp.array(lengths, dtype=int, device=device)
    return uploaded


def _indices(name: str, values: ArrayLike | None, default: NDArray[Any], count: int) -> NDArray[np.int32]:
    chosen = np.asarray(default if values is None else values, dtype=np.int32)
    if chosen.ndim != 1 or len(chosen) == 0 or chosen.min() < 0 or chosen.max() >= count:
        raise ConfigurationError(f"{name} must hold indices from 0 to {count - 1}, found {values!r}")
    return chosen


def _finite(name: str, values: ArrayLike, shape: tuple[int, int]) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if not np.isfinite(array).all():
        raise DataError(f"{name} is not finite")
    if array.shape not in (shape, shape[1:]):
        raise DataError(f"{name} has shape {array.shape}, expected {shape} or {shape[1:]}")
    return np.broadcast_to(array, shape)
