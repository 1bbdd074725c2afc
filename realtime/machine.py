"""Cues that come while the machine moves, where its kernels look for those of a drive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..baselines.policy import ForeknowingPolicy, Policy, start_of
from ..envs.arrays import Mirror
from ..envs.cues import GRAVITY, CueTrace
from ..envs.errors import ActionError, ConfigurationError
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform
from ..envs.platform.kernels.step import CARRIAGE, LEGS, TURNTABLE
from ..envs.simulator.kernels.observation import SCALES
from ..envs.simulator.simulator import N_AXES, TIME_STEP, Simulator
from ..envs.task.batch import Batch
from ..evaluation.rollout import Asked, Observer, TaskPolicy, deterministic, on_machine
from ..evaluation.suite import explain
from .packets import MOTION, MOTION_SIZE

Floats = NDArray[np.float64]

AT_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Cues of a car that stands: specific force and angular velocity; read-only."""
AT_REST.setflags(write=False)

_SCALE: Final = np.repeat([SCALES["reference_force"], SCALES["reference_rate"]], 3)

NOW: Final = 1
"""Row of the cues that are wanted now; the kernels step to it from the row before."""


def standing(ahead: int) -> CueTrace:
    """The drive whose rows :class:`LiveCues` fills: what was, what is, and ``ahead`` steps to come."""
    n = NOW + 1 + ahead
    time = np.asarray(TIME_STEP * np.arange(n), dtype=np.float64)
    return CueTrace("live", time, np.tile(AT_REST[:3], (n, 1)), np.zeros((n, 3)))


class LiveCues:
    """The rows of a simulator's only drive, moved on by one each time step, the newest cues at their end.

    A policy that looks ahead sees the newest cues that far ahead.

    Args:
        simulator: With one environment on the CPU and the drive of :func:`standing`.
        memory: Where an environment keeps low-passed cues of each row.
        time_constants: Of the low-passes, s.
    """

    def __init__(
        self, simulator: Simulator, memory: Mirror | None = None, time_constants: Sequence[float] = ()
    ) -> None:
        drives = simulator.constants[2]
        self._simulator = simulator
        self._rows = [drives.force.numpy(), drives.rate.numpy(), drives.rate_derivative.numpy()]
        # Views that are made once: each step of a millisecond counts.
        self._moves = [(rows[:-1], rows[1:], rows[-1]) for rows in self._rows]
        self._samples = [states.numpy()["sample"] for states, _ in simulator.copies]
        self._memory = memory.view if memory is not None and time_constants else None
        self._poles = np.exp(-TIME_STEP / np.array(time_constants, dtype=np.float64))[:, None]
        self._past: Floats = np.tile(self._scaled(), (len(time_constants), 1))

    @property
    def reference_cue(self) -> Floats:
        """(6,) cues wanted now."""
        return np.concatenate([self._rows[0][NOW], self._rows[1][NOW]])

    def put(self, cues: Floats) -> None:
        """Move on by a time step, with the newest cues (6,): force, m/s^2, angular velocity, rad/s."""
        change = (cues[3:] - self._moves[1][2]) / TIME_STEP
        for (earlier, later, last), newest in zip(self._moves, (cues[:3], cues[3:], change), strict=True):
            earlier[...] = later
            last[...] = newest
        # The kernels count samples; here the sample they step to is always the same row.
        self._samples[self._simulator.current][...] = NOW - 1
        if self._memory is not None:
            self._past = self._poles * self._past + (1.0 - self._poles) * self._scaled()
            self._remember()

    def begin(self) -> None:
        """Take the car to have moved for ever as it moves now, as at the beginning of any drive."""
        self._past[...] = self._scaled()
        self._remember()

    def _scaled(self) -> Floats:
        """(6,) cues wanted now, as an observation scales them."""
        return np.asarray((self.reference_cue - AT_REST) / _SCALE)

    def _remember(self) -> None:
        if self._memory is not None:
            self._memory[NOW] = self._past.ravel()


# One batch brought to where another one is, fast: its arrays are copied as bytes.


Bytes = NDArray[np.uint8]


class Twin:
    """A batch on the CPU that follows another one made alike.

    Batches have snapshots for this; in real time those take too long.

    Args:
        leader: Where it is brought to.
        follower: That is brought there.
    """

    def __init__(self, leader: Batch, follower: Batch) -> None:
        self._leader, self._follower = leader, follower
        arrays = zip(vars(leader.arrays).values(), vars(follower.arrays).values(), strict=True)
        self._arrays = [(_bytes_of(a.view), _bytes_of(b.view)) for a, b in arrays]
        self._states = [_states_of(batch) for batch in (leader, follower)]

    def follow(self) -> None:
        """Bring the follower to where the leader is."""
        for source, target in self._arrays:
            target[...] = source
        leader, follower = self._leader, self._follower
        sources, targets = self._states
        pairs = zip(sources[leader.simulator.current], targets[follower.simulator.current], strict=True)
        for source, target in pairs:
            target[...] = source
        follower.base.restore(leader.base.snapshot())


def _states_of(batch: Batch) -> list[tuple[Bytes, ...]]:
    """Bytes of state and earlier set-points, for both copies that hold in turn."""
    return [tuple(_bytes_of(array.numpy()) for array in pair) for pair in batch.simulator.copies]


def _bytes_of(array: Any) -> Bytes:
    """The memory of an array, flat; no copy."""
    return np.asarray(array).reshape(-1).view(np.uint8)


# Set-points between two time steps of the machine, at a higher rate.
#
# Within a step an actuator moves with constant acceleration. Velocity goes in a straight line from one
# step to
# the next, acceleration is its slope, and position follows Hermite's cubic, which is the parabola
# itself where
# the motion is that of constant acceleration. So velocities and accelerations keep the limits the steps keep.


AXES_AND_LEGS: Final = 15
"""Entries of a :class:`MotionView`."""


class MotionView:
    """Reads where a machine's set-point is, fast: its memory is found once, not field by field each time.

    Args:
        simulator: With one environment on the CPU.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._parts = [_parts_of(states.numpy()[0]["setpoint"]) for states, _ in simulator.copies]

    def __call__(self) -> Floats:
        """(2, 15) positions and rates of the nine axes and the six legs; m, rad, from neutral."""
        positions, rates = self._parts[self._simulator.current]
        return np.concatenate(positions + rates).reshape(2, AXES_AND_LEGS)


def _parts_of(motion: Any) -> tuple[list[Floats], list[Floats]]:
    """Views of positions and rates of a ``Motion``: axes in the order of ``AXES``, then legs."""
    position, rate = motion["position"], motion["rate"]
    table = slice(TURNTABLE, TURNTABLE + 1)
    return (
        [position[CARRIAGE], motion["displacement"], motion["beta"], position[table], position[LEGS]],
        [rate[CARRIAGE], motion["velocity"], motion["beta_rate"], rate[table], rate[LEGS]],
    )


class Track:
    """Set-points of one time step, for the end of each of its periods.

    Args:
        periods: In a time step.
        dt: Time step, s.
    """

    def __init__(self, periods: int, dt: float) -> None:
        s = np.arange(1, periods + 1)[:, None] / periods
        self._share, self._dt = s, dt
        # Hermite's basis for p0, p1 and the rates at both ends.
        self._basis = np.hstack(
            [(1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s), dt * s * (1 - s) ** 2, dt * s**2 * (s - 1)]
        )

    def between(self, begin: Floats, end: Floats) -> Floats:
        """(periods, 39) numbers of the set-points between two motions of :class:`MotionView`."""
        position = self._basis @ np.vstack([begin[0], end[0], begin[1], end[1]])
        rate = begin[1] + self._share * (end[1] - begin[1])
        # To the bit: the last set-point is the step's end.
        position[-1], rate[-1] = end
        out = np.empty((len(position), MOTION_SIZE))
        out[:, MOTION["position"]], out[:, MOTION["legs"]] = position[:, :9], position[:, 9:]
        out[:, MOTION["velocity"]], out[:, MOTION["leg_rates"]] = rate[:, :9], rate[:, 9:]
        out[:, MOTION["acceleration"]] = (end[1, :9] - begin[1, :9]) / self._dt
        return out


# A policy with its machine in real time: the machine up to now, and the same one step ahead.
#
# A rollout knows the cues at the end of a step when it takes it; here they are still to come. So each step is
# taken twice: at its begin by the machine ahead, whose motion is sent (it does not depend on the cues
# wanted),
# and at its end by the machine now, with the cues that have come since: this one the policy sees. Both
# take the
# very steps of a rollout.


_WARMING: Final = 4
"""Steps that meet both copies of every state."""


class LiveMachine(ABC):
    """One machine that moves while its cues come.

    Args:
        now: Where it is, with the live drive of ``cues``.
        ahead: The same a time step later.
        cues: Of ``now``.
        start: (9,) pose to begin at.

    Attributes:
        ahead_steps: Time steps that the policy looks ahead.
        motion: (2, 15) set-point of the machine ahead, see :class:`~.track.MotionView`.
    """

    ahead_steps = 0

    def __init__(self, now: Simulator, ahead: Simulator, cues: LiveCues, start: ArrayLike) -> None:
        self.now, self.ahead, self._cues = now, ahead, cues
        self._view = MotionView(ahead)
        self.start = np.asarray(start, dtype=np.float64)
        self._last: Floats | None = None
        self.reset()

    def reset(self) -> None:
        """Put the machine at rest at its start pose."""
        for simulator in (self.now, self.ahead):
            simulator.reset(self.start)
        self._last = None
        self.motion = self._view()

    @property
    def reference_cue(self) -> Floats:
        """(6,) cues wanted now: specific force, m/s^2, and angular velocity, rad/s."""
        return self._cues.reference_cue

    def catch_up(self, cues: Floats) -> None:
        """Take the machine to where it was a step ahead, with the cues (6,) that are wanted there.

        Raises:
            Exception: whatever the policy's own code does; the machine is there all the same.
        """
        self._cues.put(cues)
        if self._last is None:
            self.now.reset(self.start, sample=NOW)
            return
        try:
            self._follow(self._last)
        except Exception:
            self.now.restore(self.ahead.snapshot())
            raise

    def act(self) -> tuple[Floats, float]:
        """Let the policy act; returns the (9,) accelerations it asks for, and the seconds it took.

        Raises:
            Exception: whatever the policy's own code does, or an ActionError; nothing has moved then.
        """
        try:
            asked, seconds = self._lead()
            self._arrive()
        except Exception:
            self.ahead.restore(self.now.snapshot())
            raise
        self._last = asked
        return asked, seconds

    def move(self, accelerations: Floats) -> None:
        """Take the next step with (9,) accelerations of ours instead of the policy's."""
        self._let_go()
        self.ahead.step(accelerations)
        self._arrive()
        self._last = accelerations

    @abstractmethod
    def begin(self) -> None:
        """The policy begins anew, from where the machine is."""

    @abstractmethod
    def _follow(self, accelerations: Floats) -> None:
        """Take the machine now through the last step of the machine ahead."""

    @abstractmethod
    def _lead(self) -> tuple[Floats, float]:
        """Ask the policy, and take the machine ahead through the next step."""

    def _let_go(self) -> None:
        """Forget what the policy had begun."""
        return

    def _arrive(self) -> None:
        motion = self._view()
        if not np.isfinite(motion).all():
            raise ActionError("the policy asked for accelerations beyond all numbers")
        self.motion = motion


class FreeMachine(LiveMachine):
    """For a policy that sees the machine and asks for accelerations."""

    def __init__(self, policy: Policy, platform: Platform, vestibular: VestibularModel) -> None:
        now, ahead = (Simulator(platform, standing(0), vestibular=vestibular) for _ in range(2))
        self._policy = policy
        self._observe = Observer(now)
        super().__init__(now, ahead, LiveCues(now), start_of(policy))
        self.begin()

    def begin(self) -> None:
        """The policy begins anew, from where the machine is."""
        self._ask = Asked(self._policy, N_AXES)

    def _follow(self, accelerations: Floats) -> None:
        self.now.step(accelerations)

    def _lead(self) -> tuple[Floats, float]:
        action, seconds = self._ask(self._observe())
        self.ahead.step(action)
        return action, seconds


class TaskMachine(LiveMachine):
    """For a policy that sees an environment and acts in it."""

    def __init__(self, policy: TaskPolicy, platform: Platform, vestibular: VestibularModel) -> None:
        policy = on_machine(policy, platform)
        task = deterministic(policy.task, vestibular)
        stride = max(1, round(task.observation.preview_spacing / TIME_STEP))
        self.ahead_steps = task.observation.preview * stride
        self._policy = policy
        # A base policy has a memory: each environment gets one of its own.
        self._now, self._ahead = (
            Batch(1, task, drives=[standing(self.ahead_steps)], base=getattr(policy, "base_policy", None))
            for _ in range(2)
        )
        self._twin = Twin(self._now, self._ahead)
        cues = LiveCues(self._now.simulator, self._now.arrays.memory, task.observation.memory)
        super().__init__(self._now.simulator, self._ahead.simulator, cues, start_of(policy))
        self.begin()

    def begin(self) -> None:
        """The policy begins anew, from where the machine is."""
        everything = np.ones(1, dtype=bool)
        where = self.now.snapshot()
        self._now.begin(everything)
        self.now.restore(where)
        self._cues.begin()
        self._now.observe(everything)
        self._ask = Asked(self._policy, self._now.action_size)
        self._let_go()

    def _let_go(self) -> None:
        self._plays: tuple[Iterator[int], Iterator[int]] | None = None
        self._left = 0

    def _follow(self, accelerations: Floats) -> None:
        if self._plays is None:
            self.now.step(accelerations)
            return
        play = self._plays[0]
        next(play)
        if self._left == 0:
            # What is left of it makes the observation whole.
            next(play, None)

    def _lead(self) -> tuple[Floats, float]:
        seconds = np.nan
        if self._left == 0:
            action, seconds = self._ask(self._now.arrays.observation.pull().copy())
            self._now.write(action[None])
            self._plays = self._now.play(), self._ahead.play()
            self._left = self._now.options.action.repeat
        # The base policy, if there is one, must see the cues that have come since.
        self._twin.follow()
        assert self._plays is not None
        next(self._plays[1])
        self._left -= 1
        return self._ahead.asked[0], seconds


def make_machine(
    policy: Policy | TaskPolicy | ForeknowingPolicy, platform: Platform, vestibular: str = "zacharias"
) -> LiveMachine:
    """The machine that a policy needs, warmed up: its kernels are compiled, and the policy has acted once.

    Raises:
        ConfigurationError: the policy must know the drive before it begins, or was made for another machine,
            time step or perception model.
    """
    name = getattr(policy, "name", type(policy).__name__)
    if isinstance(policy, ForeknowingPolicy):
        raise ConfigurationError(
            f"{name} must know the drive before it begins; live cues are not known ahead"
        )
    model = get_vestibular_model(vestibular)
    if isinstance(policy, TaskPolicy):
        return _warmed(TaskMachine(policy, platform, model), name)
    own = getattr(policy, "dt", TIME_STEP)
    if own != TIME_STEP:
        raise ConfigurationError(f"the policy's time step is {own} s, the machine's {TIME_STEP} s")
    return _warmed(FreeMachine(policy, platform, model), name)


def _warmed(machine: LiveMachine, name: str) -> LiveMachine:
    """The machine after a step of every kind, at rest again: the first in real time takes no longer then."""
    try:
        for _ in range(_WARMING):
            machine.catch_up(AT_REST)
            machine.begin()
            machine.act()
    except Exception as error:
        raise ConfigurationError(f"{name} fails with a car that stands: {explain(error)}") from None
    machine.move(np.zeros(N_AXES))
    machine.catch_up(AT_REST)
    machine.reset()
    return machine
