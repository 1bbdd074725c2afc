"""Steps of the felt force in 10 ms, by policy and drive, and which limit of the motion base they come from.

    python -m benchmarks.force_steps --policies learned mpc --fiercest 5

A step is |f(t) - f(t - 10 ms)| of the specific force at the cab. A step *from a limit* is the part by which
it exceeds the step that the policy requested, where a limit is active or was in the time step before. The
requested force is the one the cab would feel if the machine did exactly as requested in that time step.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import Braking, Platform, get_platform
from motion_cueing.envs.platform.kernels import ACTUATORS
from motion_cueing.envs.platform.kinematics import rotation, turning_axes
from motion_cueing.evaluation import Trajectory
from motion_cueing.evaluation.benchmark import SPLITS, get_split
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.rollout import batches, rollouts

Floats = NDArray[np.float64]

AGENTS = ("learned", "learned-perceived", "learned-preview", "learned-any")
KINDS = {1: "end of travel", 2: "speed", 4: "acceleration", 8: "singular pose"}
"""Limits by their bits in :attr:`Trajectory.limits_active`."""
BAR = 3.0
"""Largest step from a limit that a person can bear, m/s^2 in 10 ms."""


@dataclass(frozen=True)
class ForceSteps:
    """Steps of the felt force in a drive.

    Args:
        drive: Name of the drive.
        largest: Of all steps, m/s^2.
        own: Largest step while no limit is active: the policy's own, m/s^2.
        from_limit: Largest step from a limit, m/s^2.
        time: When it is, s.
        limits: The limits active then.
        at_limit: Share of time at any limit.
        vibration: As in the evaluation, m/s^2.
        cost: J.
    """

    drive: str
    largest: float
    own: float
    from_limit: float
    time: float
    limits: str
    at_limit: float
    vibration: float
    cost: float


def requested_force(driven: Trajectory, platform: Platform) -> Floats:
    """(n, 3) specific force at the cab if each time step did what was requested of it, m/s^2."""
    beyond = driven.action - driven.applied
    turn = np.zeros_like(driven.hexapod[:, 3:])
    turn[:, 2] = driven.turntable
    to_inertial = rotation(driven.hexapod[:, 3:]) @ rotation(turn)
    arm = to_inertial @ np.array(platform.cab.reference_point)
    angular = (turning_axes(driven.hexapod[:, 3:]) @ beyond[:, 5:8, None])[..., 0]
    angular += rotation(driven.hexapod[:, 3:])[..., 2] * beyond[:, 8:]
    acceleration = beyond[:, 2:5] + np.cross(angular, arm)
    acceleration[:, :2] += beyond[:, :2]
    return driven.f_simulator + np.einsum("nij,ni->nj", to_inertial, acceleration)


def force_steps(driven: Trajectory, platform: Platform) -> ForceSteps:
    """Steps of the felt force in a drive."""
    # Row 0 is the start: no action led to it, and the step to row 1 has no request before it.
    felt = np.linalg.norm(np.diff(driven.f_simulator, axis=0), axis=1)[1:]
    requested = np.linalg.norm(np.diff(requested_force(driven, platform), axis=0), axis=1)[1:]
    # The step before counts too: limits also let go.
    flags = driven.limits_active[2:] | driven.limits_active[1:-1]
    away = np.abs(driven.action - driven.applied).max(axis=1) > 1e-6
    held = flags.any(axis=1) | away[2:] | away[1:-1]
    excess = np.where(held, felt - requested, 0.0)
    worst = int(np.argmax(excess))
    metrics = measure(driven)
    return ForceSteps(
        driven.maneuver,
        float(felt.max()),
        float(felt[~held].max(initial=0.0)),
        float(max(excess[worst], 0.0)),
        float(driven.time[worst + 2]),
        ", ".join(_names(flags[worst])) if excess[worst] > 0.0 else "",
        float(driven.limits_active.any(axis=1).mean()),
        float(metrics.vibration or 0.0),
        metrics.cue_error,
    )


def _names(flags: NDArray[np.uint8]) -> list[str]:
    groups = {"carriage": flags[:2], "legs": flags[2:8], "turntable": flags[8:]}
    assert len(ACTUATORS) == len(flags)
    return [
        f"{group}: {kind}"
        for group, bits in groups.items()
        for bit, kind in KINDS.items()
        if np.any(bits & bit)
    ]


def fiercest(drives: Iterable[CueTrace], count: int | None) -> list[CueTrace]:
    """The drives with the largest horizontal force, that first."""
    ordered = sorted(drives, key=lambda cues: -np.hypot(*cues.specific_force[:, :2].T).max())
    return ordered[:count]


def drive_all(policy: str, platform: Platform, drives: list[CueTrace]) -> list[ForceSteps]:
    """A policy through drives, side by side where that is as good."""
    acting, named = make_policy(policy, platform), {cues.name: cues for cues in drives}
    found = []
    for group in batches(acting, named):
        for driven in rollouts(acting, [named[name] for name in group], platform):
            found.append(force_steps(driven, platform))
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--policies", nargs="+", default=AGENTS)
    parser.add_argument("--platform", default="paper")
    parser.add_argument("--jerk", type=float, help="felt jerk with which limits brake, m/s^3; default: any")
    parser.add_argument("--splits", nargs="+", default=list(SPLITS), choices=list(SPLITS))
    parser.add_argument("--fiercest", type=int, help="drives of each split with the largest force")
    parser.add_argument("--rows", type=int, default=8, help="drives shown of each policy, the worst first")
    chosen = parser.parse_args()
    platform, console = get_platform(chosen.platform), Console(width=150)
    platform = replace(platform, braking=Braking(chosen.jerk))
    drives = [
        cues for name in chosen.splits for cues in fiercest(get_split(name).cues.values(), chosen.fiercest)
    ]
    totals = Table(title=f"{len(drives)} drives on {platform.name}: worst drive of each policy")
    for header in (
        "policy",
        "step from a limit",
        "drives above 3",
        "own step",
        "at a limit %",
        "vibration",
        "mean J",
    ):
        totals.add_column(header)
    for policy in chosen.policies:
        found = sorted(drive_all(policy, platform, drives), key=lambda one: -one.from_limit)
        table = Table(title=policy)
        for header in (
            "drive",
            "from a limit",
            "at, s",
            "which",
            "largest",
            "own",
            "at a limit %",
            "vibration",
            "J",
        ):
            table.add_column(header)
        for one in found[: chosen.rows]:
            numbers = (one.largest, one.own, 100.0 * one.at_limit, one.vibration, one.cost)
            table.add_row(
                one.drive,
                f"{one.from_limit:.2f}",
                f"{one.time:.2f}",
                one.limits,
                *(f"{number:.3g}" for number in numbers),
            )
        console.print(table)
        totals.add_row(
            policy,
            f"{found[0].from_limit:.2f}",
            str(sum(one.from_limit > BAR for one in found)),
            f"{max(one.own for one in found):.2f}",
            f"{100.0 * np.mean([one.at_limit for one in found]):.3f}",
            f"{max(one.vibration for one in found):.2f}",
            f"{np.mean([one.cost for one in found]):.4g}",
        )
    console.print(totals)


if __name__ == "__main__":
    main()
