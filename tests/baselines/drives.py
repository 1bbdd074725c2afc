"""Cue traces and machines for the tests of policies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motion_cueing.envs import CueTrace
from motion_cueing.envs.platform import Carriage, Platform, Turntable, get_platform

DT = 0.01


def trace(duration: float, force=None, rate=None, name: str = "test") -> CueTrace:
    """A drive from functions of time: (n, 2) horizontal force and (n, 3) angular velocity."""
    time = np.arange(round(duration / DT) + 1) * DT
    f = np.zeros((len(time), 3))
    f[:, 2] = -9.81
    if force is not None:
        f[:, :2] = force(time)
    w = np.zeros((len(time), 3)) if rate is None else rate(time)
    return CueTrace(name, time, f, w)


def boundless() -> Platform:
    """The paper's machine with so much travel that no limit is met."""
    paper = get_platform("paper")
    return replace(
        paper,
        carriage=Carriage(travel_x=(-1e4, 1e4), travel_y=(-1e4, 1e4), velocity=1e3, acceleration=1e3),
        hexapod=replace(paper.hexapod, velocity=50.0, acceleration=500.0),
        turntable=Turntable(travel=None, velocity=50.0, acceleration=500.0),
    )


def weave(t):
    ramp = np.clip((t - 0.5) / 2.0, 0.0, 1.0)
    return ramp[:, None] * np.column_stack([1.5 * np.sin(0.9 * t), 2.0 * np.sin(1.3 * t)])
