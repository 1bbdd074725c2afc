"""A controller in a time of the test's own: nothing waits, nothing depends on how fast it runs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from motion_cueing.baselines import ClassicalWashout
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.realtime import (
    Controller,
    ControllerOptions,
    Cues,
    FloatsFormat,
    State,
    WatchdogOptions,
    make_machine,
)
from motion_cueing.realtime.client import controls_sent, roads_sent
from motion_cueing.realtime.inbox import Inbox

AT_ONCE = WatchdogOptions(steady=0.0, fade=0.0)
SENDER = ("127.0.0.1", 9)
FLOATS = FloatsFormat()
PAPER = get_platform("paper")
REST = (0.0, 0.0, -9.81)


@lru_cache
def lane_change(seconds: float = 2.0) -> CueTrace:
    """The middle of a lane change, sharp from the first sample on."""
    whole = get_maneuver("lane-change").drive()
    rows = slice(250, 250 + round(100 * seconds))
    return CueTrace("lane", whole.time[rows], whole.specific_force[rows], whole.angular_velocity[rows])


class Clock:
    """Moves when told, and a little whenever it is looked at."""

    def __init__(self, tick=0) -> None:
        self.now, self.tick = 10**9, tick

    def __call__(self) -> int:
        self.now += self.tick
        return self.now


class Bench:
    """A controller, its clock, and a sender of cues."""

    def __init__(self, policy=None, watchdog=AT_ONCE, rate=100, platform=PAPER, **preview) -> None:
        self.policy = policy or ClassicalWashout()
        self.machine = make_machine(self.policy, platform, **preview)
        inbox = Inbox(FLOATS, watchdog.stale, watchdog.overdue)
        options = ControllerOptions(rate=rate, watchdog=watchdog)
        self.controller = Controller(self.machine, platform, inbox, options)
        self.rate, self.sequence, self.setpoints = rate, 0, []

    @property
    def now(self) -> float:
        """Seconds."""
        return self.controller.periods / self.rate

    def send(self, force=REST, rate=(0.0, 0.0, 0.0), paused=False, controls=None, road=None) -> str:
        """The next packet of cues."""
        cues = Cues(
            self.sequence, self.now, tuple(map(float, force)), tuple(map(float, rate)), paused, controls, road
        )
        self.sequence += 1
        return self.controller.inbox.take(FLOATS.pack_cues(cues), SENDER, self.now)

    def step(self):
        """A period; its set-point."""
        self.setpoints.append(self.controller.period(self.now))
        return self.setpoints[-1]

    def drive(self, trace: CueTrace) -> np.ndarray:
        """A packet and a step of 10 ms for each sample; (n, 39) motion at the end of each step."""
        rows = []
        controls, roads = controls_sent(trace), roads_sent(trace)
        for k, (force, rate) in enumerate(zip(trace.specific_force, trace.angular_velocity, strict=True)):
            known = {"controls": controls[k] if controls else None, "road": roads[k] if roads else None}
            assert self.send(force, rate, **known) == "used"
            for _ in range(self.rate // 100):
                setpoint = self.step()
            rows.append(setpoint.motion)
        return np.array(rows)

    def wait(self, seconds: float) -> None:
        """Periods without a packet."""
        for _ in range(round(seconds * self.rate)):
            self.step()

    def stand(self, seconds: float) -> None:
        """Packets of a standing car."""
        for _ in range(round(seconds * 100)):
            self.send()
            for _ in range(self.rate // 100):
                self.step()

    def settle(self, cues: bool = True) -> None:
        """Periods until it rests at its start pose, with or without packets of a standing car."""
        for _ in range(20 * self.rate):
            if cues:
                self.send()
            if self.step().state is State.NEUTRAL:
                return
        raise AssertionError(f"still {self.controller.state} after 20 s")

    def trajectory(self, platform=PAPER):
        """The log."""
        return self.controller.log.trajectory(platform, self.machine.start, "zacharias", self.policy)
