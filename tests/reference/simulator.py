"""The whole step for a batch of environments on one machine."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.perception import VestibularModel, get_vestibular_model
from motion_cueing.envs.platform import Platform

from .actuators import dead_steps, lag
from .cues import simulator_cues
from .frames import Floats
from .kinematics import extensions, forward_kinematics, pose_rates
from .machine import MachineModel
from .perception import VestibularReference
from .setpoint import HEXAPOD, MotionState, command

PARTS = (slice(0, 2), HEXAPOD, slice(8, 9))


@dataclass
class ReferenceState:
    """The state of a batch; cues are [f_cab, omega, f_head] (n, 3) each, sensed [f, omega] (n, 6)."""

    sample: np.ndarray
    setpoint: MotionState
    motion: MotionState
    acceleration: Floats
    reference: tuple[Floats, Floats, Floats]
    simulated: tuple[Floats, Floats, Floats]
    modes_reference: Floats
    modes_simulated: Floats
    perceived_reference: Floats
    perceived_simulator: Floats


class ReferenceSimulator:
    """``n`` environments with the same machine and drive, in NumPy."""

    def __init__(
        self,
        platform: Platform,
        drive: CueTrace,
        n: int,
        model: VestibularModel | None = None,
        dt: float = 0.01,
    ) -> None:
        self.machine = MachineModel.of(platform)
        self.dt, self.n = dt, n
        self.perception = VestibularReference(model or get_vestibular_model("zacharias"), dt)
        self.drive = (drive.specific_force, drive.angular_velocity, drive.at_point(platform.cab.head))
        self.dead = [dead_steps(dynamics, dt) for dynamics in self.machine.dynamics]
        lagging = any(dynamics.natural_frequency is not None for dynamics in self.machine.dynamics)
        self.unity = not lagging and not any(self.dead)

    def reset(self, start: Floats | None = None) -> ReferenceState:
        """At rest at start poses (n, 9)."""
        start = np.zeros((self.n, 9)) if start is None else start
        legs = extensions(self.machine, start[:, 2:8])
        position = np.concatenate([start[:, :2], legs, start[:, 8:]], axis=1)
        motion = MotionState(position, np.zeros((self.n, 9)), start[:, 2:8].copy(), np.zeros((self.n, 6)))
        sample = np.zeros(self.n, dtype=int)
        reference, simulated = (
            self.reference(sample),
            simulator_cues(self.machine, motion, np.zeros((self.n, 9))),
        )
        modes = [self.perception.rest(heard(cues)) for cues in (reference, simulated)]
        sensed = [
            self.perception.sensed(m, heard(c)) for m, c in zip(modes, (reference, simulated), strict=True)
        ]
        still = np.zeros((self.n, 9))
        self.state = ReferenceState(sample, motion, motion, still, reference, simulated, *modes, *sensed)
        self.history = deque([motion] * (2 + max(self.dead)), maxlen=2 + max(self.dead))
        return self.state

    def reference(self, sample: np.ndarray) -> tuple[Floats, Floats, Floats]:
        """The car's cues at these samples; its last ones after the end."""
        index = np.minimum(sample, len(self.drive[0]) - 1)
        force, rate, head = (channel[index] for channel in self.drive)
        return force, rate, head

    def step(self, action: Floats) -> ReferenceState:
        """Advance by one step with accelerations (n, 9)."""
        old = self.state
        setpoint = command(self.machine, old.setpoint, action, self.dt)
        self.history.appendleft(setpoint)
        motion = setpoint if self.unity else self.actuate(old.motion)
        acceleration = (motion.axis_rates() - old.motion.axis_rates()) / self.dt
        sample = old.sample + 1
        reference, simulated = self.reference(sample), simulator_cues(self.machine, motion, acceleration)
        modes, sensed = [], []
        for begin, before, after in (
            (old.modes_reference, old.reference, reference),
            (old.modes_simulated, old.simulated, simulated),
        ):
            modes.append(self.perception.advance(begin, heard(before), heard(after)))
            sensed.append(self.perception.sensed(modes[-1], heard(after)))
        self.state = ReferenceState(
            sample, setpoint, motion, acceleration, reference, simulated, *modes, *sensed
        )
        return self.state

    def actuate(self, true: MotionState) -> MotionState:
        """The true machine one step later: set-points of :attr:`history` after dead time and lag."""
        position, rate = np.empty_like(true.position), np.empty_like(true.rate)
        for part, dynamics, dead in zip(PARTS, self.machine.dynamics, self.dead, strict=True):
            then, now = self.history[dead], self.history[dead + 1]
            position[:, part], rate[:, part] = then.position[:, part], then.rate[:, part]
            if dynamics.natural_frequency is not None:
                position[:, part], rate[:, part] = lag(
                    dynamics,
                    true.position[:, part],
                    true.rate[:, part],
                    now.position[:, part],
                    now.rate[:, part],
                    then.rate[:, part],
                    self.dt,
                )
        pose, _ = forward_kinematics(self.machine, position[:, HEXAPOD], true.pose)
        return MotionState(position, rate, pose, pose_rates(self.machine, pose, rate[:, HEXAPOD]))


def heard(cues: tuple[Floats, Floats, Floats]) -> Floats:
    """(n, 6) what the vestibular organs are given: specific force at the head and angular velocity."""
    return np.concatenate([cues[2], cues[1]], axis=1)
