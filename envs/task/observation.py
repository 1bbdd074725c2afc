"""The rows of an environment's observation: the fixed ones, and those added by choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ..cues import GRAVITY, CueTrace
from ..platform.kernels.step import AXES
from ..platform.machines import Platform, Turntable
from ..platform.parameters import axis_reach, neutral_jacobian
from ..simulator.kernels.observation import ROWS, SCALES, Row
from .options import ActionOptions, Mode, ObservationOptions

DIFFERENCE: Final = (
    Row("force_error", 3, 10.0, "m/s^2", "car's specific force minus the cab's"),
    Row("rate_error", 3, 1.0, "rad/s", "car's angular velocity minus the cab's"),
)
"""Rows after :data:`~motion_cueing.envs.simulator.kernels.observation.ROWS`."""

PERCEIVED: Final = (
    Row("perceived_reference_force", 3, 10.0, "m/s^2", "specific force sensed in the car"),
    Row("perceived_reference_rate", 3, 1.0, "rad/s", "angular velocity sensed in the car"),
    Row("perceived_simulator_force", 3, 10.0, "m/s^2", "specific force sensed in the cab"),
    Row("perceived_simulator_rate", 3, 1.0, "rad/s", "angular velocity sensed in the cab"),
)
"""Rows of ``perceived``; forces with gravity at rest taken off z."""

TRUE_MOTION: Final = (
    Row("true_carriage", 2, 10.0, "m", "true carriage x, y"),
    Row("true_carriage_rate", 2, 5.0, "m/s", "their rates"),
    Row("true_displacement", 3, 1.0, "m", "true hexapod x, y, z from neutral"),
    Row("true_velocity", 3, 1.0, "m/s", "their rates"),
    Row("true_beta", 3, 1.0, "rad", "true hexapod roll, pitch, yaw"),
    Row("true_beta_rate", 3, 1.0, "rad/s", "their rates"),
    Row("true_turntable", 2, 1.0, "1", "sine and cosine of the true turntable angle", 1.0),
    Row("true_turntable_rate", 1, 1.0, "rad/s", "true turntable rate"),
)
"""Rows of ``true_motion``."""

MACHINE: Final = (
    Row("carriage_travel", 4, 10.0, "m", "how far carriage x goes down and up, then y"),
    Row("carriage_top_speed", 1, 5.0, "m/s", "its largest speed"),
    Row("carriage_top_acceleration", 1, 10.0, "m/s^2", "its largest acceleration"),
    Row(
        "displacement_reach", 6, 1.0, "m", "how far surge, sway and heave go by themselves, each down and up"
    ),
    Row("beta_reach", 6, 1.0, "rad", "how far roll, pitch and yaw go by themselves, each down and up"),
    Row("hexapod_top_speed", 6, 1.0, "m/s, rad/s", "largest speed of each axis by itself at neutral"),
    Row("hexapod_top_acceleration", 6, 10.0, "m/s^2, rad/s^2", "largest acceleration of each, likewise"),
    Row("turntable_kind", 2, 1.0, "1", "1 for a turntable, 1 for one without ends", 1.0),
    Row("turntable_travel", 2, 5.0, "rad", "how far it turns down and up; one turn where it has no ends"),
    Row("turntable_top_speed", 1, 1.0, "rad/s", "its largest speed"),
    Row("turntable_top_acceleration", 1, 1.0, "rad/s^2", "its largest acceleration"),
)
"""Rows of ``machine`` that do not change; 0 for what the machine does not have."""

TRAVEL_USED: Final = Row("travel_used", 3, 1.0, "1", "carriage x, y and turntable over the end ahead of them")
"""Row of ``machine`` that changes."""

COMMAND: Final = Row("command", 9, 10.0, "m/s^2, rad/s^2", "accelerations last asked for")
"""Row of the action mode "jerk"."""

BASE: Final = Row("base_action", 9, 10.0, "m/s^2, rad/s^2", "accelerations the base policy asks for now")
"""Row of the action mode "residual"."""


def last_action_row(size: int) -> Row:
    """The row after :data:`DIFFERENCE`, of the size of an action."""
    return Row("last_action", size, 1.0, "1", "the last action, clipped", 1.0)


def preview_row(samples: int) -> Row:
    """The row of a preview: six cues a sample, scaled as ``reference_force`` and ``reference_rate``."""
    return Row("preview", 6 * samples, 1.0, "10 m/s^2, rad/s", "car's cues ahead, nearest first")


def memory_row(time_constants: int) -> Row:
    """The row of ``memory``: six low-passed cues a time constant, scaled as those of a preview."""
    return Row("memory", 6 * time_constants, 1.0, "10 m/s^2, rad/s", "car's cues, low-passed")


@dataclass(frozen=True)
class Layout:
    """Where everything lies in an observation.

    Args:
        rows: Of one frame, in order.
        stack: Frames, the newest first.
    """

    rows: tuple[Row, ...]
    stack: int

    @cached_property
    def frame(self) -> int:
        """Entries of one frame."""
        return sum(row.size for row in self.rows)

    @property
    def size(self) -> int:
        """Entries of an observation."""
        return self.frame * self.stack

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Where each row lies in the newest frame."""
        ends = np.cumsum([row.size for row in self.rows])
        return {row.name: slice(int(e) - row.size, int(e)) for row, e in zip(self.rows, ends, strict=True)}

    @cached_property
    def bounds(self) -> NDArray[np.float32]:
        """(size,) greatest absolute value of each entry."""
        frame = np.repeat([row.bound for row in self.rows], [row.size for row in self.rows])
        return np.tile(frame, self.stack).astype(np.float32)

    def first(self, name: str) -> int:
        """Where a row begins, or -1 if it is not there."""
        return self.slices[name].start if name in self.slices else -1


def layout_of(options: ObservationOptions, mode: Mode, action_size: int) -> Layout:
    """The layout that options ask for."""
    rows = [*ROWS, *DIFFERENCE, last_action_row(action_size)]
    if mode == "jerk":
        rows.append(COMMAND)
    if mode == "residual":
        rows.append(BASE)
    if options.preview:
        rows.append(preview_row(options.preview))
    if options.memory:
        rows.append(memory_row(len(options.memory)))
    if options.perceived:
        rows += PERCEIVED
    if options.true_motion:
        rows += TRUE_MOTION
    if options.machine:
        rows += [*MACHINE, TRAVEL_USED]
    return Layout(tuple(rows), options.stack)


# What an action of 1 stands for on a machine.


Floats = NDArray[np.float64]


def acceleration_scale(platform: Platform) -> Floats:
    """(9,) largest acceleration of each axis by itself, m/s^2 and rad/s^2, in the order of ``AXES``.

    Carriage and turntable: their acceleration limits. Hexapod: that of the legs over the largest leg rate
    that unit motion of the axis takes at neutral. Axes of a missing subsystem have 0: they do not move.
    """
    return _axis_limits(platform, "acceleration")


def action_scale(platform: Platform, options: ActionOptions) -> Floats:
    """(9,) acceleration that an action of 1 stands for on a machine, m/s^2, rad/s^2; 0 for missing axes."""
    own = acceleration_scale(platform)
    largest = own if options.largest is None else np.where(own > 0.0, options.largest, 0.0)
    return np.asarray(largest * options.authority)


def velocity_scale(platform: Platform) -> Floats:
    """(9,) largest speed of each axis by itself, m/s and rad/s, found in the same way."""
    return _axis_limits(platform, "velocity")


def _axis_limits(platform: Platform, name: str) -> Floats:
    scale = np.zeros(len(AXES))
    if platform.carriage is not None:
        scale[:2] = getattr(platform.carriage, name)
    scale[2:8] = getattr(platform.hexapod, name) / np.abs(neutral_jacobian(platform.hexapod)).max(axis=0)
    if platform.turntable is not None:
        scale[8] = getattr(platform.turntable, name)
    return scale


def free_axes(frozen: tuple[str, ...]) -> Floats:
    """(9,) 0 for each frozen axis, 1 for the others."""
    return np.array([float(axis not in frozen) for axis in AXES])


# What a policy knows of the past: the car's cues through first-order low-passes.


def low_passed(drives: Sequence[CueTrace], time_constants: Sequence[float], dt: float) -> NDArray[np.float32]:
    """(samples of all drives, 6 per time constant) cues through 1 / (T s + 1), scaled as the observation's.

    Held inputs, discretized exactly: y[k] = p y[k-1] + (1 - p) u[k] with p = exp(-dt / T). Before a drive the
    car is taken to have moved as at its first sample.
    """
    return np.concatenate([_of_drive(drive, time_constants, dt) for drive in drives]).astype(np.float32)


def _of_drive(drive: CueTrace, time_constants: Sequence[float], dt: float) -> NDArray[np.float64]:
    lifted = drive.specific_force + np.array([0.0, 0.0, GRAVITY])
    cues = np.hstack([lifted / SCALES["reference_force"], drive.angular_velocity / SCALES["reference_rate"]])
    columns = [np.zeros((len(cues), 0))]
    for time_constant in time_constants:
        p = np.exp(-dt / time_constant)
        filtered, _ = lfilter([1.0 - p], [1.0, -p], cues, axis=0, zi=p * cues[:1])
        columns.append(filtered)
    return np.hstack(columns)


# What a machine can do, as the numbers of an observation.


_TURN: Final = 2.0 * np.pi
"""Travel that is told of a turntable at most, rad: beyond a turn it hardly matters."""

_HEXAPOD: Final = slice(2, 8)
"""Of the nine axes."""


def ability_of(platform: Platform) -> NDArray[np.float32]:
    """Entries of the rows :data:`~.layout.MACHINE`, in their scales."""
    told = abilities(platform)
    values = [told[row.name] / row.scale for row in MACHINE]
    return np.concatenate(values).astype(np.float32)


def abilities(platform: Platform) -> dict[str, Floats]:
    """The rows :data:`~.layout.MACHINE` by name, in SI units: distances, speeds, accelerations.

    The axes of the hexapod by themselves: how far from neutral, how fast and how suddenly at neutral, as an
    action of 1. What a machine does not have is 0.
    """
    speed, acceleration = velocity_scale(platform), acceleration_scale(platform)
    reach, carriage = axis_reach(platform.hexapod), platform.carriage
    travel = np.zeros(4) if carriage is None else np.abs([*carriage.travel_x, *carriage.travel_y])
    kind, turns = _turntable(platform.turntable)
    return {
        "carriage_travel": travel,
        "carriage_top_speed": speed[:1],
        "carriage_top_acceleration": acceleration[:1],
        "displacement_reach": reach[:3].ravel(),
        "beta_reach": reach[3:].ravel(),
        "hexapod_top_speed": speed[_HEXAPOD],
        "hexapod_top_acceleration": acceleration[_HEXAPOD],
        "turntable_kind": kind,
        "turntable_travel": turns,
        "turntable_top_speed": speed[8:],
        "turntable_top_acceleration": acceleration[8:],
    }


def _turntable(turntable: Turntable | None) -> tuple[Floats, Floats]:
    """Whether there is one, and whether it is without ends; its travel down and up."""
    if turntable is None:
        return np.zeros(2), np.zeros(2)
    if turntable.travel is None:
        return np.ones(2), np.full(2, _TURN)
    return np.array([1.0, 0.0]), np.minimum(np.abs(turntable.travel), _TURN)
