"""What the controller does next: run, hold the last cues, brake to neutral, or wait there.

Pure: a state and a situation give the next state. No clock, no machine, no socket.
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
from ..envs.task.observation import acceleration_scale


class State(IntEnum):
    """What the controller does."""

    NEUTRAL = 0
    """The machine rests at its start pose, and waits for cues."""
    RUNNING = 1
    """The policy moves it."""
    HOLDING = 2
    """Cues are overdue: the policy moves it with the last ones."""
    BRAKING = 3
    """It brakes and goes to its start pose, whatever the policy says."""


@configuration
class Patience:
    """How long the watchdog bears what.

    Args:
        overdue: Age of the newest cues from which they are held, s.
        hold: Age from which the machine brakes, s.
        stale: Delay on the way, beyond the least seen, from which a packet is too old to be used, s.
        steady: How long cues must have come without a gap before the policy begins, s.
        fade: Time in which the cues come in once it has begun, s; before, the car is taken to stand.
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
    """What the watchdog looks at.

    Args:
        age: Of the newest cues, s; infinite before any.
        steady: How long cues have come without a gap, s.
        home: Whether the machine rests at its start pose.
        faulted: Whether the policy has failed; it is not asked again.
        stopping: Whether the controller is asked to end.
    """

    age: float
    steady: float
    home: bool
    faulted: bool
    stopping: bool


def next_state(state: State, situation: Situation, patience: Patience) -> State:
    """The state for the next step.

    A policy begins only where it always begins, with the machine at rest at its start pose: so a machine that
    brakes goes there first, also when cues come again.
    """
    ends = situation.faulted or situation.stopping
    if state in (State.RUNNING, State.HOLDING):
        if ends or situation.age > patience.hold:
            return State.BRAKING
        return State.HOLDING if situation.age > patience.overdue else State.RUNNING
    if not situation.home:
        return State.BRAKING
    fresh = situation.age <= patience.overdue and situation.steady >= patience.steady
    return State.RUNNING if fresh and not ends else State.NEUTRAL


# The way home: accelerations that bring the machine to rest at its start pose, whatever it did before.


Floats = NDArray[np.float64]

_ARRIVED: Final = 0.01
"""Distance and speed of each axis that count as none, m, rad, m/s, rad/s."""


@configuration
class HomingOptions:
    """How the machine goes home.

    Args:
        frequency: Of the spring to the start pose, critically damped, rad/s.
        share: Of the largest acceleration of each axis alone that it uses at most.
    """

    frequency: Positive = 1.0
    share: Positive = 0.5


class Homing:
    """A spring on each axis, critically damped: it brakes first, and then goes home.

    Args:
        platform: The machine.
        start: (9,) pose to go to; a turntable without ends takes the shorter way round.
        options: How fast.
    """

    def __init__(self, platform: Platform, start: Floats, options: HomingOptions) -> None:
        self._start, self._frequency = start, options.frequency
        self._most = options.share * acceleration_scale(platform)
        self._round = platform.turntable is not None and platform.turntable.travel is None

    def accelerations(self, motion: Floats) -> Floats:
        """(9,) m/s^2 and rad/s^2 for a motion of :class:`~.track.MotionView`."""
        away, rate = self._away(motion)
        w = self._frequency
        return np.asarray(np.clip(-w * w * away - 2.0 * w * rate, -self._most, self._most))

    def arrived(self, motion: Floats) -> bool:
        """Whether the machine rests at the start pose."""
        away, rate = self._away(motion)
        return bool(np.abs(away).max() <= _ARRIVED and np.abs(rate).max() <= _ARRIVED)

    def _away(self, motion: Floats) -> tuple[Floats, Floats]:
        """(9,) distances from the start pose, and rates."""
        axes = slice(len(self._start))
        away, rate = motion[0, axes] - self._start, motion[1, axes]
        if self._round:
            away[TURNTABLE] = np.remainder(away[TURNTABLE] + np.pi, 2.0 * np.pi) - np.pi
        return away, rate
