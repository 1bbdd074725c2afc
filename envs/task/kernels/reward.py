"""The reward: minus the weighted sum of named terms.

A term is declared once, with :func:`term`: its name is that of its function, its sentence is the function's
docstring, its default weight stands in the decorator. The terms' order, the fields of :class:`RewardWeights`,
the names in ``info`` and the table in the documentation follow from that. So a new term is one function on
this page, wherever it stands among the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import warp as wp
from pydantic import Field

from ...arrays import float_rows, real, vec3
from ...cues import GRAVITY
from ...platform.kernels.step import END_OF_TRAVEL, SINGULAR, Machine
from ...platform.machines import UNLIMITED
from ...settings import NonNegative, Positive, Vector3, configuration
from ...simulator.kernels.step import CueCost, State, Zone, zone
from ...simulator.kernels.step import cue_error as cue_cost
from ...simulator.kernels.step import perceived_error as perceived_cost

Of = Literal["state", "action", "end"]


@wp.struct
class RewardScale:
    """Scales and thresholds of the terms, the kernel's form of :class:`RewardOptions`."""

    zone: Zone
    force_threshold: vec3
    rate_threshold: vec3
    tilt_rate: real
    stroke_margin: real
    stopping: real  # travel to a stop, times acceleration over rate squared


@dataclass(frozen=True)
class Term:
    """A term of the reward.

    Args:
        name: In ``info``, in :class:`RewardWeights` and in logs.
        about: Its definition in one sentence.
        weight: Default weight.
        of: "state": its function of scales, machine and state is averaged over the time steps of an action.
            "action": its function of this action and the one before counts once an action.
            "end": 1 where its function of the state's limits first ends an episode.
        function: The Warp function.
    """

    name: str
    about: str
    weight: float
    of: Of
    function: Any


_DECLARED: Final[list[Term]] = []


def term(weight: float, of: Of = "state") -> Callable[[Any], Any]:
    """Declare a Warp function to be a term of the reward; the decorator, see :class:`Term`."""

    def declare(function: Any) -> Any:
        about = " ".join(function.func.__doc__.split()).replace("``", "`")
        _DECLARED.append(Term(function.func.__name__, about, weight, of, function))
        return function

    return declare


@term(weight=1.0)
@wp.func
def cue_error(r: RewardScale, m: Machine, s: State) -> real:
    """Error of the cues at the cab, whose mean over a drive is J."""
    return cue_cost(r.zone, s)


@term(weight=0.0)
@wp.func
def perceived_error(r: RewardScale, m: Machine, s: State) -> real:
    """Error of the perceived cues, whose mean over a drive is the perceived J."""
    return perceived_cost(r.zone, s)


@wp.func
def false_cue(reference: real, simulated: real, threshold: real, scale: real) -> real:
    """Squared error over ``scale`` where the cab moves noticeably and the car does not, or against it."""
    error = simulated - reference
    against = wp.abs(reference) <= threshold or reference * simulated < real(0.0)
    if against and wp.abs(simulated) > threshold and wp.abs(error) > threshold:
        return error * error / (scale * scale)
    return real(0.0)


@term(weight=0.0)
@wp.func
def false_cues(r: RewardScale, m: Machine, s: State) -> real:
    """The part of ``cue_error`` on axes that move where the car does not, or against it."""
    # Forces relative to rest, at the cab's reference point.
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
    """The part of the simulator's cue outside the interval between zero and the reference."""
    zero = real(0.0)
    return simulated - wp.clamp(simulated, wp.min(reference, zero), wp.max(reference, zero))


@term(weight=0.02)
@wp.func
def tilt_rate(r: RewardScale, m: Machine, s: State) -> real:
    """Square of the roll and pitch rate beyond the car's own, above the threshold, in thresholds."""
    roll = beyond(s.reference_cue.rate[0], s.simulator_cue.rate[0])
    pitch = beyond(s.reference_cue.rate[1], s.simulator_cue.rate[1])
    squared = (roll * roll + pitch * pitch) / (r.tilt_rate * r.tilt_rate)
    # Before the root, whose derivative at zero is infinite.
    if squared <= real(1.0):
        return real(0.0)
    excess = wp.sqrt(squared) - real(1.0)
    return excess * excess


@term(weight=0.1)
@wp.func
def stroke(r: RewardScale, m: Machine, s: State) -> real:
    """Square of the use of travel beyond a margin, summed over actuators; 1 at an end of travel."""
    total = real(0.0)
    for k in range(9):
        rate = s.motion.rate[k]
        # Used is the place where the actuator comes to a stop.
        q = s.motion.position[k] + r.stopping * rate * wp.abs(rate) / m.acceleration[k]
        end = wp.where(q >= real(0.0), m.position_max[k], -m.position_min[k])
        # A missing subsystem has no travel, and an unlimited one no end.
        if end > real(0.0) and end < real(wp.static(UNLIMITED)):
            excess = (wp.abs(q) / end - r.stroke_margin) / (real(1.0) - r.stroke_margin)
            excess = wp.max(excess, real(0.0))
            total = total + excess * excess
    return total


@term(weight=0.1)
@wp.func
def limits(r: RewardScale, m: Machine, s: State) -> real:
    """Share of the actuators held back by a limit."""
    count = int(0)
    for k in range(9):
        if (wp.rshift(s.limits, wp.uint64(4 * k)) & wp.uint64(15)) != wp.uint64(0):
            count = count + 1
    return real(count) / real(9.0)


@term(weight=0.02, of="action")
@wp.func
def action_rate(now: float_rows, before: float_rows, i: int) -> real:
    """Mean square change of the action."""
    total = real(0.0)
    for k in range(now.shape[1]):
        change = real(now[i, k]) - real(before[i, k])
        total = total + change * change
    return total / real(now.shape[1])


@term(weight=100.0, of="end")
@wp.func
def failure(limits: wp.uint64) -> bool:
    """1 where the episode is terminated, at an end of travel or a nearly singular pose."""
    return (limits & wp.uint64(wp.static(END_OF_TRAVEL | SINGULAR))) != wp.uint64(0)


DECLARED: Final = tuple(_DECLARED)
"""The terms, in the order of this page."""

TERMS: Final = tuple(one.name for one in DECLARED)
"""Their names."""

N_TERMS: Final = len(TERMS)
vec_terms: Any = wp.types.vector(N_TERMS, real)

if TYPE_CHECKING:

    class RewardWeights:
        """For type checkers, which do not run the declaration."""

        def __init__(self, *weights: float, **named: float) -> None: ...

        def __getattr__(self, name: str) -> float: ...

else:
    _ABOUT = "Weight of each term of the reward, minus their weighted sum; 0 switches a term off.\n\nArgs:\n"
    RewardWeights = configuration(
        type(
            "RewardWeights",
            (),
            {
                "__doc__": _ABOUT + "".join(f"    {one.name}: {one.about}\n" for one in DECLARED),
                "__module__": __name__,
                "__annotations__": dict.fromkeys(TERMS, NonNegative),
                **{one.name: one.weight for one in DECLARED},
            },
        )
    )


@configuration
class RewardOptions:
    """The reward's weights, scales and thresholds.

    Args:
        weights: Of its terms.
        zone: Indifference zone of the cue errors.
        force_threshold: Perception of specific force x, y, z, m/s^2 (Reid and Nahon, from memory).
        rate_threshold: Perception of angular velocity x, y, z, rad/s (Zacharias; 3.0, 3.6, 2.6 deg/s).
        tilt_rate: Tilt rate that goes unnoticed, rad/s (3 deg/s, SIMONA).
        stroke_margin: Share of the travel that costs nothing.
        stroke_braking: Travel counts where an actuator would come to a stop with this share of its
            acceleration, so that what lies beyond a short horizon costs now; None: where it is.
        standstill: Rewards are divided by 1 + this share of J of standing still on the drive, so that each
            drive counts by how well it can be done, and not by how fierce it is; 0: they are not divided.
        scale: Factor on rewards, after that division: learners such as SAC weigh them against the entropy of
            their actions, and begin with a weight of 1 for it.
        against_base: Whether the reward of the base policy alone, on a second machine in the same drive, is
            taken off: 0 for an agent that does nothing, above for one that is better. The drive's own ups
            and downs, which no action changes, are gone then; it takes twice the simulation.
        floor: Rewards are at least minus this, so that a rare collapse does not outweigh all else; None: no
            floor.
    """

    weights: RewardWeights = RewardWeights()
    zone: CueCost = CueCost()
    force_threshold: Vector3 = (0.17, 0.17, 0.28)
    rate_threshold: Vector3 = (math.radians(3.0), math.radians(3.6), math.radians(2.6))
    tilt_rate: Positive = math.radians(3.0)
    stroke_margin: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.8
    stroke_braking: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    standstill: NonNegative = 0.0
    scale: Positive = 1.0
    against_base: bool = False
    floor: Positive | None = None


@wp.struct
class Reward:
    """The kernel's form of :class:`RewardOptions`."""

    weights: vec_terms
    scale: RewardScale
    floor: real  # rewards are at least minus this
    terminate: int  # whether failure ends an episode


def reward_of(options: RewardOptions, terminate: bool) -> Any:
    """The kernel's form of the options."""
    scale: Any = RewardScale()
    scale.zone = zone(options.zone)
    scale.force_threshold = vec3(*options.force_threshold)
    scale.rate_threshold = vec3(*options.rate_threshold)
    scale.tilt_rate, scale.stroke_margin = options.tilt_rate, options.stroke_margin
    braking = options.stroke_braking
    scale.stopping = 0.0 if braking is None else 1.0 / (2.0 * braking)
    reward: Any = Reward()
    reward.weights = vec_terms(*(getattr(options.weights, name) for name in TERMS))
    reward.scale, reward.terminate = scale, int(terminate)
    reward.floor = math.inf if options.floor is None else options.floor
    return reward


_STATE: Final = [(k, one.function) for k, one in enumerate(DECLARED) if one.of == "state"]
_ACTION: Final = [(k, one.function) for k, one in enumerate(DECLARED) if one.of == "action"]
_END: Final = [(k, one.function) for k, one in enumerate(DECLARED) if one.of == "end"]


@wp.func
def state_terms(r: RewardScale, m: Machine, s: State, share: real) -> vec_terms:
    """The terms of a time step that belong to the state, times ``share``."""
    terms = vec_terms()
    for k in range(wp.static(len(_STATE))):
        terms[wp.static(_STATE[k][0])] = wp.static(_STATE[k][1])(r, m, s)
    return terms * share


@wp.func
def action_terms(now: float_rows, before: float_rows, i: int) -> vec_terms:
    """The terms that belong to the action and count once."""
    terms = vec_terms()
    for k in range(wp.static(len(_ACTION))):
        terms[wp.static(_ACTION[k][0])] = wp.static(_ACTION[k][1])(now, before, i)
    return terms


@wp.func
def end_terms(limits: wp.uint64) -> vec_terms:
    """1 for each reason to end an episode, 0 for the others."""
    terms = vec_terms()
    for k in range(wp.static(len(_END))):
        if wp.static(_END[k][1])(limits):
            terms[wp.static(_END[k][0])] = real(1.0)
    return terms


def reward_table() -> str:
    """The terms as a table in Markdown."""
    rows = [f"| `{one.name}` | {one.weight:g} | {one.about} |" for one in DECLARED]
    return "\n".join(["| Term | Weight | Definition |", "|---|---|---|", *rows])
