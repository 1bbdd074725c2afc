"""The controller of the real-time loop: packets in, set-points out, period by period. No clock, no socket.

packets -> inbox -> guard -> watchdog -> policy, or brake to neutral -> limits of the machine -> set-points

Policies act every 10 ms, as in an evaluation. Set-points within such a time step are interpolated
(:class:`~.machine.Track`).
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.interface import Interface, MachineInterface, Machines
from ..baselines.policy import Policy, Wrapper, as_policy
from ..envs.cues import UNSCALED, CueScale, CueTrace
from ..envs.errors import ConfigurationError
from ..envs.perception import get_vestibular_model
from ..envs.platform import Platform
from ..envs.settings import configuration
from ..envs.simulator.simulator import N_AXES, TIME_STEP
from ..evaluation.rollout import Rollout, record, trajectory_of
from ..evaluation.suite import FOLLOWED, explain
from ..evaluation.trajectory import Trajectory
from .guard import Guard, GuardOptions
from .inbox import Inbox
from .machine import AT_REST, LiveMachine, Track
from .packets import NO_SEQUENCE, Cues, SetPoint
from .watchdog import BrakeOptions, BrakeToNeutral, Situation, State, WatchdogOptions, next_state

Floats = NDArray[np.float64]

_ROW: Final = np.dtype([("cues", "f8", 6), ("action", "f8", 9), ("seconds", "f8"), ("state", "i8")])
_CHUNK: Final = 6000
"""Rows allocated at a time, one minute: growing one array of an hour would stall the loop."""


class LoopLog:
    """One row a time step: cues in use, accelerations, time the policy took, state of the controller.

    Args:
        scale: Motion scale at which cues are logged.
    """

    def __init__(self, scale: CueScale = UNSCALED) -> None:
        self._scale = scale
        self._chunks: list[NDArray[Any]] = []
        self._length = 0

    def __len__(self) -> int:
        return self._length

    def add(self, cues: Floats, action: Floats, seconds: float, state: State) -> None:
        """Log a time step.

        Args:
            cues: (6,) specific force, m/s^2, and angular velocity, rad/s, at its begin.
            action: (9,) accelerations in it, m/s^2 and rad/s^2.
            seconds: Time the policy took; NaN if it did not act.
            state: Of the controller.
        """
        row = self._length % _CHUNK
        if row == 0:
            self._chunks.append(np.zeros(_CHUNK, _ROW))
        self._chunks[-1][row] = (cues, action, seconds, state)
        self._length += 1

    @property
    def rows(self) -> NDArray[Any]:
        """(n,) rows with the fields cues, action, seconds and state."""
        return np.concatenate([np.zeros(0, _ROW), *self._chunks])[: self._length]

    @property
    def states(self) -> NDArray[np.int64]:
        """(n,) state in each time step."""
        return np.asarray(self.rows["state"])

    @property
    def followed(self) -> list[tuple[int, int]]:
        """First row and end of each stretch in which the policy moved the machine."""
        moves = np.isin(self.states, [state for state in State if state.follows])
        edges = np.flatnonzero(np.diff(moves, prepend=False, append=False))
        return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]

    def trajectory(self, platform: Platform, start: ArrayLike, vestibular: str, policy: Any) -> Trajectory:
        """The drive as a trajectory: its time steps are simulated again, with the same accelerations.

        Every step is in it. The metadata name those that the policy moved, which alone are scored.

        Args:
            platform: The machine.
            start: (9,) pose it began at.
            vestibular: Perception model by name.
            policy: For its name, its parameters and its statistics.
        """
        rows, states = self.rows, self.states
        force, rate = rows["cues"][:, :3], rows["cues"][:, 3:]
        # The controller had the angular acceleration of the step before.
        change = np.diff(rate, axis=0, prepend=rate[:1]) / TIME_STEP
        time = np.asarray(TIME_STEP * np.arange(len(rows)), dtype=np.float64)
        cues = CueTrace("loop", time, force, rate, change, source="in the loop", scale=self._scale)
        machines = Machines([cues], [platform], None, get_vestibular_model(vestibular))
        run = Rollout(_Replay(as_policy(policy), rows["action"]), machines, start)
        steps = {f"loop_{state.name.lower()}": str(int((states == state).sum())) for state in State}
        trajectory = trajectory_of(record(run)[0], run)
        return replace(
            trajectory,
            step_time=np.append(math.nan, rows["seconds"][:-1]),
            metadata={**trajectory.metadata, **steps, FOLLOWED: json.dumps(self.followed)},
        )


class _Replay(Wrapper):
    """The logged accelerations again, in the name of the policy.

    Args:
        policy: The policy.
        actions: (n, 9) accelerations of each time step.
    """

    def __init__(self, policy: Policy, actions: Floats) -> None:
        super().__init__(policy)
        self.task, self.time_step, self._actions = None, TIME_STEP, actions

    def connect(self, machines: Machines) -> Interface:
        """The interface of accelerations, whatever the policy sees."""
        return MachineInterface(machines)

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], int]:
        """The accelerations of the next time step; the state is the number of steps done."""
        step = 0 if state is None else int(state)
        return self._actions[step : step + 1], step + 1


@configuration
class ControllerOptions:
    """Options of the controller.

    Args:
        rate: Set-points a second; a multiple of the policies' 100.
        watchdog: Its time limits.
        brake: How the machine brakes to neutral.
        guard: Which cues are believed.
        scale: Motion scale: cues are scaled before the policy sees them, and are logged so.
    """

    rate: int = 1000
    watchdog: WatchdogOptions = WatchdogOptions()
    brake: BrakeOptions = BrakeOptions()
    guard: GuardOptions = GuardOptions()
    scale: CueScale = UNSCALED

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
        options: Rate, watchdog, brake and guard.

    Attributes:
        guard: Judges the cues.
        state: Of the watchdog.
        log: Of every time step.
        faults: Errors that the policy raised, in words.
        periods: Set-points made.
    """

    def __init__(
        self, machine: LiveMachine, platform: Platform, inbox: Inbox, options: ControllerOptions
    ) -> None:
        self.inbox, self._machine, self._options = inbox, machine, options.watchdog
        self._scale = options.scale
        self.state, self.log = State.NEUTRAL, LoopLog(options.scale)
        self.faults: list[str] = []
        self.periods = 0
        self.guard = Guard(options.guard, options.watchdog.overdue)
        self._brake = BrakeToNeutral(platform, machine.start, options.brake)
        self._acceleration: Floats = np.zeros(N_AXES)
        self._per_step = round(options.rate * TIME_STEP)
        self._track = Track(self._per_step, TIME_STEP)
        self._motions: Floats = np.zeros((0, 0))
        self._echo = (NO_SEQUENCE, 0.0, 0.0)
        self._stopping = self._decided = False
        self._faded = 0

    @property
    def decides(self) -> bool:
        """Whether the next period begins a time step that is not decided yet."""
        return self.periods % self._per_step == 0 and not self._decided

    @property
    def finished(self) -> bool:
        """Whether it was stopped, and the machine rests at its start pose."""
        return self._stopping and self.state is State.NEUTRAL

    def stop(self) -> None:
        """Brake to neutral, and stay there."""
        self._stopping = True

    def period(self, now: float) -> SetPoint:
        """The set-point for the end of a period.

        Args:
            now: When it begins, s of the clock that packets are received by.
        """
        if self.decides:
            self.decide(now)
        self._decided = False
        motion = self._motions[self.periods % self._per_step]
        self.periods += 1
        return SetPoint(self.state, self.periods - 1, *self._echo, now, motion)

    def decide(self, now: float) -> None:
        """Take the next time step; once before its first period, as late as its time allows.

        Args:
            now: As of :meth:`period`.
        """
        machine, age, before = self._machine, self.inbox.age(now), self.state
        neutral = self._brake.at_rest(machine.motion)
        situation = Situation(age, self.inbox.steady, neutral, bool(self.faults), self._stopping)
        self.state = next_state(before, situation, self._options)
        if not self.state.follows and age > self._options.hold:
            self.inbox.reset()
            self.guard.reset()
        begins = self.state.follows and not before.follows
        if begins:
            self._faded = 0
            self.guard.begin()
        begin = machine.motion
        try:
            machine.catch_up(self._cues(), self._known())
        # A policy is a user's code: whatever it raises, the machine must return to neutral.
        except Exception as error:
            self._fail(error)
        action, seconds = self._move(begins)
        self.log.add(machine.reference_cue, action, seconds, self.state)
        self._acceleration = (machine.motion[1, :N_AXES] - begin[1, :N_AXES]) / TIME_STEP
        self._motions = self._track.between(begin, machine.motion)
        self._decided = True

    def _move(self, begins: bool) -> tuple[Floats, float]:
        """Move the machine by its policy, or brake; returns accelerations and the policy's time."""
        if self.state.follows:
            try:
                if begins:
                    self._machine.begin()
                return self._machine.act()
            except Exception as error:
                self._fail(error)
        action = self._brake.accelerations(self._machine.motion, self._acceleration)
        self._machine.move(action)
        return action, math.nan

    def _fail(self, error: Exception) -> None:
        self.faults.append(explain(error))
        self.state = State.BRAKING

    def _known(self) -> Cues | None:
        """The packet with controls and road, while its cues are followed."""
        return self.inbox.newest if self.state.follows and self.guard.follows else None

    def _cues(self) -> Floats:
        """(6,) cues for the policy: of a standing car unless it acts. They fade in when it begins."""
        inbox, fade = self.inbox, self._options.fade
        if inbox.newest is None:
            return AT_REST
        cues = self.guard(inbox.newest, inbox.paused, inbox.accepted)
        if not self._scale.neutral:
            cues = np.concatenate([self._scale.of_force(cues[:3]), self._scale.of_rates(cues[3:])])
        if not self.state.follows:
            return AT_REST
        if self.guard.follows:
            self._echo = inbox.newest.sequence, inbox.newest.time, inbox.arrival
        share = min(self._faded * TIME_STEP / fade, 1.0) if fade > 0.0 else 1.0
        self._faded += 1
        return np.asarray(AT_REST + share * (cues - AT_REST))
