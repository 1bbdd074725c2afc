"""The simulator's observation: one flat row an environment, in fixed physical scaling.

Reference cues now, simulator cues, and the machine's state. The machine's rows are its set-points, on which
the limits act and which a controller steers; without actuator dynamics they are the true motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ...arrays import int_array, real, real_rows, vec2, vec3, vec6, vec9
from ...cues import GRAVITY
from ...platform.kernels.step import Machine, Motion
from .step import Cues, State


@dataclass(frozen=True)
class Row:
    """Some entries of an observation.

    Args:
        name: What they are.
        size: How many.
        scale: What one unit of the entry stands for, in ``unit``.
        unit: SI unit.
        meaning: For people.
        bound: Greatest absolute value an environment's observation shows; what exceeds it is clipped.
        entries: Their number in words, where options decide it.
        typical: Root mean square of each entry, or of all, in ``unit``: on random drives under the linear
            washout, rounded (``python -m benchmarks.typical_rows``). None: as ``scale``.
    """

    name: str
    size: int
    scale: float
    unit: str
    meaning: str
    bound: float = 10.0
    entries: str = ""
    typical: tuple[float, ...] | None = None


ROWS: Final = (
    Row(
        "reference_force",
        3,
        10.0,
        "m/s^2",
        "car's specific force, gravity at rest taken off z",
        typical=(1.5, 1.2, 0.3),
    ),
    Row("reference_rate", 3, 1.0, "rad/s", "car's angular velocity", typical=(0.03, 0.02, 0.09)),
    Row(
        "simulator_force",
        3,
        10.0,
        "m/s^2",
        "specific force at the cab's reference point, as reference_force",
        typical=(1.3, 1.1, 0.2),
    ),
    Row("simulator_rate", 3, 1.0, "rad/s", "angular velocity of the cab", typical=(0.05, 0.05, 0.09)),
    Row("carriage", 2, 10.0, "m", "carriage x, y", typical=(5.0, 3.0)),
    Row("carriage_rate", 2, 5.0, "m/s", "their rates", typical=(1.1, 0.8)),
    Row("displacement", 3, 1.0, "m", "hexapod x, y, z from neutral", typical=(0.04, 0.03, 0.06)),
    Row("velocity", 3, 1.0, "m/s", "their rates", typical=(0.03, 0.03, 0.02)),
    Row("beta", 3, 1.0, "rad", "hexapod roll, pitch, yaw", typical=(0.06, 0.1, 0.03)),
    Row("beta_rate", 3, 1.0, "rad/s", "their rates", typical=(0.05, 0.05, 0.02)),
    Row("turntable", 2, 1.0, "1", "sine and cosine of the turntable's angle", 1.0),
    Row("turntable_rate", 1, 1.0, "rad/s", "turntable rate", typical=(0.09,)),
    Row("legs", 6, 1.0, "1", "leg extensions over the limit they move towards", 1.0, typical=(0.2,)),
    Row("leg_rates", 6, 1.0, "1", "leg speeds over their limit", typical=(0.08,)),
    Row(
        "acceleration",
        9,
        10.0,
        "m/s^2, rad/s^2",
        "accelerations of the last step",
        typical=(0.9, 0.9, 0.15, 0.15, 0.05, 0.3, 0.25, 0.03, 0.1),
    ),
)
"""The rows of an observation, in order."""

TYPICAL: Final = {row.name: row.typical for row in ROWS}
"""What the entries of each row usually are, in its SI unit."""

OBSERVATION_SIZE: Final = sum(row.size for row in ROWS)
"""Entries of an observation."""


def slices_of(rows: Sequence[Row]) -> dict[str, slice]:
    """Where each of consecutive rows lies."""
    ends = np.cumsum([row.size for row in rows])
    return {row.name: slice(int(e) - row.size, int(e)) for row, e in zip(rows, ends, strict=True)}


SLICES: Final = slices_of(ROWS)
"""Where each row lies in an observation."""

SCALES: Final = {row.name: row.scale for row in ROWS}
"""What one unit of each row stands for, in its SI unit."""


FIRST: Final = {name: where.start for name, where in SLICES.items()}
UNIT: Final = {name: real(scale) for name, scale in SCALES.items()}
"""Begin and scale of each row, for kernels."""


def read(observation: NDArray[Any], name: str) -> NDArray[np.float64]:
    """A row of one or many observations in SI units, (..., size)."""
    return np.asarray(observation[..., SLICES[name]] * SCALES[name], dtype=np.float64)


@wp.func
def put(out: real_rows, i: int, first: int, value: Any, size: int, scale: real) -> int:
    """Write the ``size`` entries of a row that begins at ``first``."""
    for k in range(size):
        out[i, first + k] = value[k] / scale
    return 0


@wp.func
def share_of_limit(value: real, lower: real, upper: real) -> real:
    """A position over the limit it moves towards, within [-1, 1]."""
    if value >= real(0.0):
        return value / wp.max(upper, real(1e-9))
    return -value / wp.min(lower, real(-1e-9))


@wp.func
def write_observation(
    m: Machine, s: State, p: Motion, acceleration: vec9, cues: Cues, out: real_rows, i: int
) -> int:
    """One environment's observation: each row at its place in :data:`ROWS`.

    ``p`` are the machine's set-points and ``acceleration`` its acceleration, in the observation's frame;
    ``cues`` are those of the cab.
    """
    gravity = vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))
    reference = s.reference_cue.force + gravity
    simulated = cues.force + gravity
    legs = vec6()
    leg_rates = vec6()
    for leg in range(6):
        j = leg + 2
        legs[leg] = share_of_limit(p.position[j], m.position_min[j], m.position_max[j])
        leg_rates[leg] = p.rate[j] / m.velocity[j]
    turntable = vec2(wp.sin(p.position[8]), wp.cos(p.position[8]))
    turntable_rate = vec2(p.rate[8], real(0.0))
    put(out, i, wp.static(FIRST["reference_force"]), reference, 3, wp.static(UNIT["reference_force"]))
    put(
        out, i, wp.static(FIRST["reference_rate"]), s.reference_cue.rate, 3, wp.static(UNIT["reference_rate"])
    )
    put(out, i, wp.static(FIRST["simulator_force"]), simulated, 3, wp.static(UNIT["simulator_force"]))
    put(out, i, wp.static(FIRST["simulator_rate"]), cues.rate, 3, wp.static(UNIT["simulator_rate"]))
    put(out, i, wp.static(FIRST["carriage"]), p.position, 2, wp.static(UNIT["carriage"]))
    put(out, i, wp.static(FIRST["carriage_rate"]), p.rate, 2, wp.static(UNIT["carriage_rate"]))
    put(out, i, wp.static(FIRST["displacement"]), p.displacement, 3, wp.static(UNIT["displacement"]))
    put(out, i, wp.static(FIRST["velocity"]), p.velocity, 3, wp.static(UNIT["velocity"]))
    put(out, i, wp.static(FIRST["beta"]), p.beta, 3, wp.static(UNIT["beta"]))
    put(out, i, wp.static(FIRST["beta_rate"]), p.beta_rate, 3, wp.static(UNIT["beta_rate"]))
    put(out, i, wp.static(FIRST["turntable"]), turntable, 2, wp.static(UNIT["turntable"]))
    put(out, i, wp.static(FIRST["turntable_rate"]), turntable_rate, 1, wp.static(UNIT["turntable_rate"]))
    put(out, i, wp.static(FIRST["legs"]), legs, 6, wp.static(UNIT["legs"]))
    put(out, i, wp.static(FIRST["leg_rates"]), leg_rates, 6, wp.static(UNIT["leg_rates"]))
    put(out, i, wp.static(FIRST["acceleration"]), acceleration, 9, wp.static(UNIT["acceleration"]))
    return 0


def observe_kernel(
    machines: wp.array(dtype=Machine), machine_of: int_array, state: wp.array(dtype=State), out: real_rows
) -> None:
    """Observation of every environment."""
    i = wp.tid()
    s = state[i]
    write_observation(machines[machine_of[i]], s, s.setpoint, s.acceleration, s.simulator_cue, out, i)


observe_forward = wp.kernel(observe_kernel, enable_backward=False, module="unique")
"""The observation without its adjoint."""
