"""Demonstrations: drives of a controller with all that a learner needs: observations, actions, motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..baselines.policy import Policy, as_policy
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform
from ..envs.settings import to_dict
from ..envs.simulator.simulator import TIME_STEP
from ..train.algorithms.dagger.demonstrations import Demonstration
from .policies import make_policy
from .rollout import begin_rollout, record, trajectory_of
from .trajectory import Trajectory


@dataclass(frozen=True)
class Demonstrator:
    """A controller on a machine.

    Args:
        name: Of the controller.
        policy: The controller, or any object with ``predict``.
        platform: The machine.
        vestibular: The driver's perception.
        time_step: Of the drive, s.

    Raises:
        ConfigurationError: it is an agent, which sees other observations.
    """

    name: str
    policy: Policy
    platform: Platform
    vestibular: VestibularModel
    time_step: float = TIME_STEP

    def __post_init__(self) -> None:
        object.__setattr__(self, "policy", as_policy(self.policy))
        if self.policy.task is not None:
            raise ConfigurationError(
                f"--policy {self.name}: an agent sees the observations of its own environment; "
                "name a controller"
            )

    @classmethod
    def of(cls, name: str, platform: Platform) -> Demonstrator:
        """A controller by name or file."""
        return cls(name, make_policy(name, platform), platform, get_vestibular_model("zacharias"))

    @property
    def parameters(self) -> dict[str, Any]:
        """The controller's configuration; empty where it has none."""
        return {} if self.policy.parameters is None else to_dict(self.policy.parameters)


def demonstrate(demonstrator: Demonstrator, name: str, cues: CueTrace) -> tuple[Trajectory, Demonstration]:
    """Drive, and keep what the controller saw and did.

    Args:
        demonstrator: The controller on its machine.
        name: Of the drive.
        cues: The drive; another time step is resampled.
    """
    run = begin_rollout(
        demonstrator.policy,
        cues,
        demonstrator.platform,
        vestibular=demonstrator.vestibular,
        time_step=demonstrator.time_step,
    )
    observations: list[NDArray[np.float64]] = []

    def keep(step: int, steps: int) -> None:
        observations.append(np.array(run.observation[0], dtype=np.float64))

    trajectory = trajectory_of(record(run, keep)[0], run)
    before = slice(0, len(trajectory) - 1)
    axes = (trajectory.carriage, trajectory.hexapod, trajectory.turntable)
    rates = (trajectory.carriage_rate, trajectory.hexapod_rate, trajectory.turntable_rate)
    return trajectory, Demonstration(
        name=name,
        time=trajectory.time[before],
        observation=np.array(observations),
        action=trajectory.action[1:],
        force=trajectory.f_reference[before],
        rate=trajectory.w_reference[before],
        position=np.column_stack(axes)[before],
        velocity=np.column_stack(rates)[before],
    )
