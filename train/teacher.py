"""A controller that says what it would do, in a batch of episodes that it may or may not drive."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..baselines import make_policy
from ..baselines.policy import ForeknowingPolicy, Policy
from ..envs.cues import CueTrace
from ..envs.errors import ConfigurationError
from ..envs.platform.state import TURNTABLE
from ..envs.simulator import N_AXES
from ..envs.task.batch import Batch
from ..envs.task.environment import normalised

Floats = NDArray[np.float64]

_YAW = 2
"""Of the hexapod's Euler angles."""


class Teacher:
    """A controller in every environment of a batch.

    One that is told the drive is told what is left of it where the episode begins.

    Args:
        policy: Its name, or the YAML file of one.
        batch: The episodes; actions are accelerations, at every time step.

    Raises:
        UnknownNameError: no policy has this name.
        ConfigurationError: a library that it needs is missing, a field of the file is wrong, or the machines
            are of several builds.
    """

    def __init__(self, policy: str, batch: Batch) -> None:
        if batch.options.randomisation.build is not None:
            raise ConfigurationError(
                f"the teacher {policy} is made for one machine; leave randomisation.build out"
            )
        self._batch = batch
        self._made = make_policy(policy, batch.platform)
        self._drivers: list[Policy] = []
        self._states: list[Any] = []
        self._begins = True

    def begin(self) -> None:
        """The batch has begun an episode everywhere."""
        if isinstance(self._made, ForeknowingPolicy):
            self._drivers = [self._made.for_drive(rest) for rest in self._rests()]
        else:
            self._drivers = [self._made]
        self._states = [None] * len(self._drivers)
        self._begins = True

    def _rests(self) -> list[CueTrace]:
        """What is left of the drive of each environment."""
        simulator = self._batch.simulator
        *_, drive_of, _ = simulator.constants
        pairs = zip(drive_of.numpy().tolist(), simulator.state["sample"].tolist(), strict=True)
        return [rest_of(self._batch.drives[drive], sample) for drive, sample in pairs]

    def __call__(self, rows: Floats) -> NDArray[np.float32]:
        """Actions (n, 9) in [-1, 1] of the task, for observations (n, OBSERVATION_SIZE).

        To be asked once every time step, as it has a memory.
        """
        answers = np.zeros((len(rows), N_AXES))
        # One that knows its drive sees one environment, any other all of them.
        for i, (driver, own) in enumerate(
            zip(self._drivers, np.split(rows, len(self._drivers)), strict=True)
        ):
            begins = np.full(len(own), self._begins)
            action, self._states[i] = driver.predict(own, self._states[i], begins, deterministic=True)
            answers[i * len(own) : (i + 1) * len(own)] = np.reshape(action, (-1, N_AXES))
        self._begins = False
        return self._as_actions(answers)

    def _as_actions(self, accelerations: Floats) -> NDArray[np.float32]:
        batch = self._batch
        if batch.options.action.frame == "cab":
            motion = batch.simulator.state["setpoint"]
            turntable = np.asarray(motion["position"], dtype=np.float64)[:, TURNTABLE]
            yaw = np.asarray(motion["beta"], dtype=np.float64)[:, _YAW]
            accelerations = in_cab_frame(accelerations, turntable, yaw)
        return np.clip(normalised(accelerations, batch.scale), -1.0, 1.0)


def in_cab_frame(accelerations: Floats, turntable: Floats, yaw: Floats) -> Floats:
    """Accelerations (n, 9) of the axes in the cab's frame, see ``envs.task.heading``.

    Args:
        accelerations: (n, 9) in the machine's frame.
        turntable: (n,) its angle psi_T, rad.
        yaw: (n,) of the hexapod, psi_H, rad.
    """
    turned = np.array(accelerations)
    for first, angle in ((0, turntable + yaw), (2, turntable + yaw), (5, turntable)):
        x, y = accelerations[:, first], accelerations[:, first + 1]
        turned[:, first] = np.cos(angle) * x + np.sin(angle) * y
        turned[:, first + 1] = np.cos(angle) * y - np.sin(angle) * x
    return turned


def rest_of(drive: CueTrace, sample: int) -> CueTrace:
    """A drive from one of its samples on."""
    return CueTrace(
        drive.name,
        drive.time[sample:] - drive.time[sample],
        drive.specific_force[sample:],
        drive.angular_velocity[sample:],
        angular_acceleration=drive.angular_acceleration[sample:],
    )
