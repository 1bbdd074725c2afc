"""What the controller did, step by step: little enough to keep for hours, enough to do it again."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.interface import Interface, MachineInterface, Machines
from ..baselines.policy import Policy, Wrapper, as_policy
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.perception import get_vestibular_model
from ..envs.platform import Platform
from ..envs.settings import configuration
from ..envs.simulator.simulator import N_AXES, TIME_STEP
from ..evaluation.rollout import Rollout, record, trajectory_of
from ..evaluation.suite import explain
from ..evaluation.trajectory import Trajectory
from .inbox import Inbox
from .machine import AT_REST, LiveMachine, Track
from .packets import NO_SEQUENCE, SetPoint
from .watchdog import Homing, HomingOptions, Patience, Situation, State, next_state

Floats = NDArray[np.float64]

_CUES: Final = slice(0, 6)
_ACTION: Final = slice(6, 6 + N_AXES)
_SECONDS: Final = 15
_STATE: Final = 16
_SIZE: Final = 17
_CHUNK: Final = 6000
"""Rows that are made room for at a time, a minute: a list of an hour would take long to grow."""


class LoopLog:
    """A row a time step: cues in use, accelerations asked for, time the policy took, state."""

    def __init__(self) -> None:
        self._chunks: list[Floats] = []
        self._rows = 0

    def __len__(self) -> int:
        return self._rows

    def add(self, cues: Floats, action: Floats, seconds: float, state: State) -> None:
        """Keep a step.

        Args:
            cues: (6,) specific force, m/s^2, and angular velocity, rad/s, at its begin.
            action: (9,) accelerations in it, m/s^2 and rad/s^2.
            seconds: Time the policy took; NaN if it was not asked.
            state: Of the controller.
        """
        place = self._rows % _CHUNK
        if place == 0:
            self._chunks.append(np.zeros((_CHUNK, _SIZE)))
        row = self._chunks[-1][place]
        row[_CUES], row[_ACTION], row[_SECONDS], row[_STATE] = cues, action, seconds, state
        self._rows += 1

    @property
    def states(self) -> NDArray[np.int64]:
        """(n,) state in each step."""
        return self._table()[:, _STATE].astype(np.int64)

    def trajectory(self, platform: Platform, start: ArrayLike, vestibular: str, policy: Any) -> Trajectory:
        """The drive as any other is recorded: its steps taken once more, with the same accelerations.

        Args:
            platform: The machine.
            start: (9,) pose it began at.
            vestibular: Perception model by name.
            policy: For its name, its parameters and its statistics.
        """
        table = self._table()
        machines = Machines([_cues_of(table)], [platform], None, get_vestibular_model(vestibular))
        run = Rollout(_Replay(as_policy(policy), table[:, _ACTION]), machines, start)
        trajectory = trajectory_of(record(run), run)
        steps = {f"loop_{state.name.lower()}": str(int((self.states == state).sum())) for state in State}
        return replace(
            trajectory,
            step_time=np.append(math.nan, table[:-1, _SECONDS]),
            metadata={**trajectory.metadata, **steps},
        )

    def _table(self) -> Floats:
        if not self._chunks:
            return np.zeros((0, _SIZE))
        return np.concatenate(self._chunks)[: self._rows]


class _Replay(Wrapper):
    """The logged accelerations again, in the name of the policy that asked for them.

    Args:
        policy: The policy.
        actions: (n, 9) accelerations of each step.
    """

    def __init__(self, policy: Policy, actions: Floats) -> None:
        super().__init__(policy)
        self.task, self.time_step, self._actions = None, TIME_STEP, actions

    def connect(self, machines: Machines) -> Interface:
        """Whatever the policy sees: it only asks for accelerations."""
        return MachineInterface(machines)

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], int]:
        """The next ones; the state is the number of steps done."""
        step = 0 if state is None else int(state)
        return self._actions[step : step + 1], step + 1


def _cues_of(table: Floats) -> CueTrace:
    """The cues in use, with the angular acceleration the controller took."""
    rate = table[:, 3:6]
    change = np.diff(rate, axis=0, prepend=rate[:1]) / TIME_STEP
    time = np.asarray(TIME_STEP * np.arange(len(table)), dtype=np.float64)
    return CueTrace("loop", time, table[:, :3], rate, change, source="in the loop")


# The controller: packets in, set-points out, period by period. It knows no clock and no socket.
#
# packets -> inbox -> watchdog -> policy or the way home -> **limits of the machine** -> set-points


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
        self.log.add(self._machine.reference_cue, action, seconds, self.state)
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
