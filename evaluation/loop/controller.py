"""The controller: packets in, set-points out, period by period. It knows no clock and no socket.

packets -> inbox -> watchdog -> policy or the way home -> **limits of the machine** -> set-points
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...envs.errors import ConfigurationError
from ...envs.platform import Platform
from ...envs.settings import configuration
from ...envs.simulator import TIME_STEP
from ..suite import explain
from .homing import Homing, HomingOptions
from .inbox import Inbox
from .live_cues import AT_REST
from .log import LoopLog
from .machine import LiveMachine
from .packets import NO_SEQUENCE, SetPoint
from .track import Track
from .watchdog import Patience, Situation, State, next_state

Floats = NDArray[np.float64]

_FOLLOWED: Final = (State.RUNNING, State.HOLDING)
"""States in which the policy moves the machine."""


@configuration
class ControllerOptions:
    """What can be chosen about the controller.

    Args:
        rate: Set-points a second; a multiple of the policies' 100.
        patience: Of the watchdog.
        homing: How the machine goes home.
    """

    rate: int = 1000
    patience: Patience = Patience()
    homing: HomingOptions = HomingOptions()

    def __post_init__(self) -> None:
        decisions = round(1.0 / TIME_STEP)
        if self.rate < decisions or self.rate % decisions:
            raise ConfigurationError(
                f"rate must be a multiple of {decisions} a second, at which policies act, found {self.rate}"
            )


class Controller:
    """A policy on its machine, fed by packets.

    Args:
        machine: With the policy.
        platform: The machine's limits.
        inbox: Sorts the packets.
        options: What can be chosen.

    Attributes:
        state: What it does.
        log: What it did.
        faults: What the policy raised, in words.
        periods: Set-points made.
    """

    def __init__(
        self, machine: LiveMachine, platform: Platform, inbox: Inbox, options: ControllerOptions
    ) -> None:
        self.inbox, self._machine, self._patience = inbox, machine, options.patience
        self.state, self.log = State.NEUTRAL, LoopLog()
        self.faults: list[str] = []
        self.periods = 0
        self._homing = Homing(platform, machine.start, options.homing)
        self._per_step = round(options.rate * TIME_STEP)
        self._track = Track(self._per_step, TIME_STEP)
        self._rows: Floats = np.zeros((0, 0))
        self._used = (NO_SEQUENCE, 0.0, 0.0)
        self._stopping = self._decided = False
        self._began = -1

    @property
    def decides(self) -> bool:
        """Whether the next period begins a time step that is not decided yet."""
        return self.periods % self._per_step == 0 and not self._decided

    @property
    def finished(self) -> bool:
        """Whether it was stopped, and the machine rests at its start pose."""
        return self._stopping and self.state is State.NEUTRAL

    def stop(self) -> None:
        """Brake, go home, and stay there."""
        self._stopping = True

    def period(self, now: float) -> SetPoint:
        """The set-point for the end of a period.

        Args:
            now: When it begins, s of the clock that packets are received by.
        """
        if self.decides:
            self.decide(now)
        self._decided = False
        row = self._rows[self.periods % self._per_step]
        self.periods += 1
        return SetPoint(self.state, self.periods - 1, *self._used, now, row)

    def decide(self, now: float) -> None:
        """Take the next time step; once before its first period, as late as its time allows.

        Args:
            now: As of :meth:`period`.
        """
        before = self.state
        self.state = next_state(before, self._situation(now), self._patience)
        if self.state not in _FOLLOWED and self.inbox.age(now) > self._patience.hold:
            self.inbox.renew()
        if before not in _FOLLOWED and self.state in _FOLLOWED:
            self._began = len(self.log)
        begin = self._machine.motion
        self._catch_up()
        action, seconds = self._moved(begins=self._began == len(self.log))
        self.log.add(self._machine.wanted, action, seconds, self.state)
        self._rows = self._track.between(begin, self._machine.motion)
        self._decided = True

    def _situation(self, now: float) -> Situation:
        return Situation(
            age=self.inbox.age(now),
            steady=self.inbox.steady,
            home=self._homing.arrived(self._machine.motion),
            faulted=bool(self.faults),
            stopping=self._stopping,
        )

    def _catch_up(self) -> None:
        try:
            self._machine.catch_up(self._cues())
        # A policy is a user's code: whatever it raises, the machine must come home.
        except Exception as error:
            self._fault(error)

    def _moved(self, begins: bool) -> tuple[Floats, float]:
        """Move the machine, by its policy if that may and can, else homewards; accelerations, time of it."""
        if self.state in _FOLLOWED:
            try:
                if begins:
                    self._machine.begin()
                return self._machine.act()
            except Exception as error:
                self._fault(error)
        action = self._homing.accelerations(self._machine.motion)
        self._machine.move(action)
        return action, math.nan

    def _fault(self, error: Exception) -> None:
        self.faults.append(explain(error))
        self.state = State.BRAKING

    def _cues(self) -> Floats:
        """(6,) cues for the policy: of a standing car unless it acts, faded in when it begins."""
        newest = self.inbox.newest
        if self.state not in _FOLLOWED or newest is None:
            return AT_REST
        self._used = newest.sequence, newest.time, self.inbox.arrival
        ran = (len(self.log) - self._began) * TIME_STEP
        share = min(ran / self._patience.fade, 1.0) if self._patience.fade > 0.0 else 1.0
        return np.asarray(AT_REST + share * (np.array(newest.force + newest.rate) - AT_REST))
