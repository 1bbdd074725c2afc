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
_DONE: Final = np.repeat([1e-4, 1e-5], 3)
"""Distance, m/s^2 and rad/s, and rate of change a second, at which a blend ends: nobody feels it."""


@configuration
class GuardOptions:
    """What the guard takes for a car's cues, and how smoothly it reacts to anything else.

    The slews are for road cars. The hardest drives of this package stay below two thirds of them: the standard
    maneuvers, random drives of each kind on roads of up to 256e-6 m^3 (ISO 8608, average), emergency stops,
    drives at the limit of the tires, and recorded drives. Their largest are 53 m/s^3 along (a stop), 45 across,
    68 vertically and 2.3 rad/s^2.

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
    jerk: Positive = 10.0
    angular_acceleration: Positive = 1.0


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

    def start(self, distance: Floats, seconds: float) -> None:
        """Blend from a distance on, within about ``seconds``; one that still goes on is never sped up."""
        self._distance = distance
        self._frequency = min(self._frequency, _SETTLED / seconds)
        self.over = False

    def step(self) -> Floats:
        """(6,) distance a time step later."""
        w, dt = self._frequency, TIME_STEP
        # Both roots of the spring are at -w: this is its exact step.
        lead = self._rate + w * self._distance
        decay = np.exp(-w * dt)
        moved = decay * (self._distance + lead * dt)
        bound = self._slope * dt
        moved = self._distance + np.clip(moved - self._distance, -bound, bound)
        self._rate = np.clip(decay * (self._rate - w * lead * dt), -self._slope, self._slope)
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
        self.reset()

    def reset(self) -> None:
        """Judge the next cues as the first of a sender."""
        self._last: Cues | None = None
        self._accepted = 0
        self._raw = self._good = AT_REST
        self._since_good = self._calm = 0.0
        self._frozen = np.zeros(2)
        self._suspects = 0
        self._paused = self._stepped = self._copied = False
        self.follows = True
        self.begin()

    def begin(self) -> None:
        """The policy begins: nothing was given before."""
        self._blend.stop()
        self._given = AT_REST
        self._gap = 0.0
        self._stepped = False

    def __call__(self, cues: Cues, paused: bool, accepted: int) -> Floats:
        """(6,) cues for the policy: force, m/s^2, angular velocity, rad/s.

        Args:
            cues: The newest.
            paused: Whether the sender has said since that its drive is paused.
            accepted: Packets that were whole, new and in time so far.
        """
        followed = self.follows
        if paused:
            self._distrust("pauses", already=self._paused)
        self._paused = paused
        if self._last is None or cues.sequence != self._last.sequence:
            self._take(cues, accepted)
        target = self._good if self.follows else AT_REST
        if followed != self.follows or self._stepped:
            quick = self._stepped and followed and self.follows
            seconds = min(_BLEND * self._gap, self._options.fade) if quick else self._options.fade
            self._blend.start(self._given - target, seconds)
            self._stepped = False
        self._given = target if self._blend.over else target + self._blend.step()
        return self._given

    def _distrust(self, kind: str, already: bool) -> None:
        self.counts[kind] += not already
        self.follows, self._calm, self._suspects = False, 0.0, 0

    def _take(self, cues: Cues, accepted: int) -> None:
        """Judge a packet that has come since the last time step."""
        raw, last = np.array(cues.force + cues.rate), self._last
        elapsed = TIME_STEP if last is None else max(cues.time - last.time, TIME_STEP)
        lost = last is not None and cues.sequence - last.sequence > accepted - self._accepted
        self._last, self._accepted = cues, accepted
        before, self._raw = self._raw, raw
        if last is None:
            self._good = raw
            return
        copy = bool((raw == before).all() and (raw != AT_REST).any())
        self._freeze(before, raw, elapsed)
        self._since_good += elapsed
        if not self.follows:
            calm = self._near(raw, before, elapsed) and not self._is_stuck
            self._calm = self._calm + elapsed if calm else 0.0
            if self._calm >= self._options.settle:
                self.follows = True
                self._accept(raw)
        elif self._is_stuck:
            self._distrust("stuck", already=False)
        elif copy and not self._suspects:
            self.counts["copies"] += 1
            self._copied = True
        elif self._near(raw, self._good, self._since_good):
            missing = (lost or self._copied) and self._since_good > 1.5 * TIME_STEP
            if self._suspects:
                self.counts["spikes"] += 1
            elif lost or elapsed > self._overdue:
                self.counts["gaps"] += missing or elapsed > self._overdue
            if self._suspects or missing or elapsed > self._overdue:
                self._gap, self._stepped = self._since_good, True
            self._accept(raw)
        else:
            self._suspects += 1
            if self._suspects > self._options.spike:
                self._distrust("jumps", already=False)

    def _accept(self, raw: Floats) -> None:
        self._good, self._since_good = raw, 0.0
        self._suspects, self._copied = 0, False

    def _near(self, raw: Floats, reference: Floats, elapsed: float) -> bool:
        """Whether cues can have changed so much in this time."""
        return bool((np.abs(raw - reference) <= self._slew * elapsed).all())

    def _freeze(self, before: Floats, raw: Floats, elapsed: float) -> None:
        """Measure for how long force and angular velocity have been the same, other than at rest."""
        same, rest = ((raw == other).reshape(2, 3).all(axis=1) for other in (before, AT_REST))
        self._frozen = np.where(same & ~rest, self._frozen + elapsed, 0.0)

    @property
    def _is_stuck(self) -> bool:
        return bool((self._frozen >= self._options.stuck).any())
