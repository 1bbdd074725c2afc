"""Watchdog of the real-time loop: which state the controller takes next, and how it brakes to neutral.

=======  ======  ===================================  ==============================================
state    number  moved by                             ends when
=======  ======  ===================================  ==============================================
neutral  0       nothing: it rests at its start pose  cues have arrived for ``steady`` without a gap
running  1       the policy, with the newest cues     the newest cues are older than ``overdue``
holding  2       the policy, with the last cues       cues arrive again, or are older than ``hold``
braking  3       a damped spring to the start pose    the machine rests there
=======  ======  ===================================  ==============================================

Running and holding also end, in braking, when the policy fails or the controller is stopped. Nothing here
knows a clock or a socket.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..envs.errors import ConfigurationError
from ..envs.platform import Platform
from ..envs.platform.kernels.step import TURNTABLE
from ..envs.settings import NonNegative, Positive, configuration
from ..envs.simulator.simulator import TIME_STEP
from ..envs.task.kernels.action import acceleration_scale

Floats = NDArray[np.float64]

_AT_REST: Final = 0.01
"""Largest distance and speed of an axis at rest at the start pose, m, rad, m/s, rad/s."""


class State(IntEnum):
    """State of the controller; the table of the module says more."""

    NEUTRAL = 0
    RUNNING = 1
    HOLDING = 2
    BRAKING = 3

    @property
    def follows(self) -> bool:
        """Whether the policy moves the machine."""
        return self in (State.RUNNING, State.HOLDING)


@configuration
class WatchdogOptions:
    """Time limits of the watchdog.

    Args:
        overdue: Age of the newest cues from which they are held, s.
        hold: Age from which the machine brakes, s.
        stale: Delay on the way, beyond the least one so far, from which a packet is too old to be used, s.
        steady: How long cues must have arrived without a gap before the policy begins, s.
        fade: Time in which the cues fade in from those of a standing car once it has begun, s.
    """

    overdue: Positive = 0.03
    hold: Positive = 0.2
    stale: Positive = 0.05
    steady: NonNegative = 0.2
    fade: NonNegative = 1.0

    def __post_init__(self) -> None:
        if self.hold < self.overdue:
            raise ConfigurationError(
                f"hold must not be less than overdue, found {self.hold:g} s and {self.overdue:g} s"
            )


class Situation(NamedTuple):
    """Inputs of the watchdog.

    Args:
        age: Of the newest cues, s; infinite before any.
        steady: How long cues have arrived without a gap, s.
        neutral: Whether the machine rests at its start pose.
        failed: Whether the policy has failed; it is not called again.
        stopping: Whether the controller is to end.
    """

    age: float
    steady: float
    neutral: bool
    failed: bool
    stopping: bool


def next_state(state: State, situation: Situation, options: WatchdogOptions) -> State:
    """The state for the next step.

    A policy begins only with the machine at rest at its start pose. So a machine that brakes returns there
    first, also when cues arrive again.
    """
    ends = situation.failed or situation.stopping
    if state.follows:
        if ends or situation.age > options.hold:
            return State.BRAKING
        return State.HOLDING if situation.age > options.overdue else State.RUNNING
    if not situation.neutral:
        return State.BRAKING
    fresh = situation.age <= options.overdue and situation.steady >= options.steady
    return State.RUNNING if fresh and not ends else State.NEUTRAL


@configuration
class BrakeOptions:
    """How the machine brakes to neutral.

    Args:
        frequency: Of the spring to the start pose, critically damped, rad/s.
        share: Largest share of each axis' own acceleration limit that it uses.
        ramp: Time in which it builds up that share: the change from the policy's acceleration has no step, s.
    """

    frequency: Positive = 1.0
    share: Positive = 0.5
    ramp: Positive = 0.5


class BrakeToNeutral:
    """Return to the start pose: a critically damped spring on each axis, with bounded acceleration and jerk.

    Args:
        platform: The machine.
        start: (9,) pose to return to; a turntable without end stops takes the shorter way round.
        options: How fast.
    """

    def __init__(self, platform: Platform, start: Floats, options: BrakeOptions) -> None:
        self._start, self._frequency = start, options.frequency
        self._largest = options.share * acceleration_scale(platform)
        self._change = self._largest * TIME_STEP / options.ramp
        self._endless = platform.turntable is not None and platform.turntable.travel is None

    def accelerations(self, motion: Floats, before: Floats) -> Floats:
        """(9,) m/s^2 and rad/s^2 of the next time step.

        Args:
            motion: Of :class:`~.machine.MotionView`.
            before: (9,) accelerations of the time step before.
        """
        offset, rate = self._offset(motion)
        w = self._frequency
        spring = np.clip(-w * w * offset - 2.0 * w * rate, -self._largest, self._largest)
        return np.asarray(before + np.clip(spring - before, -self._change, self._change))

    def at_rest(self, motion: Floats) -> bool:
        """Whether the machine rests at the start pose."""
        offset, rate = self._offset(motion)
        return bool(np.abs(offset).max() <= _AT_REST and np.abs(rate).max() <= _AT_REST)

    def _offset(self, motion: Floats) -> tuple[Floats, Floats]:
        """(9,) offsets from the start pose, and rates."""
        axes = slice(len(self._start))
        offset, rate = motion[0, axes] - self._start, motion[1, axes]
        if self._endless:
            offset[TURNTABLE] = np.remainder(offset[TURNTABLE] + np.pi, 2.0 * np.pi) - np.pi
        return offset, rate
