"""The rows of an environment's observation: the fixed ones, and those added by choice."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..observation import ROWS, Row
from .options import Mode, ObservationOptions

DIFFERENCE: Final = (
    Row("force_error", 3, 10.0, "m/s^2", "car's specific force minus the cab's"),
    Row("rate_error", 3, 1.0, "rad/s", "car's angular velocity minus the cab's"),
)
"""Rows after :data:`~motion_cueing.envs.observation.ROWS`."""

PERCEIVED: Final = (
    Row("sensed_wanted_force", 3, 10.0, "m/s^2", "specific force sensed in the car"),
    Row("sensed_wanted_rate", 3, 1.0, "rad/s", "angular velocity sensed in the car"),
    Row("sensed_felt_force", 3, 10.0, "m/s^2", "specific force sensed in the cab"),
    Row("sensed_felt_rate", 3, 1.0, "rad/s", "angular velocity sensed in the cab"),
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
    """The row of a preview: six cues a sample, each in the scale of ``wanted_force`` and ``wanted_rate``."""
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
