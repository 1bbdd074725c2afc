"""The reward: minus the weighted sum of named terms, for a whole batch."""

from __future__ import annotations

from typing import Any, Final

import warp as wp

from ...arrays import real, vec3
from ...cues import GRAVITY
from ...platform.kernels.step import END_OF_TRAVEL, SINGULAR, Machine
from ...platform.parameters import UNLIMITED
from ...simulator.kernels.step import State, Zone, cue_error, perceived_error, zone
from ..options import RewardOptions

TERMS: Final = (
    "cue_error",
    "perceived_error",
    "false_cues",
    "tilt_rate",
    "stroke",
    "limits",
    "action_rate",
    "failure",
)
"""Names of the terms, in the kernel's order; fields of :class:`~.options.RewardWeights`."""

N_TERMS: Final = len(TERMS)
vec_terms: Any = wp.types.vector(N_TERMS, real)


@wp.struct
class RewardScale:
    """The kernel's form of :class:`~.options.RewardOptions`."""

    weights: vec_terms
    zone: Zone
    force_threshold: vec3
    rate_threshold: vec3
    tilt_rate: real
    stroke_margin: real
    stopping: real  # travel to a stop, times acceleration over rate squared
    terminate: int  # whether failure ends an episode


def reward_scale(options: RewardOptions, terminate: bool) -> Any:
    """The kernel's form of the options."""
    scale: Any = RewardScale()
    scale.weights = vec_terms(*(getattr(options.weights, name) for name in TERMS))
    scale.zone = zone(options.zone)
    scale.force_threshold = vec3(*options.force_threshold)
    scale.rate_threshold = vec3(*options.rate_threshold)
    scale.tilt_rate, scale.stroke_margin = options.tilt_rate, options.stroke_margin
    braking = options.stroke_braking
    scale.stopping = 0.0 if braking is None else 1.0 / (2.0 * braking)
    scale.terminate = int(terminate)
    return scale


@wp.func
def false_cue(reference: real, simulated: real, threshold: real, scale: real) -> real:
    """Squared error over ``scale`` where the cab moves noticeably and the car does not, or against it."""
    error = simulated - reference
    against = wp.abs(reference) <= threshold or reference * simulated < real(0.0)
    if against and wp.abs(simulated) > threshold and wp.abs(error) > threshold:
        return error * error / (scale * scale)
    return real(0.0)


@wp.func
def false_cues(r: RewardScale, s: State) -> real:
    """False cues of all six axes, at the cab's reference point; forces relative to rest."""
    gravity = vec3(real(0.0), real(0.0), real(wp.static(GRAVITY)))
    reference = s.reference_cue.force + gravity
    simulated = s.simulator_cue.force + gravity
    total = real(0.0)
    for k in range(3):
        total = total + false_cue(reference[k], simulated[k], r.force_threshold[k], r.zone.force)
        total = total + false_cue(
            s.reference_cue.rate[k], s.simulator_cue.rate[k], r.rate_threshold[k], r.zone.rate
        )
    return total


@wp.func
def beyond(reference: real, simulated: real) -> real:
    """The part of ``felt`` outside the interval between zero and ``wanted``."""
    zero = real(0.0)
    return simulated - wp.clamp(simulated, wp.min(reference, zero), wp.max(reference, zero))


@wp.func
def tilt_excess(r: RewardScale, s: State) -> real:
    """Square of the tilt rate above its threshold, in thresholds."""
    roll = beyond(s.reference_cue.rate[0], s.simulator_cue.rate[0])
    pitch = beyond(s.reference_cue.rate[1], s.simulator_cue.rate[1])
    squared = (roll * roll + pitch * pitch) / (r.tilt_rate * r.tilt_rate)
    # Before the root, whose derivative at zero is infinite.
    if squared <= real(1.0):
        return real(0.0)
    excess = wp.sqrt(squared) - real(1.0)
    return excess * excess


@wp.func
def stroke_excess(r: RewardScale, m: Machine, s: State) -> real:
    """Square of the travel used beyond the margin, over the way from there to the end, all actuators.

    Used is the place where an actuator comes to a stop.
    """
    total = real(0.0)
    for k in range(9):
        rate = s.motion.rate[k]
        q = s.motion.position[k] + r.stopping * rate * wp.abs(rate) / m.acceleration[k]
        end = wp.where(q >= real(0.0), m.position_max[k], -m.position_min[k])
        # A missing subsystem has no travel, and an unlimited one no end.
        if end > real(0.0) and end < real(wp.static(UNLIMITED)):
            excess = (wp.abs(q) / end - r.stroke_margin) / (real(1.0) - r.stroke_margin)
            excess = wp.max(excess, real(0.0))
            total = total + excess * excess
    return total


@wp.func
def limited_share(limits: wp.uint64) -> real:
    """Share of the nine actuators that a limit holds back."""
    count = int(0)
    for k in range(9):
        if (wp.rshift(limits, wp.uint64(4 * k)) & wp.uint64(15)) != wp.uint64(0):
            count = count + 1
    return real(count) / real(9.0)


@wp.func
def has_failed(limits: wp.uint64) -> bool:
    """Whether an end of travel or a nearly singular pose was met."""
    return (limits & wp.uint64(wp.static(END_OF_TRAVEL | SINGULAR))) != wp.uint64(0)


@wp.func
def action_change(now: wp.array2d(dtype=wp.float32), before: wp.array2d(dtype=wp.float32), i: int) -> real:
    """Mean square change of the action."""
    total = real(0.0)
    for k in range(now.shape[1]):
        change = real(now[i, k]) - real(before[i, k])
        total = total + change * change
    return total / real(now.shape[1])


@wp.func
def terms_now(r: RewardScale, m: Machine, s: State, share: real) -> vec_terms:
    """The terms of a time step that belong to the state, times ``share``."""
    zero = real(0.0)
    t = vec_terms(
        cue_error(r.zone, s),
        perceived_error(r.zone, s),
        false_cues(r, s),
        tilt_excess(r, s),
        stroke_excess(r, m, s),
        limited_share(s.limits),
        zero,
        zero,
    )
    return t * share
