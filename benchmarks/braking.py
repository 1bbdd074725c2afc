"""Stopping distances of every motion base, and a figure of a machine that runs into an end of its travel.

    python -m benchmarks.braking --figure docs/images/braking-into-an-end.png

A distance is the way from the speed limit to rest: at the last moment with full acceleration, and with
bounded jerk, which begins from no acceleration and, at the worst, from full acceleration towards the end.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import Braking, Platform, actuator_limits, get_platform, platform_names
from motion_cueing.envs.platform.kernels import AXES
from motion_cueing.envs.platform.parameters import braking_jerk
from motion_cueing.envs.simulator.simulator import TIME_STEP, Simulator

STEPS = 500
PUSHES = {"carriage_x": 2.0, "surge": 2.0, "pitch": 1.0}
"""Axes that are pushed into their ends, by constant accelerations, m/s^2 and rad/s^2."""


def stopping_distance(speed: float, acceleration: float, greatest: float, jerk: float) -> float:
    """Way to rest with bounded jerk from a speed and an acceleration, both towards the end."""
    w = jerk * speed + 0.5 * acceleration**2
    braking = w**1.5 if w <= greatest**2 else 0.5 * (greatest * w + w**2 / greatest)
    return float((w * acceleration - acceleration**3 / 6.0 + braking) / jerk**2)


def distances(platform: Platform) -> list[tuple[str, ...]]:
    """A row for each kind of actuator that has ends."""
    limits, jerk = actuator_limits(platform), braking_jerk(platform)
    rows = []
    for name, i in (("carriage", 0), ("legs", 2), ("turntable", 8)):
        travel = limits["position_max"][i] - limits["position_min"][i]
        if not 0.0 < travel < np.inf:
            continue
        v, a, j = limits["velocity"][i], limits["acceleration"][i], jerk[i]
        # So fast that the jerk still lets the speed stay within its limit.
        faster = max(v - 0.5 * a**2 / j, 0.0)
        most = min(a, np.sqrt(2.0 * j * v))
        values = (travel, v, j, v**2 / (2.0 * a), stopping_distance(v, 0.0, a, j))
        rows.append(
            (
                platform.name,
                name,
                *(f"{value:.3g}" for value in (*values, stopping_distance(faster, most, a, j))),
            )
        )
    return rows


def push(platform: Platform, axis: str, acceleration: float) -> NDArray[Any]:
    """(STEPS,) states of a machine from neutral under a constant acceleration of one axis."""
    time = TIME_STEP * np.arange(3)
    standing = CueTrace("standing", time, np.tile([0.0, 0.0, -9.81], (3, 1)), np.zeros((3, 3)))
    simulator = Simulator(platform, standing)
    simulator.reset()
    action = acceleration * np.eye(9)[AXES.index(axis)]
    return np.concatenate([simulator.step(action).copy() for _ in range(STEPS)])


def figure(machines: dict[str, Platform]) -> Figure:
    """Felt force, and its step in 10 ms, of machines pushed into the ends of their travel."""
    drawn = Figure(figsize=(11.0, 5.5), layout="constrained")
    axes = drawn.subplots(2, len(PUSHES), sharex="col")
    for column, (axis, acceleration) in enumerate(PUSHES.items()):
        for label, platform in machines.items():
            force = push(platform, axis, acceleration)["simulator_cue"]["force"]
            time = TIME_STEP * np.arange(1, STEPS + 1)
            axes[0, column].plot(time, force[:, 0], label=label, linewidth=1.0)
            step = np.linalg.norm(np.diff(force, axis=0), axis=1)
            axes[1, column].plot(time[1:], step, label=label, linewidth=1.0)
        axes[0, column].set_title(f"{axis.replace('_', ' ')} pushed with {acceleration:g}")
        axes[1, column].set_xlabel("time, s")
    axes[0, 0].set_ylabel("felt force along x, m/s²")
    axes[1, 0].set_ylabel("step in 10 ms, m/s²")
    axes[0, 0].legend()
    return drawn


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the distances, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jerk", type=float, default=150.0, help="felt jerk, m/s^3")
    parser.add_argument("--figure", type=Path, help="also draw a figure into this file")
    chosen = parser.parse_args(arguments)
    machines = [replace(get_platform(name), braking=Braking(chosen.jerk)) for name in platform_names()]
    table = Table(title=f"way from the speed limit to rest, felt jerk of {chosen.jerk:g} m/s^3")
    for header in (
        "machine",
        "actuator",
        "travel",
        "speed",
        "jerk",
        "last moment",
        "bounded jerk",
        "accelerating",
    ):
        table.add_column(header)
    for machine in machines:
        for row in distances(machine):
            table.add_row(*row)
    Console(width=120).print(table)
    if chosen.figure is not None:
        paper = get_platform("paper")
        gentle = replace(paper, braking=Braking(chosen.jerk))
        both = {"at the last moment": paper, f"felt jerk of {chosen.jerk:g} m/s³": gentle}
        figure(both).savefig(chosen.figure, dpi=110)


if __name__ == "__main__":
    main()
