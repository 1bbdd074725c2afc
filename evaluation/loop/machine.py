"""A policy with its machine in real time: the machine up to now, and the same one step ahead.

A rollout knows the cues at the end of a step when it takes it; here they are still to come. So each step is
taken twice: at its begin by the machine ahead, whose motion is sent (it does not depend on the cues wanted),
and at its end by the machine now, with the cues that have come since: this one the policy sees. Both take the
very steps of a rollout.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...baselines.policy import ForeknowingPolicy, Policy, start_of
from ...envs.errors import ActionError, ConfigurationError
from ...envs.perception import VestibularModel, get_vestibular_model
from ...envs.platform import Platform
from ...envs.simulator import N_AXES, TIME_STEP, Simulator
from ...envs.task.batch import Batch
from ..drivers import Asked, Observer, TaskPolicy, deterministic
from ..own_machine import on_machine
from ..suite import explain
from .live_cues import AT_REST, NOW, LiveCues, standing
from .track import MotionView
from .twin import Twin

Floats = NDArray[np.float64]

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
    def wanted(self) -> Floats:
        """(6,) cues wanted now: specific force, m/s^2, and angular velocity, rad/s."""
        return self._cues.wanted

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
