"""One policy through one drive: the loop every figure in this project comes from."""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import ArrayLike

from ..baselines.policy import ForeknowingPolicy, Policy, start_of
from ..envs.car import Car
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform
from ..envs.simulator import TIME_STEP
from .drivers import TaskPolicy, make_driver
from .recording import record, trajectory_of
from .trajectory import Trajectory

AnyPolicy = Policy | TaskPolicy | ForeknowingPolicy
"""Whatever :func:`rollout` takes through a drive."""


def rollout(
    policy: AnyPolicy,
    cues: CueTrace,
    platform: Platform | None = None,
    car: Car | None = None,
    *,
    start: ArrayLike | None = None,
    vestibular: VestibularModel | None = None,
    dt: float = TIME_STEP,
    on_step: Callable[[int, int], None] | None = None,
) -> Trajectory:
    """Drive a machine through a cue trace with a policy.

    Args:
        policy: Anything with ``predict``. One with a ``task``, as an agent has, sees the observations of
            that environment and acts in it; any other sees ``envs.observation`` and asks for accelerations.
            One with ``for_drive`` is told the cues first. Its ``notes``, if any, become metadata.
        cues: The drive; another time step is resampled.
        platform: The machine; default: that of the policy's task, or the paper's.
        car: The car that was driven, for the record.
        start: (9,) pose to begin at; default: the policy's ``start``, or neutral.
        vestibular: Perception model; default: Zacharias'.
        dt: Time step, s.
        on_step: Called with the steps done and the steps in all.

    Raises:
        ActionError: the policy returned something else than as many finite numbers as expected and a state.
        ConfigurationError: an argument is of the wrong type, or the policy was made for another time step,
            machine or perception model.
    """
    if not isinstance(cues, CueTrace):
        raise ConfigurationError(
            f"cues must be a CueTrace, found {type(cues).__name__}; get_maneuver(name).drive()"
        )
    if platform is not None and not isinstance(platform, Platform):
        raise ConfigurationError(
            f"platform must be a Platform, found {type(platform).__name__}; get_platform(name)"
        )
    cues = cues.resampled(dt)
    if isinstance(policy, ForeknowingPolicy):
        policy = policy.for_drive(cues)
    driver = make_driver(policy, cues, platform, vestibular or get_vestibular_model("zacharias"), dt)
    recording = record(driver, start_of(policy) if start is None else start, on_step)
    return trajectory_of(recording, driver, policy, cues, car)
