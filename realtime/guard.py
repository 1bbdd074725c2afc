"""Guard of the cues: implausible changes, frozen senders and pauses fade out to a standing car, and in again.

======  ==========================================================  =====================================
kind    what is seen                                                what the policy gets
======  ==========================================================  =====================================
spikes  at most ``spike`` packets change faster than cars do,       the cues before, held, as a median
        then the cues are back                                      of three takes them
jumps   they do not come back: a teleport, a reset                  fade out, until they were calm
stuck   force or angular velocity repeat to the bit for ``stuck``   fade out, until they change again
pauses  the sender says that its drive is paused                    fade out, until it goes on
gaps    packets are missing, or late                                the new cues without a step
copies  a packet has the numbers of the one before                  the next new cues without a step
======  ==========================================================  =====================================

A blend is the old cues' distance to the new ones. It decays as a critically damped spring, with bounded
slope, so that nothing steps. Cues without a fault pass as they are, to the bit.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..envs.settings import NonNegative, Positive, configuration
from ..envs.simulator.simulator import TIME_STEP
from .machine import AT_REST
from .packets import Cues

Floats = NDArray[np.float64]

GUARD_KINDS: Final = ("spikes", "jumps", "stuck", "pauses", "gaps", "copies")

_SETTLED: Final = 5.83
"""Product of frequency and time after which a critically damped spring is within 2 % of its rest."""
_BLEND: Final = 5.0
"""Blend after a gap, in lengths of the gap: the slope then is at most 1.5 times that of the cues."""
_TREND: Final = 6
"""Time steps over which a trend is measured: a rough road must not tip it."""
_LEAD: Final = 3
"""Most time steps for which cues are led on by their trend."""
_MISSING: Final = 1.05
"""A sender that is faster than the time steps, with this tolerance, has a packet for each."""
_DONE: Final = np.repeat([1e-4, 1e-5], 3)
"""Distance, m/s^2 and rad/s, and rate of change a second, at which a blend ends: nobody feels it."""


@configuration
class GuardOptions:
    """What the guard takes for a car's cues, and how smoothly it reacts to anything else.

    The slews are for road cars. The drives of this package stay below two thirds of them: the standard
    maneuvers, the recorded drives, and random drives of each kind, also on an average road of ISO 8608.
    Their largest are 62 m/s^3 along (a full stop), 45 across, 68 vertically and 2.3 rad/s^2.

    Args:
        force_slew: Fastest plausible change of the horizontal specific force, m/s^3.
        vertical_slew: Of the vertical one, m/s^3; a curb or a pothole is sharper than any maneuver.
        rate_slew: Of the angular velocity, rad/s^2.
        spike: Most packets in a row that count as a spike.
        stuck: Time after which force or angular velocity that repeat to the bit count as stuck, s. Those of a
            standing car never do.
        settle: How long cues must have been plausible after a jump, a pause or a freeze to be followed, s.
        fade: Time in which cues fade out and in, to within 2 %, s.
        jerk: Largest slope of a fade, m/s^3.
        angular_acceleration: Of a fade of the angular velocity, rad/s^2.
    """

    force_slew: Positive = 100.0
    vertical_slew: Positive = 300.0
    rate_slew: Positive = 10.0
    spike: NonNegative = 2.0
    stuck: Positive = 0.5
    settle: NonNegative = 0.3
    fade: Positive = 1.0
    jerk: Positive = 30.0
    angular_acceleration: Positive = 3.0


class Blend:
    """Distance between what is given and what is meant to be, which decays without a step.

    Args:
        slope: (6,) its largest rate of change.
    """

    def __init__(self, slope: Floats) -> None:
        self._slope = slope
        self.stop()

    def stop(self) -> None:
        """End it at once."""
        self._distance, self._rate = np.zeros(6), np.zeros(6)
        self._frequency = np.inf
        self.over = True

    def start(self, distance: Floats, rate: Floats, seconds: float) -> None:
        """Blend from a distance and its rate on, within about ``seconds``; a slower one keeps its pace."""
        self._distance, self._rate = distance, np.clip(rate, -self._slope, self._slope)
        self._frequency = min(self._frequency, _SETTLED / seconds)
        self.over = False

    def step(self) -> Floats:
        """(6,) distance a time step later."""
        w, dt, bound = self._frequency, TIME_STEP, self._slope
        # Both roots of the spring are at -w: this is its exact step.
        lead, decay = self._rate + w * self._distance, np.exp(-w * dt)
        moved = decay * (self._distance + lead * dt)
        moved = self._distance + np.clip(moved - self._distance, -bound * dt, bound * dt)
        self._rate = np.clip(decay * (self._rate - w * lead * dt), -bound, bound)
        self._distance = moved
        if (np.abs(moved) < _DONE).all() and (np.abs(self._rate) < _DONE).all():
            self.stop()
        return self._distance


class Guard:
    """Judges the newest cues each time step, and says which the policy gets.

    Args:
        options: What is plausible.
        overdue: Time between packets from which they have a gap, s.

    Attributes:
        counts: Faults by kind, see :data:`GUARD_KINDS`.
        follows: Whether the cues are followed; else they fade to those of a standing car.
    """

    def __init__(self, options: GuardOptions, overdue: float) -> None:
        self._options, self._overdue = options, overdue
        o = options
        self._slew = np.array([o.force_slew, o.force_slew, o.vertical_slew, *3 * [o.rate_slew]])
        self._blend = Blend(np.repeat([o.jerk, o.angular_acceleration], 3))
        self.counts = dict.fromkeys(GUARD_KINDS, 0)
        # A sender's pause goes on while the machine brakes: it counts once.
        self._paused = False
        self.reset()

    def reset(self) -> None:
        """Judge the next cues as the first of a sender."""
        self._last: Cues | None = None
        self._accepted = 0
        self._raw = self._good = AT_REST
        self._interval = math.inf
        self._since_good = self._calm = 0.0
        self._frozen = np.zeros(2)
        self._suspects = self._waited = 0
        self._copied = False
        self._trend = np.zeros(6)
        self._heard: deque[Floats] = deque(maxlen=_TREND)
        self.follows = True
        self.begin()

    def begin(self) -> None:
        """The policy begins: nothing was given before."""
        self._blend.stop()
        self._given: deque[Floats] = deque(maxlen=_TREND)
        self._gap = 0.0

    def __call__(self, cues: Cues, paused: bool, accepted: int) -> Floats:
        """(6,) cues for the policy: force, m/s^2, angular velocity, rad/s.

        Args:
            cues: The newest.
            paused: Whether the sender has said since that its drive is paused.
            accepted: Packets that were whole, new and in time so far.
        """
        followed, self._gap = self.follows, 0.0
        if paused:
            self._distrust("pauses", again=self._paused)
        self._paused = paused
        self._waited += 1
        if self._last is None or cues.sequence != self._last.sequence:
            self._take(cues, accepted)
        target = self._expected() if self.follows else AT_REST
        if self._given and (followed != self.follows or self._gap > 0.0):
            self._turn(target, rejoins=not followed)
        given = target if self._blend.over else target + self._blend.step()
        self._heard.append(target if self.follows else self._raw)
        self._given.append(given)
        return given

    def _expected(self) -> Floats:
        """The newest cues that were believed; led on by their trend where one is known to be missing."""
        missing = self._suspects or self._copied or (self._waited and self._interval < _MISSING * TIME_STEP)
        if not missing or not self._waited:
            return self._good
        lead = TIME_STEP * min(self._waited, _LEAD)
        return np.asarray(self._good + lead * self._trend)

    def _turn(self, target: Floats, rejoins: bool) -> None:
        """Begin a blend from what was given to a target, with the slopes of both."""
        slope = _trend(self._given)
        ahead = np.zeros(6) if not self.follows else _trend(self._heard) if rejoins else slope
        fade = self._options.fade
        seconds = min(_BLEND * self._gap, fade) if self._gap > 0.0 and not rejoins else fade
        self._blend.start(self._given[-1] - (target - ahead * TIME_STEP), slope - ahead, seconds)

    def _distrust(self, kind: str, again: bool = False) -> None:
        self.counts[kind] += not again
        self.follows, self._calm, self._suspects, self._copied = False, 0.0, 0, False

    def _take(self, cues: Cues, accepted: int) -> None:
        """Judge a packet that has come since the last time step."""
        raw, last, before = np.array(cues.force + cues.rate), self._last, self._raw
        lost = last is not None and cues.sequence - last.sequence > accepted - self._accepted
        self._last, self._accepted, self._raw = cues, accepted, raw
        if last is None:
            self._accept(raw)
            return
        elapsed = max(cues.time - last.time, TIME_STEP)
        self._interval = (cues.time - last.time) / max(cues.sequence - last.sequence, 1)
        self._since_good += elapsed
        same, rest = ((raw == other).reshape(2, 3).all(axis=1) for other in (before, AT_REST))
        self._frozen = np.where(same & ~rest, self._frozen + elapsed, 0.0)
        stuck = bool((self._frozen >= self._options.stuck).any())
        if not self.follows:
            calm = not stuck and self._near(raw, before, elapsed)
            # A pause is no time in which cues were seen to be calm.
            self._calm = self._calm + min(elapsed, self._overdue) if calm else 0.0
            if self._calm >= self._options.settle:
                self.follows = True
                self._accept(raw)
        elif stuck:
            self._distrust("stuck")
        elif same.all() and not rest.all() and not self._suspects:
            self.counts["copies"] += 1
            self._copied = True
        elif self._near(raw, self._good, self._since_good):
            gap = elapsed > self._overdue or (lost and elapsed > 1.5 * TIME_STEP)
            self.counts["spikes"] += self._suspects > 0
            self.counts["gaps"] += gap
            if gap or self._suspects or self._copied:
                self._gap = self._since_good
            self._accept(raw)
        else:
            self._suspects += 1
            if self._suspects > self._options.spike:
                self._distrust("jumps")

    def _accept(self, raw: Floats) -> None:
        self._good, self._since_good = raw, 0.0
        self._suspects, self._waited, self._copied = 0, 0, False
        if self._heard:
            self._trend = (raw - self._heard[0]) / (TIME_STEP * len(self._heard))

    def _near(self, raw: Floats, reference: Floats, elapsed: float) -> bool:
        """Whether cues can have changed so much in this time."""
        return bool((np.abs(raw - reference) <= self._slew * elapsed).all())


def _trend(rows: deque[Floats]) -> Floats:
    """(6,) rate of change over rows of one time step each."""
    return (rows[-1] - rows[0]) / (TIME_STEP * max(len(rows) - 1, 1))
