"""A policy in many drives at once, each on its own machine: what ``drivers`` is for one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...baselines.policy import ForeknowingPolicy, Policy, start_of
from ...envs.cues import CueTrace
from ...envs.perception import get_vestibular_model
from ...envs.platform import Platform
from ...envs.simulator.simulator import N_AXES, Simulator
from ...envs.task.batch import Batch
from ..rollout import Observer, TaskPolicy, deterministic
from .results import Endurance

Floats = NDArray[np.float64]


class BatchDriver(Protocol):
    """Machines at rest in their drives, and what moves them."""

    @property
    def simulator(self) -> Simulator:
        """With the machines."""
        ...

    @property
    def not_finite(self) -> NDArray[np.int64]:
        """(n,) actions so far with an entry that is no finite number; 0 is done in its place."""
        ...

    def steps(self) -> Iterator[None]:
        """One time step after another, without end."""
        ...


class _Asked:
    """A policy with its memory, whose answers are made finite."""

    def __init__(self, policy: Any, n: int, size: int) -> None:
        self._policy, self._shape = policy, (n, size)
        self._memory: Any = None
        self._begins = np.ones(n, dtype=bool)
        self.not_finite = np.zeros(n, dtype=np.int64)

    def __call__(self, observation: NDArray[Any]) -> Floats:
        """(n, size) actions."""
        answer, self._memory = self._policy.predict(
            observation, self._memory, self._begins, deterministic=True
        )
        self._begins = np.zeros(len(self._begins), dtype=bool)
        action = np.reshape(np.asarray(answer, dtype=np.float64), self._shape)
        finite = np.isfinite(action)
        self.not_finite += ~finite.all(axis=1)
        return np.where(finite, action, 0.0)


class _OneEach:
    """Policies that know their drives, one for each."""

    def __init__(self, policy: ForeknowingPolicy, cues: Sequence[CueTrace]) -> None:
        self._policies = [policy.for_drive(one) for one in cues]

    def predict(
        self, observation: NDArray[Any], state: Any, episode_start: NDArray[Any], deterministic: bool
    ) -> tuple[Floats, list[Any]]:
        """What each answers to its row of observations (n, size)."""
        states = [None] * len(self._policies) if state is None else state
        answers = [
            policy.predict(observation[i : i + 1], states[i], episode_start[i : i + 1], deterministic)
            for i, policy in enumerate(self._policies)
        ]
        return np.array([np.reshape(action, N_AXES) for action, _ in answers]), [own for _, own in answers]


class PolicyBatch:
    """A policy that sees machines and asks for accelerations.

    Args:
        policy: The policy.
        cues: The drives.
        machines: In use.
        machine_of: (n,) of each drive.
        vestibular: Perception model.
    """

    def __init__(
        self,
        policy: Policy | ForeknowingPolicy,
        cues: Sequence[CueTrace],
        machines: Sequence[Platform],
        machine_of: NDArray[np.int32],
        vestibular: str,
    ) -> None:
        model = get_vestibular_model(vestibular)
        self.simulator = Simulator(machines, cues, platform_of=machine_of, vestibular=model)
        self.simulator.reset(start_of(policy))
        one = _OneEach(policy, cues) if isinstance(policy, ForeknowingPolicy) else policy
        self._ask = _Asked(one, len(cues), N_AXES)

    @property
    def not_finite(self) -> NDArray[np.int64]:
        """(n,) actions so far that were not finite."""
        return self._ask.not_finite

    def steps(self) -> Iterator[None]:
        """One time step after another, without end."""
        observe = Observer(self.simulator)
        while True:
            self.simulator.step(self._ask(observe()))
            yield


class TaskBatch:
    """A policy that sees environments and acts in them: without noise or an early end.

    Args:
        policy: The policy.
        cues: The drives.
        machine_of: (n,) index of each drive's machine.
        endurance: Draws the machines.
        condition: Under which they are drawn.
        vestibular: Perception model.
    """

    def __init__(
        self,
        policy: TaskPolicy,
        cues: Sequence[CueTrace],
        machine_of: NDArray[np.int32],
        endurance: Endurance,
        condition: str,
        vestibular: str,
    ) -> None:
        task = deterministic(policy.task, get_vestibular_model(vestibular))
        task = replace(task, randomization=endurance.randomization(condition))
        n = len(cues)
        self._batch = Batch(n, task, drives=cues, base=getattr(policy, "base_policy", None))
        self.simulator = self._batch.simulator
        everywhere = np.ones(n, dtype=bool)
        self._batch.begin(everywhere, np.arange(n, dtype=np.int32), machine_of)
        self.simulator.reset(start_of(policy))
        self._batch.observe(everywhere)
        self._ask = _Asked(policy, n, self._batch.action_size)

    @property
    def not_finite(self) -> NDArray[np.int64]:
        """(n,) actions so far that were not finite."""
        return self._ask.not_finite

    def steps(self) -> Iterator[None]:
        """One time step after another, without end, also within an action that is held."""
        batch = self._batch
        while True:
            batch.write(self._ask(batch.arrays.observation.pull()))
            for _ in batch.play():
                yield


def batch_driver(
    policy: Policy | TaskPolicy | ForeknowingPolicy,
    cues: Sequence[CueTrace],
    platform: Platform,
    machine_of: Sequence[int],
    endurance: Endurance,
    condition: str,
    vestibular: str = "zacharias",
) -> BatchDriver:
    """The driver that a policy needs.

    Args:
        policy: The policy, made for the platform.
        cues: The drives.
        platform: The machine as it should be.
        machine_of: Index of each drive's machine among those of the condition.
        endurance: Draws the machines.
        condition: Under which they are drawn.
        vestibular: Perception model.
    """
    indices = np.array(machine_of, dtype=np.int32)
    if isinstance(policy, TaskPolicy):
        return TaskBatch(policy, cues, indices, endurance, condition, vestibular)
    machines = endurance.machines_under(condition, platform)
    return PolicyBatch(policy, cues, machines, indices, vestibular)
