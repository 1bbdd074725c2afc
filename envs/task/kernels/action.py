"""Actions: bounded numbers that become accelerations of the nine axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal

import numpy as np
import warp as wp
from numpy.typing import NDArray
from pydantic import Field

from ...arrays import float_rows, real, vec2, vec3, vec9, vec9i
from ...platform.kernels.step import AXES, Motion
from ...platform.kinematics import neutral_jacobian
from ...platform.machines import Platform
from ...settings import Positive, check_names, configuration

Floats = NDArray[np.float64]
Mode = Literal["acceleration", "jerk", "velocity", "residual", "gains"]
Frame = Literal["machine", "cab"]

MODES: Final = {"acceleration": 0, "jerk": 1, "velocity": 2, "residual": 3, "gains": 4}
"""The kernel's number of each mode."""

ACCELERATION, JERK, VELOCITY, RESIDUAL, GAINS = (wp.constant(number) for number in MODES.values())


@configuration
class ActionOptions:
    """What an action means: a number within +-``bound`` for each entry, where 1 is the scale of an axis.

    Args:
        mode: "acceleration": of the nine axes. "jerk": their rate of change. "velocity": the speed to
            reach, as fast as ``authority`` lets. "residual": an acceleration added to that of the base
            policy. "gains": the parameters of the base policy.
        authority: Largest acceleration, as a share of what the machine can do on the axis alone.
        largest: What that is a share of instead, m/s^2 and rad/s^2 in the order of ``AXES``: then an action
            asks for the same of every machine, which gives as much as it can.
        rise_time: Time in which full jerk takes an acceleration from zero to its largest value, s.
        axes: Axes that an action has an entry for, by name; the others are the base policy's, or at rest.
        bound: Largest absolute value of an entry. An algorithm that explores with a deviation of 1, as PPO
            does by default, needs a scale that is gentle and a bound of several times that.
        base: Policy that acts under the agent in the modes "residual" and "gains", by name or file, unless it
            is given to the environment.
        frozen: Axes that do not move, by name.
        repeat: Time steps for which an action is held; rewards are averaged over them.
        ramp: Whether an action is reached linearly over that time, not at once: no jumps in force.
        frame: Axes of carriage, displacement and tilt: "machine", or "cab": turned with the cab's heading.
    """

    mode: Mode = "acceleration"
    authority: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    largest: Annotated[tuple[Positive, ...], Field(min_length=9, max_length=9)] | None = None
    rise_time: Positive = 0.2
    axes: Annotated[tuple[str, ...], Field(min_length=1)] = AXES
    bound: Positive = 1.0
    base: str | None = None
    frozen: tuple[str, ...] = ()
    repeat: Annotated[int, Field(ge=1)] = 1
    ramp: bool = False
    frame: Frame = "machine"

    def __post_init__(self) -> None:
        check_names("axis", (*self.frozen, *self.axes), AXES)
        if len(set(self.axes)) < len(self.axes):
            raise ValueError(f"axes must differ, found {', '.join(self.axes)}")
        if self.base is not None and self.mode not in ("residual", "gains"):
            raise ValueError(f"base {self.base!r} is of no use with mode {self.mode!r}; set it to None")
        if self.mode == "gains" and self.bound != 1.0:
            raise ValueError(f"bound must be 1 with mode 'gains', found {self.bound:g}")

    @property
    def size(self) -> int:
        """Entries of an action, but in the mode "gains"."""
        return len(self.axes)


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


@wp.struct
class AxisScale:
    """What an action of 1 stands for on a machine, in the order of ``AXES``."""

    acceleration: vec9  # m/s^2, rad/s^2
    jerk: vec9  # m/s^3, rad/s^3
    velocity: vec9  # m/s, rad/s


@wp.struct
class ActionScale:
    """What an action stands for."""

    mode: int
    axes: wp.array(dtype=AxisScale)  # on each machine
    free: vec9  # 0 for a frozen axis, else 1
    entry: vec9i  # of an action for each axis, -1 where it has none
    bound: wp.float32  # of an entry
    ramp: int  # whether an action is reached linearly
    cab_frame: int  # whether an action is turned with the cab's heading


def action_scales(platforms: Sequence[Platform], options: ActionOptions, device: Any) -> Any:
    """The kernel's form of what an action stands for on each machine."""
    axes = []
    for platform in platforms:
        one: Any = AxisScale()
        largest = action_scale(platform, options)
        one.acceleration, one.jerk = vec9(*largest), vec9(*largest / options.rise_time)
        one.velocity = vec9(*velocity_scale(platform))
        axes.append(one)
    scale: Any = ActionScale()
    scale.mode, scale.cab_frame = MODES[options.mode], int(options.frame == "cab")
    scale.bound, scale.ramp = options.bound, int(options.ramp)
    scale.entry = vec9i(*(options.axes.index(axis) if axis in options.axes else -1 for axis in AXES))
    scale.free = vec9(*(float(axis not in options.frozen) for axis in AXES))
    scale.axes = wp.array(axes, dtype=AxisScale, device=device)
    return scale


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


@wp.func
def axis_rates(m: Motion) -> vec9:
    """Speeds in the order of ``AXES``."""
    v = m.velocity
    b = m.beta_rate
    return vec9(m.rate[0], m.rate[1], v[0], v[1], v[2], b[0], b[1], b[2], m.rate[8])


@wp.func
def requested(mode: int, scale: AxisScale, axis: int, u: real, before: real, rate: real, dt: real) -> real:
    """Acceleration that an entry of an action asks for; ``before`` is that of a step earlier."""
    largest = scale.acceleration[axis]
    if mode == JERK:
        return wp.clamp(before + scale.jerk[axis] * u * dt, -largest, largest)
    if mode == VELOCITY:
        return wp.clamp((scale.velocity[axis] * u - rate) / dt, -largest, largest)
    return largest * u


@wp.func
def take_action(action: float_rows, now: float_rows, before: float_rows, bound: wp.float32, i: int) -> int:
    """Keep the clipped action and the one before; returns how many entries were clipped."""
    clipped = int(0)
    for k in range(action.shape[1]):
        u = action[i, k]
        if wp.abs(u) > bound:
            clipped = clipped + 1
        before[i, k] = now[i, k]
        now[i, k] = wp.clamp(u, -bound, bound)
    return clipped


@wp.func
def entry(scale: ActionScale, axis: int, now: float_rows, before: float_rows, i: int, share: real) -> real:
    """The entry of an action for an axis when ``share`` of its time has passed; 0 where it has none."""
    k = scale.entry[axis]
    if k < 0:
        return real(0.0)
    u = real(now[i, k])
    if scale.ramp != 0:
        return real(before[i, k]) + (u - real(before[i, k])) * share
    return u


@wp.func
def own_accelerations(
    scale: ActionScale,
    which: int,
    m: Motion,
    now: float_rows,
    before: float_rows,
    i: int,
    share: real,
    last: vec9,
    dt: real,
) -> vec9:
    """The accelerations an action itself asks for in a time step, in its frame.

    ``which`` is the number of the machine, ``m`` are its set-points, ``share`` is that of the action's time
    at the end of the step, ``last`` are the accelerations of the step before.
    """
    if scale.mode == GAINS:
        return vec9()
    rates = axis_rates(m)
    if scale.cab_frame != 0:
        rates = to_cab(m, rates)
    axes = scale.axes[which]
    own = vec9()
    for axis in range(9):
        u = entry(scale, axis, now, before, i, share)
        own[axis] = requested(scale.mode, axes, axis, u, last[axis], rates[axis], dt)
    return own


@wp.func
def applied_accelerations(scale: ActionScale, m: Motion, own: vec9, base: vec9) -> vec9:
    """Accelerations of the axes: the action's ``own`` in the machine's frame, with the base policy's."""
    if scale.mode == GAINS:
        return wp.cw_mul(base, scale.free)
    reference = own
    if scale.cab_frame != 0:
        reference = to_machine(m, own)
    if scale.mode == RESIDUAL:
        reference = reference + base
    return wp.cw_mul(reference, scale.free)
