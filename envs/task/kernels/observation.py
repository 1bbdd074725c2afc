"""Observations: which rows an environment shows, where they lie, and how a kernel writes them.

A row is declared once, in :data:`ADDED` (those of every policy in the simulator's ``ROWS``): name, entries,
scale, unit, meaning, bound, and when it is there. Layout, places in the kernel, scales and the table in the
documentation follow from that. :func:`write_frame` writes it, by its name. Entries are float32 in fixed
physical scaling, each clipped to its bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Final, Literal

import numpy as np
import warp as wp
from numpy.typing import NDArray
from pydantic import Field
from scipy.signal import lfilter

from ...arrays import float_rows, pair_array, real, real_rows, vec2, vec3, vec6, vec9
from ...cues import GRAVITY, CueTrace
from ...platform.kernels.step import Machine, Motion
from ...platform.kinematics import axis_reach
from ...platform.machines import Platform, Turntable
from ...settings import Positive, configuration, renamed
from ...simulator.kernels.observation import (
    FIRST,
    ROWS,
    SCALES,
    SLICES,
    TYPICAL,
    Row,
    share_of_limit,
    slices_of,
    write_observation,
)
from ...simulator.kernels.step import Cues, Drives, State, simulator_cues
from .action import Frame, Mode, acceleration_scale, heading, motion_in_cab, to_cab, turned, velocity_scale

Floats = NDArray[np.float64]
SimulatorCueSource = Literal["machine", "model"]
Scaling = Literal["physical", "typical"]


@configuration
class ObservationOptions:
    """What the observation holds beside its fixed rows.

    Args:
        preview: Samples of the car's cues ahead.
        preview_spacing: Time between them, s; rounded to whole time steps.
        perceived: Whether the signals the driver senses, in the car and in the simulator, are added.
        true_motion: Whether the machine's true motion is added; it differs from the set-points where
            actuators lag.
        stack: Observations in one, the newest first; 1 for no stacking.
        memory: Time constants of first-order low-passes of the car's cues, s: what a policy without a memory
            of its own knows of the past.
        frame: Axes of the machine's rows: "machine", or "cab": turned with the cab's heading, so that what
            is ahead of the driver looks the same wherever the turntable stands.
        machine: Whether what the machine can do is added: how far, how fast and how suddenly each axis moves.
            A policy that sees this runs on any machine.
        simulator_cue: Source of the rows of simulator cues. "machine": true motion, by its sensors. "model":
            those of the set-points, which a controller works out by itself. A policy that sees the second
            has no loop through the actuators, so their lag and dead time cannot make it swing.
        scaling: "physical": entries in the scale of their row. "typical": over what they usually are, so that
            all have a deviation of about 1, as neural networks need; fixed numbers, no running statistics.
        against_base: Whether the difference from a machine that the base policy drives alone is added.
        controls: Whether the driver's steering wheel and pedals and the car's speed and slip are added.
        road: Times ahead at which the road is seen, by the present speed, s; none for no road.
        allow_missing: Whether a drive without controls or road is driven all the same: rows that are not
            known are 0 then, and a row says so. Otherwise such a drive is refused.
    """

    preview: Annotated[int, Field(ge=0)] = 0
    preview_spacing: Positive = 0.2
    perceived: bool = False
    true_motion: bool = False
    stack: Annotated[int, Field(ge=1)] = 1
    memory: tuple[Positive, ...] = ()
    frame: Frame = "machine"
    machine: bool = False
    simulator_cue: Annotated[SimulatorCueSource, renamed("simulator_cue", "felt")] = "machine"
    scaling: Scaling = "physical"
    against_base: bool = False
    controls: bool = False
    road: tuple[Positive, ...] = ()
    allow_missing: bool = False

    @property
    def knows(self) -> bool:
        """Whether more is seen of the car than its cues."""
        return self.controls or bool(self.road)


@dataclass(frozen=True)
class Added:
    """A row that follows those of the simulator's observation.

    Args:
        row: What it is; its size is that of one repetition.
        times: Repetitions, 0 where it is not there; for options, mode and entries of an action.
    """

    row: Row
    times: Callable[[ObservationOptions, Mode, int], int]


def _added(times: Callable[[ObservationOptions, Mode, int], int], *rows: Row) -> tuple[Added, ...]:
    return tuple(Added(row, times) for row in rows)


CONTROL_ROWS: Final = (
    Row(
        "steering_wheel",
        1,
        1.0,
        "rad",
        "`observation.controls`: angle of the steering wheel, positive to the right",
        typical=(0.35,),
    ),
    Row("steering_wheel_rate", 1, 1.0, "rad/s", "its rate, through 0.1 s", typical=(0.35,)),
    Row(
        "steered_yaw_rate",
        1,
        1.0,
        "rad/s",
        "yaw rate of the steady turn that this angle asks for in a nominal car",
        typical=(0.07,),
    ),
    Row("steered_force", 1, 10.0, "m/s^2", "lateral acceleration of that turn", typical=(1.0,)),
    Row("pedals", 2, 1.0, "1", "shares of throttle and brake", typical=(0.25, 0.13)),
    Row("pedal_rates", 2, 1.0, "1/s", "their rates, through 0.1 s", typical=(0.3, 0.1)),
    Row("slip_angle", 1, 0.1, "rad", "side slip of the car, positive to the right", typical=(0.01,)),
    Row("controls_known", 1, 1.0, "1", "1 where wheel and pedals are known", 1.0),
)
"""Rows of ``controls``, from the channels :data:`~motion_cueing.envs.cues.CONTROLS` of a drive."""

SPEED_ROWS: Final = (
    Row(
        "speed",
        1,
        30.0,
        "m/s",
        "`observation.controls` or `observation.road`: speed of the car",
        typical=(20.0,),
    ),
    Row("standing", 1, 1.0, "1", "1 where the car stands, falling to 0 at 2 m/s", 1.0, typical=(0.3,)),
)
"""Rows of both."""

ROAD_ROWS: Final = (
    Row(
        "road_force",
        1,
        10.0,
        "m/s^2",
        "`observation.road`: v^2 kappa of the road ahead at the present speed, saturating at 6 m/s^2; one "
        "entry for each time ahead",
        entries="1 each",
        typical=(0.8,),
    ),
    Row("road_curvature", 1, 0.1, "1/m", "its curvature, likewise", entries="1 each", typical=(0.005,)),
    Row(
        "road_grade",
        1,
        0.1,
        "rad",
        "its slope, positive uphill, likewise",
        entries="1 each",
        typical=(0.015,),
    ),
    Row(
        "road_bank",
        1,
        0.1,
        "rad",
        "its cross slope, right side down positive, likewise",
        entries="1 each",
        typical=(0.02,),
    ),
    Row(
        "road_speed",
        1,
        10.0,
        "m/s",
        "its speed limit less the present speed, likewise",
        entries="1 each",
        typical=(11.0,),
    ),
    Row(
        "road_braking",
        3,
        10.0,
        "m/s^2",
        "deceleration to be in time for: the next stop, bends at 3 m/s^2, a lower limit",
        typical=(1.6, 0.9, 0.5),
    ),
    Row("stop_ahead", 1, 1.0, "1", "1 at a stop, falling to 0 at 100 m before it", 1.0, typical=(0.4,)),
    Row("road_known", 1, 1.0, "1", "1 where the map is there", 1.0),
)
"""Rows of ``road``, from the :class:`~motion_cueing.envs.road.RoadMap` of a drive."""

EACH_TIME: Final = 5
"""Of them, those with an entry for each time ahead."""

MACHINE: Final = (
    Row(
        "carriage_travel", 4, 10.0, "m", "`observation.machine`: how far carriage x goes down and up, then y"
    ),
    Row("carriage_top_speed", 1, 5.0, "m/s", "its largest speed"),
    Row("carriage_top_acceleration", 1, 10.0, "m/s^2", "its largest acceleration"),
    Row(
        "displacement_reach",
        6,
        1.0,
        "m",
        "how far surge, sway and heave go from neutral by themselves, each down and up",
    ),
    Row("beta_reach", 6, 1.0, "rad", "the same of roll, pitch and yaw"),
    Row("hexapod_top_speed", 6, 1.0, "m/s, rad/s", "largest speed of surge to yaw by themselves at neutral"),
    Row("hexapod_top_acceleration", 6, 10.0, "m/s^2, rad/s^2", "their largest accelerations, likewise"),
    Row("turntable_kind", 2, 1.0, "1", "1 for a turntable, 1 for one without ends", 1.0),
    Row(
        "turntable_travel",
        2,
        5.0,
        "rad",
        "how far it turns down and up; one turn where it has no ends, and at most",
    ),
    Row("turntable_top_speed", 1, 1.0, "rad/s", "its largest speed"),
    Row("turntable_top_acceleration", 1, 1.0, "rad/s^2", "its largest acceleration"),
)
"""Rows of ``machine`` that do not change; 0 for what the machine does not have. See :func:`abilities`."""

_TYPICAL_CUE: Final = (0.15, 0.12, 0.03, 0.03, 0.02, 0.09)
"""Of `reference_force`, in its scale, and `reference_rate`."""

COMPARED: Final = slice(SLICES["simulator_force"].start, SLICES["beta_rate"].stop)
"""Entries of which the row ``against_base`` is the difference."""

_TYPICAL_DIFFERENCE: Final = tuple(
    # Differences are about a quarter of what is usual on the road.
    0.25 * usual / row.scale
    for row in ROWS
    if COMPARED.start <= SLICES[row.name].start < COMPARED.stop
    for usual in row.typical or (row.scale,) * row.size
)

ADDED: Final = (
    *_added(
        lambda seen, mode, action: 1,
        Row(
            "force_error",
            3,
            10.0,
            "m/s^2",
            "car's specific force minus the cab's",
            typical=(0.75, 0.65, 0.35),
        ),
        Row(
            "rate_error",
            3,
            1.0,
            "rad/s",
            "car's angular velocity minus the cab's",
            typical=(0.05, 0.05, 0.02),
        ),
    ),
    *_added(
        lambda seen, mode, action: action,
        Row(
            "last_action", 1, 1.0, "1", "the last action, clipped; as many entries as an action has", 1.0, "9"
        ),
    ),
    *_added(
        lambda seen, mode, action: mode == "jerk",
        Row(
            "command",
            9,
            10.0,
            "m/s^2, rad/s^2",
            '`action.mode` "jerk": accelerations last asked for',
            typical=TYPICAL["acceleration"],
        ),
    ),
    *_added(
        lambda seen, mode, action: mode == "residual",
        Row(
            "base_action",
            9,
            10.0,
            "m/s^2, rad/s^2",
            '`action.mode` "residual": accelerations the base policy asks for now',
            typical=TYPICAL["acceleration"],
        ),
    ),
    *_added(
        lambda seen, mode, action: seen.preview,
        Row(
            "preview",
            6,
            1.0,
            "10 m/s^2, rad/s",
            "`observation.preview`: car's cues ahead, nearest first, as `reference_force` and "
            "`reference_rate`; the last cue after the end",
            entries="6 each",
            typical=_TYPICAL_CUE,
        ),
    ),
    *_added(
        lambda seen, mode, action: len(seen.memory),
        Row(
            "memory",
            6,
            1.0,
            "10 m/s^2, rad/s",
            "`observation.memory`: car's cues through 1/(Ts + 1), for each time constant T, in the order of "
            "`preview`",
            entries="6 each",
            typical=_TYPICAL_CUE,
        ),
    ),
    *_added(
        lambda seen, mode, action: seen.perceived,
        Row(
            "perceived_reference_force",
            3,
            10.0,
            "m/s^2",
            "`observation.perceived`: specific force perceived in the car",
            typical=TYPICAL["reference_force"],
        ),
        Row(
            "perceived_reference_rate",
            3,
            1.0,
            "rad/s",
            "angular velocity perceived in the car",
            typical=TYPICAL["reference_rate"],
        ),
        Row(
            "perceived_simulator_force",
            3,
            10.0,
            "m/s^2",
            "specific force perceived in the cab",
            typical=TYPICAL["simulator_force"],
        ),
        Row(
            "perceived_simulator_rate",
            3,
            1.0,
            "rad/s",
            "angular velocity perceived in the cab",
            typical=TYPICAL["simulator_rate"],
        ),
    ),
    *_added(
        lambda seen, mode, action: seen.true_motion,
        Row(
            "true_carriage",
            2,
            10.0,
            "m",
            "`observation.true_motion`: carriage x, y after lag and dead time",
            typical=TYPICAL["carriage"],
        ),
        Row("true_carriage_rate", 2, 5.0, "m/s", "their rates", typical=TYPICAL["carriage_rate"]),
        Row("true_displacement", 3, 1.0, "m", "hexapod x, y, z", typical=TYPICAL["displacement"]),
        Row("true_velocity", 3, 1.0, "m/s", "their rates", typical=TYPICAL["velocity"]),
        Row("true_beta", 3, 1.0, "rad", "hexapod roll, pitch, yaw", typical=TYPICAL["beta"]),
        Row("true_beta_rate", 3, 1.0, "rad/s", "their rates", typical=TYPICAL["beta_rate"]),
        Row("true_turntable", 2, 1.0, "1", "sine and cosine of the turntable's angle", 1.0),
        Row("true_turntable_rate", 1, 1.0, "rad/s", "turntable rate", typical=TYPICAL["turntable_rate"]),
    ),
    *_added(
        lambda seen, mode, action: seen.machine,
        *MACHINE,
        Row("travel_used", 3, 1.0, "1", "carriage x, y and turntable over the end ahead of them"),
    ),
    *_added(
        lambda seen, mode, action: seen.against_base,
        Row(
            "against_base",
            COMPARED.stop - COMPARED.start,
            1.0,
            "as theirs",
            "`observation.against_base`: the rows from simulator_force to beta_rate, less those of a machine "
            "that the base policy drives alone",
            typical=_TYPICAL_DIFFERENCE,
        ),
    ),
    # These are contiguous: the columns of ``knowledge.known_rows``.
    *_added(lambda seen, mode, action: seen.controls, *CONTROL_ROWS),
    *_added(lambda seen, mode, action: seen.knows, *SPEED_ROWS),
    *_added(lambda seen, mode, action: len(seen.road), *ROAD_ROWS[:EACH_TIME]),
    *_added(lambda seen, mode, action: bool(seen.road), *ROAD_ROWS[EACH_TIME:]),
)
"""The rows after :data:`~motion_cueing.envs.simulator.kernels.observation.ROWS`, in order."""

UNIT: Final = {row.name: real(row.scale) for row in (*ROWS, *(added.row for added in ADDED))}
"""Scale of each row, for kernels."""


_LARGEST_TYPICAL: Final = 10.0
"""Greatest absolute value of an entry over what it usually is."""


@dataclass(frozen=True)
class Layout:
    """Where everything lies in an observation.

    Args:
        rows: Of one frame, in order.
        stack: Frames, the newest first.
        scaling: Of the entries.
    """

    rows: tuple[Row, ...]
    stack: int
    scaling: Scaling = "physical"

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
        return slices_of(self.rows)

    @cached_property
    def bounds(self) -> NDArray[np.float32]:
        """(size,) greatest absolute value of each entry, as it is shown."""
        if self.scaling == "typical":
            return np.full(self.size, _LARGEST_TYPICAL, dtype=np.float32)
        frame = np.repeat([row.bound for row in self.rows], [row.size for row in self.rows])
        return np.tile(frame, self.stack).astype(np.float32)

    @cached_property
    def gains(self) -> NDArray[np.float32]:
        """(size,) factor from the physical scale of each entry to the one it is shown in."""
        gains = np.ones(self.frame)
        if self.scaling == "typical":
            rows = [(row, row.typical or (row.scale,)) for row in self.rows]
            gains = np.concatenate(
                [row.scale / np.tile(typical, row.size // len(typical)) for row, typical in rows]
            )
        return np.tile(gains, self.stack).astype(np.float32)

    def first(self, name: str) -> int:
        """Where a row begins, or -1 if it is not there."""
        return self.slices[name].start if name in self.slices else -1


def layout_of(options: ObservationOptions, mode: Mode, action_size: int) -> Layout:
    """The layout that options ask for."""
    rows = list(ROWS)
    for added in ADDED:
        times = int(added.times(options, mode, action_size))
        if times:
            rows.append(replace(added.row, size=times * added.row.size))
    return Layout(tuple(rows), options.stack, options.scaling)


SIMULATOR_FORCE, SIMULATOR_RATE = wp.constant(FIRST["simulator_force"]), wp.constant(FIRST["simulator_rate"])
REFERENCE_FORCE, REFERENCE_RATE = wp.constant(FIRST["reference_force"]), wp.constant(FIRST["reference_rate"])


def observation_table() -> str:
    """Every row an observation can have, as a table in Markdown."""
    lines = ["| Row | Entries | Unit | Scale | Typical | Bound | Meaning |", "|---|---|---|---|---|---|---|"]
    for row in (*ROWS, *(added.row for added in ADDED)):
        entries = row.entries or str(row.size)
        typical = ", ".join(f"{value:g}" for value in row.typical or (row.scale,))
        cells = [f"`{row.name}`", entries, row.unit, f"{row.scale:g}", typical, f"{row.bound:g}", row.meaning]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


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


_TURN: Final = 2.0 * np.pi
"""Travel of a turntable that is shown at most, rad: beyond a turn it hardly matters."""

_HEXAPOD: Final = slice(2, 8)
"""Of the nine axes."""


def ability_of(platform: Platform) -> NDArray[np.float32]:
    """Entries of the rows :data:`MACHINE`, in their scales."""
    known = abilities(platform)
    values = [known[row.name] / row.scale for row in MACHINE]
    return np.concatenate(values).astype(np.float32)


def abilities(platform: Platform) -> dict[str, Floats]:
    """The rows :data:`MACHINE` by name, in SI units: distances, speeds, accelerations.

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


@wp.struct
class Episode:
    """Constants of one episode."""

    last: int  # sample of the drive at which it is truncated
    noise: int  # seed of the sensor noise
    force_gain: real  # of the cab's accelerometers
    rate_gain: real  # of its gyroscopes
    actuator_gain: vec9
    cost_scale: real  # rewards are divided by


Firsts: Any = wp.struct(
    type("Firsts", (), {"__module__": __name__, "__annotations__": {added.row.name: int for added in ADDED}})
)
"""Where each added row begins in a frame, -1 for one that is not there."""


rows6: Any = wp.array(dtype=vec6)
"""Six cues a sample."""


@wp.struct
class View:
    """The kernel's form of a layout and of how it is filled."""

    frame: int  # entries of a frame
    first: Firsts
    known: int  # first entry of what is known beside the cues, -1 for nothing
    expected: int  # entries of the expected cues, the last columns of what is known; 0 for the true ones
    preview_samples: int
    preview_stride: int  # time steps between samples
    cab_frame: int  # whether the machine's rows are turned with the cab's heading
    modeled: int  # whether the cab's cues are those of the set-points
    force_noise: real  # m/s^2
    rate_noise: real  # rad/s
    sensed: int  # whether the car's cues are seen by sensors with errors
    sensed_cues: rows6  # their cues, of every sample of every drive, f lifted and omega
    abilities: float_rows  # what each machine can do, the constant rows


def lifted_cues(drives: Sequence[CueTrace]) -> NDArray[np.float64]:
    """(samples of all drives, 6) specific force with gravity at rest taken off z, m/s^2, and rates, rad/s."""
    lift = np.array([0.0, 0.0, GRAVITY, 0.0, 0.0, 0.0])
    return np.concatenate(
        [np.hstack((drive.specific_force, drive.angular_velocity)) + lift for drive in drives]
    )


def view_of(layout: Layout, seen: ObservationOptions, dt: float, noise: tuple[float, float]) -> Any:
    """The kernel's form of a layout, but for what machines can do.

    ``noise`` has the standard deviations of specific force, m/s^2, and angular velocity, rad/s, in the cab.
    """
    view: Any = View()
    view.frame = layout.frame
    for added in ADDED:
        setattr(view.first, added.row.name, layout.first(added.row.name))
    known = [layout.first(row.name) for row in (*CONTROL_ROWS, *SPEED_ROWS)]
    view.known = min((first for first in known if first >= 0), default=-1)
    view.preview_samples = seen.preview
    view.preview_stride = max(1, round(seen.preview_spacing / dt))
    view.cab_frame, view.modeled = int(seen.frame == "cab"), int(seen.simulator_cue == "model")
    view.force_noise, view.rate_noise = noise
    return view


@wp.func
def put_entry(out: float_rows, i: int, k: int, value: real, bounds: pair_array) -> int:
    """Write an entry, times its factor, clipped to its bound."""
    # Once only: an entry that is written twice would count twice in the adjoint.
    pair = bounds[k]
    out[i, k] = wp.clamp(wp.float32(value) * pair[1], -pair[0], pair[0])
    return 0


@wp.func
def put_vector(
    out: float_rows, i: int, first: int, value: Any, size: int, scale: real, bounds: pair_array
) -> int:
    """Write the ``size`` entries of a row that begins at ``first``."""
    for k in range(size):
        put_entry(out, i, first + k, value[k] / scale, bounds)
    return 0


@wp.func
def lifted(force: vec3) -> vec3:
    """A specific force, gravity at rest taken off z."""
    return force + vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))


@wp.func
def put_measured(
    v: View, e: Episode, sample: int, fixed: real_rows, bounds: pair_array, out: float_rows, i: int
) -> int:
    """Write the simulator's rows, the cab's cues with the errors of its sensors, and the cues' errors."""
    # A generator of its own for each sample: an observation does not depend on how often it is made.
    random = wp.rand_init(e.noise, sample)
    noisy = v.force_noise + v.rate_noise > real(0.0) and v.modeled == 0
    force_gain = real(1.0)
    rate_gain = real(1.0)
    if v.modeled == 0:
        force_gain = e.force_gain
        rate_gain = e.rate_gain
    # Everything but the cab's cues, which are written once, below.
    for k in range(wp.static(min(FIRST["simulator_force"], FIRST["simulator_rate"]))):
        put_entry(out, i, k, fixed[i, k], bounds)
    for k in range(
        wp.static(min(FIRST["simulator_force"], FIRST["simulator_rate"]) + 3),
        wp.static(max(FIRST["simulator_force"], FIRST["simulator_rate"])),
    ):
        put_entry(out, i, k, fixed[i, k], bounds)
    for k in range(wp.static(max(FIRST["simulator_force"], FIRST["simulator_rate"]) + 3), fixed.shape[1]):
        put_entry(out, i, k, fixed[i, k], bounds)
    for k in range(3):
        force_noise = real(0.0)
        rate_noise = real(0.0)
        if noisy:
            force_noise = v.force_noise / wp.static(UNIT["simulator_force"]) * real(wp.randn(random))
            rate_noise = v.rate_noise / wp.static(UNIT["simulator_rate"]) * real(wp.randn(random))
        force = fixed[i, SIMULATOR_FORCE + k] * force_gain + force_noise
        rate = fixed[i, SIMULATOR_RATE + k] * rate_gain + rate_noise
        put_entry(out, i, SIMULATOR_FORCE + k, force, bounds)
        put_entry(out, i, SIMULATOR_RATE + k, rate, bounds)
        put_entry(out, i, v.first.force_error + k, fixed[i, REFERENCE_FORCE + k] - force, bounds)
        put_entry(out, i, v.first.rate_error + k, fixed[i, REFERENCE_RATE + k] - rate, bounds)
    return 0


@wp.func
def put_preview(
    v: View, drives: Drives, drive: int, sample: int, bounds: pair_array, out: float_rows, i: int
) -> int:
    """Write the true cues of the car ahead, the last one of the drive after its end."""
    first = drives.first[drive]
    last = drives.length[drive] - 1
    for j in range(v.preview_samples):
        ahead = first + wp.min(sample + (j + 1) * v.preview_stride, last)
        k = v.first.preview + 6 * j
        put_vector(out, i, k, lifted(drives.force[ahead]), 3, wp.static(UNIT["reference_force"]), bounds)
        put_vector(out, i, k + 3, drives.rate[ahead], 3, wp.static(UNIT["reference_rate"]), bounds)
    return 0


@wp.func
def put_perceived(f: Firsts, s: State, bounds: pair_array, out: float_rows, i: int) -> int:
    """Write the perceived cues."""
    car = s.perceived_reference
    cab = s.perceived_simulator
    car_force = wp.static(UNIT["perceived_reference_force"])
    cab_force = wp.static(UNIT["perceived_simulator_force"])
    car_rate = wp.static(UNIT["perceived_reference_rate"])
    cab_rate = wp.static(UNIT["perceived_simulator_rate"])
    put_vector(out, i, f.perceived_reference_force, lifted(car.force), 3, car_force, bounds)
    put_vector(out, i, f.perceived_reference_rate, car.rate, 3, car_rate, bounds)
    put_vector(out, i, f.perceived_simulator_force, lifted(cab.force), 3, cab_force, bounds)
    put_vector(out, i, f.perceived_simulator_rate, cab.rate, 3, cab_rate, bounds)
    return 0


@wp.func
def put_true_motion(f: Firsts, m: Motion, bounds: pair_array, out: float_rows, i: int) -> int:
    """Write the true motion."""
    turntable = vec2(wp.sin(m.position[8]), wp.cos(m.position[8]))
    put_vector(out, i, f.true_carriage, m.position, 2, wp.static(UNIT["true_carriage"]), bounds)
    put_vector(out, i, f.true_carriage_rate, m.rate, 2, wp.static(UNIT["true_carriage_rate"]), bounds)
    put_vector(out, i, f.true_displacement, m.displacement, 3, wp.static(UNIT["true_displacement"]), bounds)
    put_vector(out, i, f.true_velocity, m.velocity, 3, wp.static(UNIT["true_velocity"]), bounds)
    put_vector(out, i, f.true_beta, m.beta, 3, wp.static(UNIT["true_beta"]), bounds)
    put_vector(out, i, f.true_beta_rate, m.beta_rate, 3, wp.static(UNIT["true_beta_rate"]), bounds)
    put_vector(out, i, f.true_turntable, turntable, 2, wp.static(UNIT["true_turntable"]), bounds)
    put_entry(out, i, f.true_turntable_rate, m.rate[8] / wp.static(UNIT["true_turntable_rate"]), bounds)
    return 0


@wp.func
def put_machine(
    v: View, which: int, m: Machine, setpoint: Motion, bounds: pair_array, out: float_rows, i: int
) -> int:
    """Write what the machine can do, constants of the batch, and the shares of travel it uses."""
    for k in range(v.abilities.shape[1]):
        put_entry(out, i, v.first.carriage_travel + k, real(v.abilities[which, k]), bounds)
    p = setpoint.position
    used = vec2(
        share_of_limit(p[0], m.position_min[0], m.position_max[0]),
        share_of_limit(p[1], m.position_min[1], m.position_max[1]),
    )
    if v.cab_frame != 0:
        used = turned(used[0], used[1], heading(setpoint))
    turntable = share_of_limit(p[8], m.position_min[8], m.position_max[8])
    put_entry(out, i, v.first.travel_used, used[0], bounds)
    put_entry(out, i, v.first.travel_used + 1, used[1], bounds)
    put_entry(out, i, v.first.travel_used + 2, turntable, bounds)
    return 0


@wp.func
def shift_frames(out: float_rows, i: int, frame: int) -> int:
    """Make room for a new frame before the older ones."""
    size = out.shape[1]
    for k in range(size - frame):
        out[i, size - 1 - k] = out[i, size - 1 - k - frame]
    return 0


@wp.func
def repeat_frame(out: float_rows, i: int, frame: int) -> int:
    """Fill the older frames with the newest."""
    for k in range(out.shape[1] - frame):
        out[i, frame + k] = out[i, k]
    return 0


@wp.func
def axes_in_view(v: View, m: Motion, values: vec9) -> vec9:
    """Values of the axes in the frame of the observation."""
    if v.cab_frame != 0:
        return to_cab(m, values)
    return values


@wp.func
def motion_in_view(v: View, m: Motion) -> Motion:
    """A motion in the frame of the observation."""
    if v.cab_frame != 0:
        return motion_in_cab(m)
    return m


@wp.func
def acceleration_in_view(v: View, s: State) -> vec9:
    """The acceleration shown, of the true motion or of the set-points, in the machine's frame."""
    if v.modeled != 0:
        return s.setpoint_acceleration
    return s.acceleration


@wp.func
def cues_in_view(v: View, m: Machine, s: State) -> Cues:
    """The cab's cues shown: those of the true motion, or those of the set-points."""
    if v.modeled != 0:
        return simulator_cues(m, s.setpoint, s.setpoint_acceleration)
    return s.simulator_cue


@wp.func
def write_frame(
    v: View,
    drives: Drives,
    drive: int,
    e: Episode,
    which: int,
    machine: Machine,
    s: State,
    fixed: real_rows,
    now: float_rows,
    command: vec9,
    base: vec9,
    memory: float_rows,
    known: float_rows,
    bounds: pair_array,
    out: float_rows,
    i: int,
) -> int:
    """Write the newest frame of an environment's observation, each row that is there.

    ``which`` is the number of the machine; ``fixed`` gets the simulator's rows the frame is made of.
    """
    f = v.first
    acceleration = axes_in_view(v, s.setpoint, acceleration_in_view(v, s))
    motion = motion_in_view(v, s.setpoint)
    write_observation(machine, s, motion, acceleration, cues_in_view(v, machine, s), fixed, i)
    if v.sensed != 0:
        seen = v.sensed_cues[drives.first[drive] + wp.min(s.sample, drives.length[drive] - 1)]
        for k in range(3):
            fixed[i, REFERENCE_FORCE + k] = seen[k] / wp.static(UNIT["reference_force"])
            fixed[i, REFERENCE_RATE + k] = seen[3 + k] / wp.static(UNIT["reference_rate"])
    put_measured(v, e, s.sample, fixed, bounds, out, i)
    for k in range(now.shape[1]):
        put_entry(out, i, f.last_action + k, real(now[i, k]), bounds)
    if f.command >= 0:
        put_vector(out, i, f.command, command, 9, wp.static(UNIT["command"]), bounds)
    if f.base_action >= 0:
        added = axes_in_view(v, s.setpoint, base)
        put_vector(out, i, f.base_action, added, 9, wp.static(UNIT["base_action"]), bounds)
    if f.preview >= 0:
        if v.expected > 0:
            row = drives.first[drive] + wp.min(s.sample, drives.length[drive] - 1)
            for k in range(v.expected):
                put_entry(out, i, f.preview + k, real(known[row, known.shape[1] - v.expected + k]), bounds)
        else:
            put_preview(v, drives, drive, s.sample, bounds, out, i)
    if f.memory >= 0:
        row = drives.first[drive] + wp.min(s.sample, drives.length[drive] - 1)
        for k in range(memory.shape[1]):
            put_entry(out, i, f.memory + k, real(memory[row, k]), bounds)
    if v.known >= 0:
        row = drives.first[drive] + wp.min(s.sample, drives.length[drive] - 1)
        for k in range(known.shape[1] - v.expected):
            put_entry(out, i, v.known + k, real(known[row, k]), bounds)
    if f.perceived_reference_force >= 0:
        put_perceived(f, s, bounds, out, i)
    if f.true_carriage >= 0:
        put_true_motion(f, motion_in_view(v, s.motion), bounds, out, i)
    if f.carriage_travel >= 0:
        put_machine(v, which, machine, s.setpoint, bounds, out, i)
    return v.frame
