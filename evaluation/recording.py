"""Keeps what a drive gave, and makes a trajectory of it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..envs.car import Car
from ..envs.cues import CueTrace
from ..envs.platform import actuator_limits
from ..envs.settings import to_dict
from ..envs.simulator import N_AXES
from .drivers import Driver
from .trajectory import LimitTable, Trajectory

_ABOUT: Final = ("parameters", "vestibular", "source")
"""Metadata of every trajectory; what else there is a policy noted."""


def notes_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """What a policy counted in a drive, such as solves that did not converge, by the drive's metadata."""
    return {name: text for name, text in metadata.items() if name not in _ABOUT}


@dataclass(frozen=True)
class Recording:
    """What a drive gave; row k is the machine at sample k, row 0 the start.

    Args:
        states: (n,) rows of ``Simulator.state``.
        actions: (n, 9) accelerations asked for in the step that ended at a row.
        seconds: (n,) wall-clock time of the policy; NaN where it was not asked.
    """

    states: NDArray[Any]
    actions: NDArray[np.float64]
    seconds: NDArray[np.float64]


def record(driver: Driver, start: ArrayLike, on_step: Callable[[int, int], None] | None = None) -> Recording:
    """Run a driver from a pose (9,) to the end of its drive.

    Args:
        driver: The driver.
        start: Pose to begin at.
        on_step: Called with the steps done and the steps in all.
    """
    n = len(driver.simulator.drives[0])
    states = np.zeros(n, dtype=driver.simulator.state.dtype)
    actions, seconds = np.zeros((n, N_AXES)), np.full(n, np.nan)
    states[0] = driver.begin(start)
    for k, sample in zip(range(1, n), driver.samples(), strict=False):
        actions[k], states[k], seconds[k] = sample
        if on_step is not None:
            on_step(k, n - 1)
    return Recording(states, actions, seconds)


def trajectory_of(
    recording: Recording, driver: Driver, policy: Any, cues: CueTrace, car: Car | None
) -> Trajectory:
    """The trajectory of a recorded drive.

    Args:
        recording: The drive.
        driver: That drove it.
        policy: For its name, its parameters, and its ``notes``: what it counted, as text.
        cues: That were driven.
        car: That was driven, for the record.
    """
    states, platform = recording.states, driver.simulator.platforms[0]
    motion, felt, wanted = states["motion"], states["felt"], states["wanted"]
    shifts = np.arange(0, 36, 4, dtype=np.uint64)
    limits = actuator_limits(platform)
    parameters = getattr(policy, "parameters", None)
    return Trajectory(
        maneuver=cues.name,
        policy=str(getattr(policy, "name", type(policy).__name__)),
        platform=platform.name,
        car=car.name if car else cues.source or cues.name,
        time=cues.time,
        f_wanted=wanted["force"],
        w_wanted=wanted["rate"],
        head_f_wanted=wanted["head_force"],
        f_felt=felt["force"],
        w_felt=felt["rate"],
        head_f_felt=felt["head_force"],
        sensed_f_wanted=states["sensed_wanted"]["force"],
        sensed_w_wanted=states["sensed_wanted"]["rate"],
        sensed_f_felt=states["sensed_felt"]["force"],
        sensed_w_felt=states["sensed_felt"]["rate"],
        carriage=motion["position"][:, :2],
        carriage_rate=motion["rate"][:, :2],
        hexapod=np.hstack([motion["displacement"], motion["beta"]]),
        hexapod_rate=np.hstack([motion["velocity"], motion["beta_rate"]]),
        turntable=motion["position"][:, 8],
        turntable_rate=motion["rate"][:, 8],
        legs=motion["position"][:, 2:8],
        legs_rate=motion["rate"][:, 2:8],
        action=recording.actions,
        applied=states["acceleration"],
        limits_active=((states["limits"][:, None] >> shifts) & np.uint64(0xF)).astype(np.uint8),
        step_time=recording.seconds,
        limits=LimitTable(**limits),
        metadata={
            "parameters": json.dumps(to_dict(parameters)) if parameters is not None else "{}",
            "vestibular": driver.simulator.vestibular.name,
            "source": cues.source,
            **getattr(policy, "notes", {}),
        },
    )
