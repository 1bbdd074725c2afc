"""Logs of machines as the simulator moves them, with the errors of sensors."""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.platform.machines import ACTUATORS
from motion_cueing.envs.platform.motion_log import Channel, MotionLog
from motion_cueing.envs.simulator.simulator import Simulator

PAPER = get_platform("paper")


def simulated(dynamics, seconds=30.0, noise=2e-4, quantum=1e-4, size=1.0, seed=0):
    """Set-points and sensors (n, 9) of the actuators of ``paper``, moved by sums of sines up to 1.5 Hz."""
    n = round(100 * seconds) + 1
    time = 0.01 * np.arange(n)
    still = CueTrace("rest", time, np.tile([0.0, 0.0, -9.81], (n, 1)), np.zeros((n, 3)))
    simulator = Simulator(PAPER.with_dynamics(dynamics), still)
    simulator.reset()
    rng = np.random.default_rng(seed)
    frequency, phase = rng.uniform(0.1, 1.5, (6, 9)), rng.uniform(0.0, 2.0 * np.pi, (6, 9))
    amplitude = size * np.array([3.0, 3.0, 0.8, 0.8, 0.8, 0.6, 0.6, 0.6, 1.0])
    setpoint, sensor = np.zeros((n, 9)), np.zeros((n, 9))
    for k in range(n):
        state = simulator.state[0]
        setpoint[k], sensor[k] = state["setpoint"]["position"], state["motion"]["position"]
        simulator.step((amplitude * np.cos(2.0 * np.pi * frequency * time[k] + phase)).mean(axis=0))
    sensor += noise * rng.standard_normal(sensor.shape)
    return setpoint, np.round(sensor / quantum) * quantum if quantum else sensor


def log_of(setpoint, sensor, step=0.01, which=range(9)):
    channels = (Channel(ACTUATORS[i], setpoint[:, i], sensor[:, i]) for i in which)
    return MotionLog(step, tuple(channels))


def write(path, setpoint, sensor, which=range(9), step=0.01, start=5.0):
    """The log as a file in the documented layout."""
    columns = {"time_s": start + step * np.arange(len(setpoint))}
    for i in which:
        unit = "rad" if ACTUATORS[i] == "turntable" else "m"
        columns[f"{ACTUATORS[i]}_setpoint_{unit}"] = setpoint[:, i]
        columns[f"{ACTUATORS[i]}_sensor_{unit}"] = sensor[:, i]
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path
