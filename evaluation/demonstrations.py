"""A drive of a controller with everything that a learner needs: what it saw, what it did, what came of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..baselines.policy import ForeknowingPolicy, Policy
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform
from ..envs.settings import to_dict
from ..envs.simulator.simulator import TIME_STEP
from ..train.algorithms.dagger.demonstrations import Demonstration
from .rollout import TaskPolicy, Wrapped, rollout
from .trajectory import Trajectory


@dataclass(frozen=True)
class Demonstrator:
    """A controller on a machine.

    Args:
        name: Of the controller.
        policy: The controller.
        platform: The machine.
        vestibular: The driver's perception.
        time_step: Of the drive, s.
    """

    name: str
    policy: Policy | ForeknowingPolicy
    platform: Platform
    vestibular: VestibularModel
    time_step: float = TIME_STEP

    @classmethod
    def of(cls, name: str, platform: Platform) -> Demonstrator:
        """A controller by name or file.

        Raises:
            MotionCueingError: there is none of this name.
            ConfigurationError: it is an agent, which sees other observations.
        """
        from .policies import make_policy

        policy = make_policy(name, platform)
        if isinstance(policy, TaskPolicy):
            raise ConfigurationError(
                f"--policy {name}: an agent sees the observations of its own environment; name a controller"
            )
        return cls(name, policy, platform, get_vestibular_model("zacharias"))

    @property
    def parameters(self) -> dict[str, Any]:
        """The controller's configuration; empty where it has none."""
        found = getattr(self.policy, "parameters", None)
        return {} if found is None else to_dict(found)


class _Watched(Wrapped):
    """A policy that remembers what it saw."""

    def __init__(self, policy: Policy) -> None:
        super().__init__(policy)
        self._policy = policy
        self.seen: list[NDArray[np.float64]] = []

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """What the policy answers."""
        self.seen.append(np.array(observation, dtype=np.float64).reshape(-1))
        return self._policy.predict(observation, state, episode_start, deterministic)


def demonstrate(demonstrator: Demonstrator, name: str, cues: CueTrace) -> tuple[Trajectory, Demonstration]:
    """Drive, and keep what was seen and done.

    Args:
        demonstrator: The controller on its machine.
        name: Of the drive.
        cues: The drive; another time step is resampled.
    """
    cues, policy = cues.resampled(demonstrator.time_step), demonstrator.policy
    watched = _Watched(policy.for_drive(cues) if isinstance(policy, ForeknowingPolicy) else policy)
    record = rollout(
        watched,
        cues,
        demonstrator.platform,
        vestibular=demonstrator.vestibular,
        dt=demonstrator.time_step,
    )
    before = slice(0, len(record) - 1)
    axes = (record.carriage, record.hexapod, record.turntable)
    rates = (record.carriage_rate, record.hexapod_rate, record.turntable_rate)
    drive = Demonstration(
        name=name,
        time=record.time[before],
        observation=np.array(watched.seen),
        action=record.action[1:],
        force=record.f_reference[before],
        rate=record.w_reference[before],
        position=np.column_stack(axes)[before],
        velocity=np.column_stack(rates)[before],
    )
    return record, drive
