"""Odd hexapods, drawn at random, and strong commands on them: whatever happens, legs and pose agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import Hexapod, Platform, get_platform, platform_names
from motion_cueing.envs.platform.kernels.step import HELD
from motion_cueing.envs.platform.kinematics import check_geometry
from motion_cueing.envs.platform.presets import neutral_height, paired_hexapod
from motion_cueing.envs.simulator.simulator import Simulator

from .platforms_under_test import DT
from .storms import STANDSTILL

HOLD = 20
"""Steps for which a command is held: 0.2 s."""

AGREE = 1e-9
"""Largest difference of legs and pose, m."""


def moved(rng: np.random.Generator) -> Platform:
    """The paper's machine, its joints moved by 0.6 m."""
    base = get_platform("paper")
    upper, lower = (np.array(joints) for joints in (base.hexapod.upper_joints, base.hexapod.lower_joints))
    return _with_joints(base, upper + rng.normal(0.0, 0.6, (6, 3)), lower + rng.normal(0.0, 0.6, (6, 3)))


def nearly_alike(rng: np.random.Generator) -> Platform:
    """The paper's machine, its lower platform drawn towards the upper one, where legs meet in a point."""
    base = get_platform("paper")
    upper, lower = (np.array(joints) for joints in (base.hexapod.upper_joints, base.hexapod.lower_joints))
    share = rng.uniform(0.5, 1.0)
    return _with_joints(base, upper, (1.0 - share) * lower + share * rng.uniform(0.9, 1.1) * upper)


def paired(rng: np.random.Generator) -> Platform:
    """Pairs of joints on circles of any size, legs of any length, speed and acceleration."""
    (above, below), (near, far) = rng.uniform(0.2, 2.0, 2), rng.uniform(0.01, 1.0, 2)
    upper, lower = paired_hexapod((above, near * above), (below, far * below))
    length = rng.uniform(0.3, 3.0)
    stroke = length * rng.uniform(0.02, 0.6)
    hexapod = Hexapod(
        upper_joints=upper,
        lower_joints=lower,
        neutral=neutral_height(upper, lower, length),
        extension=(-stroke * rng.uniform(0.1, 1.0), stroke),
        velocity=10.0 ** rng.uniform(-1.0, 0.7),
        acceleration=10.0 ** rng.uniform(0.0, 1.7),
    )
    return replace(get_platform("paper"), hexapod=hexapod)


def distorted(rng: np.random.Generator) -> Platform:
    """A shipped machine, distorted, with other strokes and rates."""
    base = get_platform(str(rng.choice(platform_names())))
    upper, lower = (np.array(joints) for joints in (base.hexapod.upper_joints, base.hexapod.lower_joints))
    hexapod = replace(
        base.hexapod,
        velocity=10.0 ** rng.uniform(-1.0, 0.7),
        acceleration=10.0 ** rng.uniform(0.0, 1.7),
        extension=tuple(np.array(base.hexapod.extension) * rng.uniform(0.3, 1.3)),
    )
    machine = replace(base, hexapod=hexapod)
    return _with_joints(machine, upper * rng.uniform(0.8, 1.2, (6, 1)), lower + rng.normal(0.0, 0.1, (6, 3)))


def _with_joints(base: Platform, upper: np.ndarray, lower: np.ndarray) -> Platform:
    joints = {"upper_joints": tuple(map(tuple, upper)), "lower_joints": tuple(map(tuple, lower))}
    return replace(base, hexapod=replace(base.hexapod, **joints))


KINDS = (moved, nearly_alike, paired, distorted)


def accepted_machines(count: int, rng: np.random.Generator) -> list[Platform]:
    """Machines of all kinds that the package takes."""
    found: list[Platform] = []
    while len(found) < count:
        try:
            machine = KINDS[rng.integers(len(KINDS))](rng)
            check_geometry(machine.hexapod)
        except ConfigurationError:
            continue
        found.append(machine)
    return found


def lengths_of_poses(machines: Sequence[Platform], pose: np.ndarray) -> np.ndarray:
    """(n, 6) extensions of the legs at poses (n, 6), each of its own machine, by distances between joints."""
    upper = np.array([machine.hexapod.upper_joints for machine in machines])
    lower = np.array([machine.hexapod.lower_joints for machine in machines])
    neutral = np.array([machine.hexapod.neutral for machine in machines])
    point = upper
    # Yaw, pitch, roll: the last rotation acts first on a point of the platform.
    for axis, (j, k) in ((5, (0, 1)), (4, (2, 0)), (3, (1, 2))):
        sine, cosine = np.sin(pose[:, axis, None]), np.cos(pose[:, axis, None])
        turned = point.copy()
        turned[..., j] = cosine * point[..., j] - sine * point[..., k]
        turned[..., k] = sine * point[..., j] + cosine * point[..., k]
        point = turned
    at_pose = np.linalg.norm(point + (neutral + pose[:, :3])[:, None] - lower, axis=2)
    return np.asarray(at_pose - np.linalg.norm(upper + neutral[:, None] - lower, axis=2))


def drive(
    machines: Sequence[Platform], steps: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Random commands of amplitude 1 to 1000, held 0.2 s each.

    Returns:
        (n,) largest difference of legs and pose over all steps, m, and steps in which the pose was held.
    """
    n = len(machines)
    batch = Simulator(machines, STANDSTILL, platform_of=np.arange(n), drive_of=np.zeros(n, dtype=int))
    before = batch.reset()["motion"]["rate"][:, 2:8].copy()
    limit = np.array([machine.hexapod.acceleration for machine in machines])
    worst, held = np.zeros(n), np.zeros(n, dtype=int)
    for k in range(steps):
        if k % HOLD == 0:
            command = rng.normal(size=(n, 9)) * 10.0 ** rng.uniform(0.0, 3.0, (n, 1))
        state = batch.step(command)
        motion = state["motion"]
        pose = np.concatenate([motion["displacement"], motion["beta"]], axis=1)
        assert np.isfinite(pose).all()
        difference = lengths_of_poses(machines, pose) - motion["position"][:, 2:8]
        worst = np.maximum(worst, np.abs(difference).max(axis=1))
        stopped = (state["limits"] & np.uint64(HELD)) != 0
        held += stopped
        # An emergency stop is the one step in which legs may leave their limit of acceleration.
        change = np.abs(motion["rate"][:, 2:8] - before).max(axis=1) / DT
        assert (stopped | (change <= limit * (1.0 + 1e-9))).all()
        before = motion["rate"][:, 2:8].copy()
    return worst, held
