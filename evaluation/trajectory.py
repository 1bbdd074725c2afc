"""The trajectory of one drive: cues of car and simulator, motion of the machine, use of its limits."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..envs.cues import CueScale
from ..envs.errors import DataError
from ..envs.limits import parse_json, read_arrays
from ..envs.platform.kernels import ACTUATORS
from ..envs.storage import write_bytes

Floats = NDArray[np.float64]
Flags = NDArray[np.uint8]

SCHEMA: Final = 2
"""Version of the file; version 1, whose arrays have other names, is read, too."""

AT_DISPLACEMENT: Final = 1
"""Bit of :attr:`Trajectory.limits_active`: an actuator brakes before its end of travel, or rests there."""
AT_VELOCITY: Final = 2
"""Bit of :attr:`Trajectory.limits_active`: the velocity limit holds."""
AT_ACCELERATION: Final = 4
"""Bit of :attr:`Trajectory.limits_active`: the acceleration limit holds."""

_COLUMNS: Final[Mapping[str, tuple[int, ...]]] = {
    "time": (),
    "f_reference": (3,),
    "w_reference": (3,),
    "head_f_reference": (3,),
    "f_simulator": (3,),
    "w_simulator": (3,),
    "head_f_simulator": (3,),
    "perceived_f_reference": (3,),
    "perceived_w_reference": (3,),
    "perceived_f_simulator": (3,),
    "perceived_w_simulator": (3,),
    "carriage": (2,),
    "carriage_rate": (2,),
    "hexapod": (6,),
    "hexapod_rate": (6,),
    "turntable": (),
    "turntable_rate": (),
    "legs": (6,),
    "legs_rate": (6,),
    "action": (9,),
    "applied": (9,),
    "limits_active": (9,),
    "step_time": (),
}
_OLD_NAMES: Final[Mapping[str, str]] = {
    "f_reference": "f_wanted",
    "w_reference": "w_wanted",
    "head_f_reference": "head_f_wanted",
    "f_simulator": "f_felt",
    "w_simulator": "w_felt",
    "head_f_simulator": "head_f_felt",
    "perceived_f_reference": "sensed_f_wanted",
    "perceived_w_reference": "sensed_w_wanted",
    "perceived_f_simulator": "sensed_f_felt",
    "perceived_w_simulator": "sensed_w_felt",
}
"""Arrays of version 1."""
_LIMITS: Final = ("position_min", "position_max", "velocity", "acceleration")
_NAMES: Final = ("maneuver", "policy", "platform", "car")


@dataclass(frozen=True, eq=False)
class LimitTable:
    """Limits of the nine actuators, in the order of :data:`ACTUATORS`; infinity where there is none.

    Args:
        position_min: (9,) lowest position relative to neutral: carriage and legs m, turntable rad.
        position_max: (9,) highest position.
        velocity: (9,) largest speed, m/s and rad/s.
        acceleration: (9,) largest acceleration, m/s^2 and rad/s^2.
    """

    position_min: Floats
    position_max: Floats
    velocity: Floats
    acceleration: Floats

    def __post_init__(self) -> None:
        for name in _LIMITS:
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != (len(ACTUATORS),) or np.isnan(array).any():
                raise DataError(f"limits: {name} must be {len(ACTUATORS)} numbers, found shape {array.shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One drive of one policy. Row k is the machine at ``time[k]``; row 0 is the start, before any action.

    Arrays are copied, checked and made read-only. Reference cues are the car's, simulator cues those of
    the cab, at its reference point (F_A, F_S) unless the head is named.
    x forward, y right, z down.

    Args:
        maneuver: Name of the cue trace.
        policy: Name of the policy.
        platform: Name of the motion base.
        car: Name of the car.
        time: (n,) s, strictly increasing.
        f_reference: (n, 3) specific force at the cab point of the car, m/s^2.
        w_reference: (n, 3) angular velocity of the car, rad/s.
        head_f_reference: (n, 3) specific force at the driver's head in the car, m/s^2.
        f_simulator: (n, 3) specific force at the cab point of the simulator, in F_S, m/s^2.
        w_simulator: (n, 3) angular velocity of the cab, in F_S, rad/s.
        head_f_simulator: (n, 3) specific force at the head in the simulator, m/s^2.
        perceived_f_reference: (n, 3) otolith output for the car over the static gain 0.4, m/s^2.
        perceived_w_reference: (n, 3) canal output for the car, rad/s.
        perceived_f_simulator: (n, 3) the same for the simulator.
        perceived_w_simulator: (n, 3) the same for the simulator.
        carriage: (n, 2) position x, y of the carriage, m.
        carriage_rate: (n, 2) m/s.
        hexapod: (n, 6) x, y, z, roll, pitch, yaw from neutral, m and rad.
        hexapod_rate: (n, 6) their rates (Euler rates), m/s and rad/s.
        turntable: (n,) angle, rad.
        turntable_rate: (n,) rad/s.
        legs: (n, 6) extensions from neutral, m.
        legs_rate: (n, 6) m/s.
        action: (n, 9) accelerations requested in the step that ended at this row, by :data:`AXES`;
            m/s^2 and rad/s^2; zero in row 0.
        applied: (n, 9) accelerations that truly acted in that step.
        limits_active: (n, 9) bits :data:`AT_DISPLACEMENT`, :data:`AT_VELOCITY`, :data:`AT_ACCELERATION`
            of each of the :data:`ACTUATORS`.
        step_time: (n,) wall-clock seconds the policy took for the step; NaN in row 0 or where not measured.
        limits: The machine's limits.
        metadata: Versions, parameters and the like, each a string.

    Raises:
        DataError: a shape is wrong, a value is not finite, or time does not increase.
    """

    maneuver: str
    policy: str
    platform: str
    car: str
    time: Floats
    f_reference: Floats
    w_reference: Floats
    head_f_reference: Floats
    f_simulator: Floats
    w_simulator: Floats
    head_f_simulator: Floats
    perceived_f_reference: Floats
    perceived_w_reference: Floats
    perceived_f_simulator: Floats
    perceived_w_simulator: Floats
    carriage: Floats
    carriage_rate: Floats
    hexapod: Floats
    hexapod_rate: Floats
    turntable: Floats
    turntable_rate: Floats
    legs: Floats
    legs_rate: Floats
    action: Floats
    applied: Floats
    limits_active: Flags
    step_time: Floats
    limits: LimitTable
    metadata: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.time))
        if n < 2:
            raise DataError(f"trajectory {self.label}: time has {n} samples, at least 2 are needed")
        for name, tail in _COLUMNS.items():
            object.__setattr__(self, name, _checked(self.label, name, getattr(self, name), (n, *tail)))
        late = np.flatnonzero(np.diff(self.time) <= 0.0)
        if len(late):
            raise DataError(f"trajectory {self.label}: time does not increase at sample {late[0] + 1}")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def label(self) -> str:
        """Maneuver and policy, for messages."""
        return f"{self.maneuver}/{self.policy}"

    @property
    def scale(self) -> CueScale:
        """Motion scale of its reference."""
        return CueScale.parse(self.metadata.get("scale", "1"))

    @property
    def dt(self) -> float:
        """Mean time step, s."""
        return float((self.time[-1] - self.time[0]) / (len(self) - 1))

    @property
    def positions(self) -> Floats:
        """(n, 9) positions of the :data:`ACTUATORS`, m and rad."""
        return np.column_stack([self.carriage, self.legs, self.turntable])

    def part(self, begin: int, end: int) -> Trajectory:
        """The rows from ``begin`` to before ``end``; its first row is a start, at time 0."""
        columns: dict[str, Any] = {name: getattr(self, name)[begin:end].copy() for name in _COLUMNS}
        columns["time"] -= self.time[begin]
        for name in ("action", "applied"):
            columns[name][0] = 0.0
        columns["step_time"][0] = np.nan
        return replace(self, **columns)

    def save(self, path: str | Path) -> None:
        """Write everything to one ``.npz`` file, whole or not at all."""
        arrays: dict[str, Any] = {name: getattr(self, name) for name in _COLUMNS}
        arrays |= {f"limit_{name}": getattr(self.limits, name) for name in _LIMITS}
        about = {name: getattr(self, name) for name in _NAMES}
        about |= {"schema": SCHEMA, "metadata": dict(self.metadata)}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, about=np.array(json.dumps(about)), **arrays)
        write_bytes(path, buffer.getvalue())

    @classmethod
    def load(cls, path: str | Path) -> Trajectory:
        """Read a file that :meth:`save` wrote, in this or an earlier version.

        Raises:
            DataError: the file is missing, broken, or of another version.
        """
        content = _read(path)
        try:
            about = parse_json(str(content.pop("about")))
            if about["schema"] not in (1, SCHEMA):
                raise DataError(
                    f"{path}: trajectory of version {about['schema']!r:.20}, this package reads 1 to {SCHEMA}"
                )
            for name, old in _OLD_NAMES.items():
                if old in content:
                    content[name] = content.pop(old)
            limits = LimitTable(**{name: content.pop(f"limit_{name}") for name in _LIMITS})
            names: dict[str, Any] = {name: str(about[name]) for name in _NAMES}
            columns: dict[str, Any] = {name: content[name] for name in _COLUMNS}
            metadata = {str(name): str(text) for name, text in about["metadata"].items()}
            return cls(**names, **columns, limits=limits, metadata=metadata)
        except DataError:
            raise
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise DataError(f"{path}: not a saved trajectory, or broken ({error})") from None


def _read(path: str | Path) -> dict[str, Any]:
    try:
        return dict(read_arrays(path))
    except DataError as error:
        raise DataError(
            f"{error}; give a .npz file that an evaluation or `motion-cueing serve --log` wrote"
        ) from None


def _checked(label: str, name: str, values: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    kind = np.uint8 if name == "limits_active" else np.float64
    try:
        found = np.asarray(values)
        if found.dtype.kind not in "biuf":
            raise TypeError
        array = np.array(found, dtype=kind)
    except (TypeError, ValueError, OverflowError):
        raise DataError(f"trajectory {label}: {name} is not an array of numbers") from None
    if array.shape != shape:
        raise DataError(f"trajectory {label}: {name} has shape {array.shape}, expected {shape}")
    broken = np.isinf(array) if name == "step_time" else ~np.isfinite(array)
    if broken.any():
        row = int(np.argwhere(broken)[0][0])
        raise DataError(f"trajectory {label}: {name} is not finite at sample {row}")
    array.setflags(write=False)
    return array
