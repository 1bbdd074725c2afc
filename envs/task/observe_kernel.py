"""The observation of an environment: rows in float32, sensor errors, preview, and stacking."""

from __future__ import annotations

from typing import Any

import warp as wp

from ..cues import GRAVITY
from ..observation import SCALES, SLICES, write_observation
from ..platform.state import Machine, Motion
from ..precision import real, vec3, vec9
from ..state import Cues, Drives, State
from ..step import felt_cues
from .ability_kernel import put_abilities, put_travel_used
from .entries import put_entry, put_vector
from .episode import Episode
from .heading import motion_in_cab, to_cab
from .layout import MACHINE, Layout
from .options import ObservationOptions, RandomisationOptions

FORCE = wp.constant(real(SCALES["wanted_force"]))
CARRIAGE = wp.constant(real(SCALES["carriage"]))
CARRIAGE_RATE = wp.constant(real(SCALES["carriage_rate"]))
ACCELERATION = wp.constant(real(SCALES["acceleration"]))
WANTED_FORCE = wp.constant(SLICES["wanted_force"].start)
WANTED_RATE = wp.constant(SLICES["wanted_rate"].start)
FELT_FORCE = wp.constant(SLICES["felt_force"].start)
FELT_RATE = wp.constant(SLICES["felt_rate"].start)


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
    modelled: int  # whether the cab's cues are those of the set-points
    force_noise: real  # m/s^2
    rate_noise: real  # rad/s
    abilities: wp.array2d(dtype=wp.float32)  # what each machine can do, the constant rows


def places_of(layout: Layout, seen: ObservationOptions, dt: float, noise: RandomisationOptions) -> Any:
    """The kernel's form of a layout, but for what machines can do."""
    places: Any = Places()
    places.frame = layout.frame
    for name in ("force_error", "rate_error", "last_action", "command", "base_action", "preview", "memory"):
        setattr(places, name, layout.first(name))
    places.perceived, places.true_motion = layout.first("sensed_wanted_force"), layout.first("true_carriage")
    places.machine, places.travel_used = layout.first(MACHINE[0].name), layout.first("travel_used")
    places.preview_samples = seen.preview
    places.preview_stride = max(1, round(seen.preview_spacing / dt))
    places.cab_frame = int(seen.frame == "cab")
    places.modelled = int(seen.felt == "model")
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
    noisy = p.force_noise + p.rate_noise > real(0.0) and p.modelled == 0
    force_gain = real(1.0)
    rate_gain = real(1.0)
    if p.modelled == 0:
        force_gain = e.force_gain
        rate_gain = e.rate_gain
    for k in range(FELT_FORCE):
        put_entry(out, i, k, fixed[i, k], bounds)
    for k in range(3):
        force_noise = real(0.0)
        rate_noise = real(0.0)
        if noisy:
            force_noise = p.force_noise / FORCE * real(wp.randn(random))
            rate_noise = p.rate_noise * real(wp.randn(random))
        force = fixed[i, FELT_FORCE + k] * force_gain + force_noise
        rate = fixed[i, FELT_RATE + k] * rate_gain + rate_noise
        put_entry(out, i, FELT_FORCE + k, force, bounds)
        put_entry(out, i, FELT_RATE + k, rate, bounds)
        put_entry(out, i, p.force_error + k, fixed[i, WANTED_FORCE + k] - force, bounds)
        put_entry(out, i, p.rate_error + k, fixed[i, WANTED_RATE + k] - rate, bounds)
    for k in range(FELT_RATE + 3, fixed.shape[1]):
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
    if p.modelled != 0:
        return s.setpoint_acceleration
    return s.acceleration


@wp.func
def seen_cues(p: Places, m: Machine, s: State) -> Cues:
    """The cab's cues that the observation tells, likewise."""
    if p.modelled != 0:
        return felt_cues(m, s.setpoint, s.setpoint_acceleration)
    return s.felt


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
        k = put_cues(out, i, p.perceived, s.sensed_wanted.force, s.sensed_wanted.rate, bounds)
        put_cues(out, i, k, s.sensed_felt.force, s.sensed_felt.rate, bounds)
    if p.true_motion >= 0:
        put_motion(out, i, p.true_motion, seen_motion(p, s.motion), bounds)
    if p.machine >= 0:
        put_abilities(p.abilities, which, p.machine, bounds, out, i)
        put_travel_used(machine, s.setpoint, p.cab_frame, p.travel_used, bounds, out, i)
    return p.frame
