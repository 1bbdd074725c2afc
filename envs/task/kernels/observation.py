"""Entries of an observation: float32, each clipped to its bound."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import warp as wp
from numpy.typing import NDArray

from ...arrays import real, vec2, vec3, vec9
from ...cues import GRAVITY
from ...platform.kernels.step import Machine, Motion
from ...platform.machines import Platform
from ...platform.parameters import UNLIMITED
from ...simulator.kernels.observation import SCALES, SLICES, share_of_limit, write_observation
from ...simulator.kernels.step import Cues, Drives, State, simulator_cues
from .. import draws
from ..observation import MACHINE, Layout
from ..options import EpisodeOptions, ObservationOptions, RandomizationOptions


@wp.func
def put_entry(
    out: wp.array2d(dtype=wp.float32), i: int, k: int, value: real, bounds: wp.array(dtype=wp.float32)
) -> int:
    """Write an entry, clipped to its bound."""
    # Once only: an entry that is written twice would count twice in the adjoint.
    out[i, k] = wp.clamp(wp.float32(value), -bounds[k], bounds[k])
    return k + 1


@wp.func
def put_vector(
    out: wp.array2d(dtype=wp.float32),
    i: int,
    first: int,
    value: Any,
    size: int,
    scale: real,
    bounds: wp.array(dtype=wp.float32),
) -> int:
    """Write ``size`` entries from ``first`` on; returns where the next row begins."""
    for k in range(size):
        put_entry(out, i, first + k, value[k] / scale, bounds)
    return first + size


# The cab's heading: rows and actions in axes that turn with the driver.
#
# Carriage and displacement turn by the heading psi_T + psi_H, the hexapod's tilt by psi_T: roll and pitch are
# about axes that its own yaw turns already.


@wp.func
def turned(x: real, y: real, angle: real) -> vec2:
    """A horizontal vector in axes that are turned by ``angle``."""
    c = wp.cos(angle)
    s = wp.sin(angle)
    return vec2(c * x + s * y, c * y - s * x)


@wp.func
def heading(m: Motion) -> real:
    """psi_T + psi_H."""
    return m.position[8] + m.beta[2]


@wp.func
def turned_axes(v: vec9, psi: real, psi_t: real) -> vec9:
    """Nine values in the order of ``AXES``, carriage and displacement turned by psi, tilt by psi_T."""
    carriage = turned(v[0], v[1], psi)
    surge = turned(v[2], v[3], psi)
    tilt = turned(v[5], v[6], psi_t)
    return vec9(carriage[0], carriage[1], surge[0], surge[1], v[4], tilt[0], tilt[1], v[7], v[8])


@wp.func
def to_cab(m: Motion, v: vec9) -> vec9:
    """Values of the axes in the cab's frame."""
    return turned_axes(v, heading(m), m.position[8])


@wp.func
def to_machine(m: Motion, v: vec9) -> vec9:
    """Values of the axes in the machine's frame, from the cab's."""
    return turned_axes(v, -heading(m), -m.position[8])


@wp.func
def motion_in_cab(m: Motion) -> Motion:
    """A motion whose carriage, displacement and tilt are given in the cab's frame."""
    psi = heading(m)
    psi_t = m.position[8]
    p = m.position
    r = m.rate
    c = turned(p[0], p[1], psi)
    c_rate = turned(r[0], r[1], psi)
    s = turned(m.displacement[0], m.displacement[1], psi)
    v = turned(m.velocity[0], m.velocity[1], psi)
    b = turned(m.beta[0], m.beta[1], psi_t)
    b_rate = turned(m.beta_rate[0], m.beta_rate[1], psi_t)
    out = Motion()
    out.position = vec9(c[0], c[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8])
    out.rate = vec9(c_rate[0], c_rate[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
    out.displacement = vec3(s[0], s[1], m.displacement[2])
    out.velocity = vec3(v[0], v[1], m.velocity[2])
    out.beta = vec3(b[0], b[1], m.beta[2])
    out.beta_rate = vec3(b_rate[0], b_rate[1], m.beta_rate[2])
    return out


# What is drawn for one episode.


Floats = NDArray[np.float64]

N_DRAWS: Final = 32
"""Random words an episode takes: drive, machine, start, noise, two sensor gains, nine of the start pose,
nine actuator gains, and room for more, so that adding one leaves the others as they were."""

DRIVE, MACHINE_STREAM, START, NOISE = range(4)
SENSOR_GAINS: Final = slice(4, 6)
POSE: Final = slice(6, 15)
ACTUATOR_GAINS: Final = slice(15, 24)


@wp.struct
class Episode:
    """Constants of one episode."""

    last: int  # sample of the drive at which it is truncated
    noise: int  # seed of the sensor noise
    force_gain: real  # of the cab's accelerometers
    rate_gain: real  # of its gyroscopes
    actuator_gain: vec9


def draw(keys: NDArray[np.uint64], episodes: NDArray[np.int64]) -> NDArray[np.uint64]:
    """(n, N_DRAWS) words of the episodes (n,) of environments with keys (n,)."""
    return draws.words(keys, episodes, N_DRAWS)


def start_samples(
    words: NDArray[np.uint64], lengths: NDArray[np.integer], options: EpisodeOptions, dt: float
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last sample of episodes in drives of ``lengths`` (n,) samples."""
    ends = lengths - 1
    steps = ends if options.duration is None else np.minimum(ends, round(options.duration / dt))
    first = np.zeros_like(ends)
    if options.random_start:
        first = np.floor(draws.uniform(words[:, START]) * (ends - steps + 1)).astype(ends.dtype)
    return first.astype(np.int32), (first + steps).astype(np.int32)


def start_poses(words: NDArray[np.uint64], scale: Floats, share: float) -> Floats:
    """(n, 9) poses within a share of each machine's :func:`pose_scale` (n, 9), in the order of ``AXES``."""
    signed = share * (2.0 * draws.uniform(words[:, POSE]) - 1.0)
    return np.asarray(signed * scale)


def pose_scale(platform: Platform) -> Floats:
    """(9,) largest absolute values of start poses, m and rad, in the order of ``AXES``.

    Half of the legs' share goes to displacement, half to tilt: a displacement s changes no leg by more
    than |s|, and angles change none by more than their sum times the largest distance of a joint.
    """
    carriage, hexapod, turntable = platform.carriage, platform.hexapod, platform.turntable
    scale = np.zeros(9)
    if carriage is not None:
        scale[0] = np.min(np.abs(carriage.travel_x))
        scale[1] = np.min(np.abs(carriage.travel_y))
    half = 0.5 * np.min(np.abs(hexapod.extension))
    radius = np.linalg.norm(hexapod.upper_joints, axis=1).max()
    scale[2:5] = half / np.sqrt(3.0)
    scale[5:8] = half / (3.0 * radius)
    if turntable is not None:
        travel = turntable.travel or (-UNLIMITED, UNLIMITED)
        scale[8] = min(np.pi, *np.abs(travel))
    return scale


def fill_episodes(
    view: NDArray[np.void],
    mask: NDArray[np.bool_],
    words: NDArray[np.uint64],
    last: NDArray[np.int32],
    options: RandomizationOptions,
) -> None:
    """Write the constants of the masked environments' episodes; ``words`` and ``last`` are theirs alone."""
    signed = 2.0 * draws.uniform(words) - 1.0
    gains = 1.0 + options.sensor_gain * signed[:, SENSOR_GAINS]
    view["last"][mask] = last
    view["noise"][mask] = (words[:, NOISE] >> np.uint64(33)).astype(np.int32)
    view["force_gain"][mask], view["rate_gain"][mask] = gains.T
    view["actuator_gain"][mask] = 1.0 + options.actuator_gain * signed[:, ACTUATOR_GAINS]


# The rows that tell a policy its machine: what it can do, and how much of its travel is used.


@wp.func
def put_abilities(
    abilities: wp.array2d(dtype=wp.float32),
    which: int,
    first: int,
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write what a machine can do, constants of the batch; returns where the next row begins."""
    for k in range(abilities.shape[1]):
        put_entry(out, i, first + k, real(abilities[which, k]), bounds)
    return first + abilities.shape[1]


@wp.func
def put_travel_used(
    m: Machine,
    setpoint: Motion,
    cab_frame: int,
    first: int,
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write the shares of their travel that carriage and turntable use, in the frame asked for."""
    p = setpoint.position
    used = vec2(
        share_of_limit(p[0], m.position_min[0], m.position_max[0]),
        share_of_limit(p[1], m.position_min[1], m.position_max[1]),
    )
    if cab_frame != 0:
        used = turned(used[0], used[1], heading(setpoint))
    k = put_entry(out, i, first, used[0], bounds)
    k = put_entry(out, i, k, used[1], bounds)
    return put_entry(out, i, k, share_of_limit(p[8], m.position_min[8], m.position_max[8]), bounds)


# The observation of an environment: rows in float32, sensor errors, preview, and stacking.


FORCE = wp.constant(real(SCALES["reference_force"]))
CARRIAGE = wp.constant(real(SCALES["carriage"]))
CARRIAGE_RATE = wp.constant(real(SCALES["carriage_rate"]))
ACCELERATION = wp.constant(real(SCALES["acceleration"]))
REFERENCE_FORCE = wp.constant(SLICES["reference_force"].start)
REFERENCE_RATE = wp.constant(SLICES["reference_rate"].start)
SIMULATOR_FORCE = wp.constant(SLICES["simulator_force"].start)
SIMULATOR_RATE = wp.constant(SLICES["simulator_rate"].start)


@wp.struct
class Places:
    """Where each row begins in a frame, -1 for one that is not there."""

    frame: int  # entries of a frame
    force_error: int
    rate_error: int
    last_action: int
    command: int
    base_action: int
    preview: int
    memory: int
    perceived: int
    true_motion: int
    machine: int
    travel_used: int
    preview_samples: int
    preview_stride: int  # time steps between samples
    cab_frame: int  # whether the machine's rows are turned with the cab's heading
    modeled: int  # whether the cab's cues are those of the set-points
    force_noise: real  # m/s^2
    rate_noise: real  # rad/s
    abilities: wp.array2d(dtype=wp.float32)  # what each machine can do, the constant rows


def places_of(layout: Layout, seen: ObservationOptions, dt: float, noise: RandomizationOptions) -> Any:
    """The kernel's form of a layout, but for what machines can do."""
    places: Any = Places()
    places.frame = layout.frame
    for name in ("force_error", "rate_error", "last_action", "command", "base_action", "preview", "memory"):
        setattr(places, name, layout.first(name))
    places.perceived, places.true_motion = (
        layout.first("perceived_reference_force"),
        layout.first("true_carriage"),
    )
    places.machine, places.travel_used = layout.first(MACHINE[0].name), layout.first("travel_used")
    places.preview_samples = seen.preview
    places.preview_stride = max(1, round(seen.preview_spacing / dt))
    places.cab_frame = int(seen.frame == "cab")
    places.modeled = int(seen.simulator_cue == "model")
    places.force_noise, places.rate_noise = noise.force_noise, noise.rate_noise
    return places


@wp.func
def put_cues(
    out: wp.array2d(dtype=wp.float32),
    i: int,
    first: int,
    force: vec3,
    rate: vec3,
    bounds: wp.array(dtype=wp.float32),
) -> int:
    """Write specific force, gravity at rest taken off z, and angular velocity."""
    lifted = force + vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))
    k = put_vector(out, i, first, lifted, 3, FORCE, bounds)
    return put_vector(out, i, k, rate, 3, real(1.0), bounds)


@wp.func
def put_motion(
    out: wp.array2d(dtype=wp.float32), i: int, first: int, m: Motion, bounds: wp.array(dtype=wp.float32)
) -> int:
    """Write the rows of the true motion."""
    one = real(1.0)
    k = put_vector(out, i, first, m.position, 2, CARRIAGE, bounds)
    k = put_vector(out, i, k, m.rate, 2, CARRIAGE_RATE, bounds)
    k = put_vector(out, i, k, m.displacement, 3, one, bounds)
    k = put_vector(out, i, k, m.velocity, 3, one, bounds)
    k = put_vector(out, i, k, m.beta, 3, one, bounds)
    k = put_vector(out, i, k, m.beta_rate, 3, one, bounds)
    k = put_entry(out, i, k, wp.sin(m.position[8]), bounds)
    k = put_entry(out, i, k, wp.cos(m.position[8]), bounds)
    return put_entry(out, i, k, m.rate[8], bounds)


@wp.func
def put_fixed(
    p: Places,
    e: Episode,
    sample: int,
    fixed: wp.array2d(dtype=real),
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write the fixed rows, the cab's cues as sensors or the model tell them, and the car's minus them."""
    # A generator of its own for each sample: what is seen does not depend on how often it is looked at.
    random = wp.rand_init(e.noise, sample)
    noisy = p.force_noise + p.rate_noise > real(0.0) and p.modeled == 0
    force_gain = real(1.0)
    rate_gain = real(1.0)
    if p.modeled == 0:
        force_gain = e.force_gain
        rate_gain = e.rate_gain
    for k in range(SIMULATOR_FORCE):
        put_entry(out, i, k, fixed[i, k], bounds)
    for k in range(3):
        force_noise = real(0.0)
        rate_noise = real(0.0)
        if noisy:
            force_noise = p.force_noise / FORCE * real(wp.randn(random))
            rate_noise = p.rate_noise * real(wp.randn(random))
        force = fixed[i, SIMULATOR_FORCE + k] * force_gain + force_noise
        rate = fixed[i, SIMULATOR_RATE + k] * rate_gain + rate_noise
        put_entry(out, i, SIMULATOR_FORCE + k, force, bounds)
        put_entry(out, i, SIMULATOR_RATE + k, rate, bounds)
        put_entry(out, i, p.force_error + k, fixed[i, REFERENCE_FORCE + k] - force, bounds)
        put_entry(out, i, p.rate_error + k, fixed[i, REFERENCE_RATE + k] - rate, bounds)
    for k in range(SIMULATOR_RATE + 3, fixed.shape[1]):
        put_entry(out, i, k, fixed[i, k], bounds)
    return 0


@wp.func
def put_preview(
    p: Places,
    drives: Drives,
    drive: int,
    sample: int,
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write the car's cues ahead, the last one of the drive after its end."""
    first = drives.first[drive]
    last = drives.length[drive] - 1
    for j in range(p.preview_samples):
        ahead = first + wp.min(sample + (j + 1) * p.preview_stride, last)
        put_cues(out, i, p.preview + 6 * j, drives.force[ahead], drives.rate[ahead], bounds)
    return 0


@wp.func
def put_memory(
    p: Places,
    drives: Drives,
    drive: int,
    sample: int,
    memory: wp.array2d(dtype=wp.float32),
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write the low-passed cues of the car."""
    row = drives.first[drive] + wp.min(sample, drives.length[drive] - 1)
    for k in range(memory.shape[1]):
        put_entry(out, i, p.memory + k, real(memory[row, k]), bounds)
    return 0


@wp.func
def shift_frames(out: wp.array2d(dtype=wp.float32), i: int, frame: int) -> int:
    """Make room for a new frame before the older ones."""
    size = out.shape[1]
    for k in range(size - frame):
        out[i, size - 1 - k] = out[i, size - 1 - k - frame]
    return 0


@wp.func
def repeat_frame(out: wp.array2d(dtype=wp.float32), i: int, frame: int) -> int:
    """Fill the older frames with the newest."""
    for k in range(out.shape[1] - frame):
        out[i, frame + k] = out[i, k]
    return 0


@wp.func
def seen_motion(p: Places, m: Motion) -> Motion:
    """A motion in the frame of the observation."""
    if p.cab_frame != 0:
        return motion_in_cab(m)
    return m


@wp.func
def seen_axes(p: Places, m: Motion, v: vec9) -> vec9:
    """Values of the axes in the frame of the observation."""
    if p.cab_frame != 0:
        return to_cab(m, v)
    return v


@wp.func
def seen_acceleration(p: Places, s: State) -> vec9:
    """The acceleration that the observation tells: of the true motion, or of the set-points."""
    if p.modeled != 0:
        return s.setpoint_acceleration
    return s.acceleration


@wp.func
def seen_cues(p: Places, m: Machine, s: State) -> Cues:
    """The cab's cues that the observation tells, likewise."""
    if p.modeled != 0:
        return simulator_cues(m, s.setpoint, s.setpoint_acceleration)
    return s.simulator_cue


@wp.func
def write_frame(
    p: Places,
    drives: Drives,
    drive: int,
    e: Episode,
    which: int,
    machine: Machine,
    s: State,
    fixed: wp.array2d(dtype=real),
    now: wp.array2d(dtype=wp.float32),
    command: vec9,
    base: vec9,
    memory: wp.array2d(dtype=wp.float32),
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """The newest frame of an environment's observation; ``fixed`` gets the fixed rows it is made of.

    ``which`` is the number of the machine.
    """
    seen = seen_motion(p, s.setpoint)
    acceleration = seen_axes(p, s.setpoint, seen_acceleration(p, s))
    write_observation(machine, s, seen, acceleration, seen_cues(p, machine, s), fixed, i)
    put_fixed(p, e, s.sample, fixed, bounds, out, i)
    for k in range(now.shape[1]):
        put_entry(out, i, p.last_action + k, real(now[i, k]), bounds)
    if p.command >= 0:
        put_vector(out, i, p.command, command, 9, ACCELERATION, bounds)
    if p.base_action >= 0:
        put_vector(out, i, p.base_action, seen_axes(p, s.setpoint, base), 9, ACCELERATION, bounds)
    if p.preview >= 0:
        put_preview(p, drives, drive, s.sample, bounds, out, i)
    if p.memory >= 0:
        put_memory(p, drives, drive, s.sample, memory, bounds, out, i)
    if p.perceived >= 0:
        k = put_cues(out, i, p.perceived, s.perceived_reference.force, s.perceived_reference.rate, bounds)
        put_cues(out, i, k, s.perceived_simulator.force, s.perceived_simulator.rate, bounds)
    if p.true_motion >= 0:
        put_motion(out, i, p.true_motion, seen_motion(p, s.motion), bounds)
    if p.machine >= 0:
        put_abilities(p.abilities, which, p.machine, bounds, out, i)
        put_travel_used(machine, s.setpoint, p.cab_frame, p.travel_used, bounds, out, i)
    return p.frame
