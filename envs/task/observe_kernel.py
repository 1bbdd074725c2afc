"""The observation of an environment: rows in float32, sensor errors, preview, and stacking."""

from __future__ import annotations

from typing import Any

import warp as wp

from ..cues import GRAVITY
from ..observation import SCALES, SLICES
from ..platform.state import Motion
from ..precision import real, vec3, vec9
from ..state import Drives, State
from .episode import Episode
from .layout import Layout
from .options import RandomisationOptions

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
    perceived: int
    true_motion: int
    preview_samples: int
    preview_stride: int  # time steps between samples
    force_noise: real  # m/s^2
    rate_noise: real  # rad/s


def places_of(layout: Layout, samples: int, stride: int, noise: RandomisationOptions) -> Any:
    """The kernel's form of a layout."""
    places: Any = Places()
    places.frame = layout.frame
    for name in ("force_error", "rate_error", "last_action", "command", "base_action", "preview"):
        setattr(places, name, layout.first(name))
    places.perceived, places.true_motion = layout.first("sensed_wanted_force"), layout.first("true_carriage")
    places.preview_samples, places.preview_stride = samples, stride
    places.force_noise, places.rate_noise = noise.force_noise, noise.rate_noise
    return places


@wp.func
def put_vector(
    out: wp.array2d(dtype=wp.float32), i: int, first: int, value: Any, size: int, scale: real
) -> int:
    """Write ``size`` entries from ``first`` on; returns where the next row begins."""
    for k in range(size):
        out[i, first + k] = wp.float32(value[k] / scale)
    return first + size


@wp.func
def put_cues(out: wp.array2d(dtype=wp.float32), i: int, first: int, force: vec3, rate: vec3) -> int:
    """Write specific force, gravity at rest taken off z, and angular velocity."""
    lifted = vec3(force[0], force[1], force[2] + real(wp.static(GRAVITY)))
    k = put_vector(out, i, first, lifted, 3, FORCE)
    return put_vector(out, i, k, rate, 3, real(1.0))


@wp.func
def put_motion(out: wp.array2d(dtype=wp.float32), i: int, first: int, motion: Motion) -> int:
    """Write the rows of the true motion."""
    one = real(1.0)
    k = put_vector(out, i, first, motion.position, 2, CARRIAGE)
    k = put_vector(out, i, k, motion.rate, 2, CARRIAGE_RATE)
    k = put_vector(out, i, k, motion.displacement, 3, one)
    k = put_vector(out, i, k, motion.velocity, 3, one)
    k = put_vector(out, i, k, motion.beta, 3, one)
    k = put_vector(out, i, k, motion.beta_rate, 3, one)
    out[i, k] = wp.float32(wp.sin(motion.position[8]))
    out[i, k + 1] = wp.float32(wp.cos(motion.position[8]))
    out[i, k + 2] = wp.float32(motion.rate[8])
    return k + 3


@wp.func
def put_sensed_cab(
    p: Places,
    e: Episode,
    sample: int,
    core: wp.array2d(dtype=real),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """Write the cab's cues as its sensors tell them, and the car's minus them."""
    # A generator of its own for each sample: what is seen does not depend on how often it is looked at.
    random = wp.rand_init(e.noise, sample)
    noisy = p.force_noise + p.rate_noise > real(0.0)
    for k in range(3):
        force = core[i, FELT_FORCE + k] * e.force_gain
        rate = core[i, FELT_RATE + k] * e.rate_gain
        if noisy:
            force = force + p.force_noise / FORCE * real(wp.randn(random))
            rate = rate + p.rate_noise * real(wp.randn(random))
        out[i, FELT_FORCE + k] = wp.float32(force)
        out[i, FELT_RATE + k] = wp.float32(rate)
        out[i, p.force_error + k] = wp.float32(core[i, WANTED_FORCE + k] - force)
        out[i, p.rate_error + k] = wp.float32(core[i, WANTED_RATE + k] - rate)
    return 0


@wp.func
def put_preview(
    p: Places, drives: Drives, drive: int, sample: int, out: wp.array2d(dtype=wp.float32), i: int
) -> int:
    """Write the car's cues ahead, the last one of the drive after its end."""
    k = p.preview
    first = drives.first[drive]
    last = drives.length[drive] - 1
    for j in range(p.preview_samples):
        ahead = first + wp.min(sample + (j + 1) * p.preview_stride, last)
        k = put_cues(out, i, k, drives.force[ahead], drives.rate[ahead])
    return k


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
def write_frame(
    p: Places,
    drives: Drives,
    drive: int,
    e: Episode,
    s: State,
    core: wp.array2d(dtype=real),
    now: wp.array2d(dtype=wp.float32),
    command: vec9,
    base: vec9,
    bounds: wp.array(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
    i: int,
) -> int:
    """The newest frame of an environment's observation; ``core`` are its fixed rows."""
    for k in range(core.shape[1]):
        out[i, k] = wp.float32(core[i, k])
    put_sensed_cab(p, e, s.sample, core, out, i)
    for k in range(now.shape[1]):
        out[i, p.last_action + k] = now[i, k]
    if p.command >= 0:
        put_vector(out, i, p.command, command, 9, ACCELERATION)
    if p.base_action >= 0:
        put_vector(out, i, p.base_action, base, 9, ACCELERATION)
    if p.preview >= 0:
        put_preview(p, drives, drive, s.sample, out, i)
    if p.perceived >= 0:
        k = put_cues(out, i, p.perceived, s.sensed_wanted.force, s.sensed_wanted.rate)
        put_cues(out, i, k, s.sensed_felt.force, s.sensed_felt.rate)
    if p.true_motion >= 0:
        put_motion(out, i, p.true_motion, s.motion)
    for k in range(p.frame):
        out[i, k] = wp.clamp(out[i, k], -bounds[k], bounds[k])
    return p.frame
