"""Every drive of the project as the log of a cheap sensor, in every mounting: does it come back?

Run it with `python -m benchmarks.import_round_trip`: all maneuvers and 50 random drives, each with speed and
course, by a device in the 24 right-angled mountings and four random ones. Lateral sign, sense of the rates,
bias, delay of the receiver and noise are drawn for each. It prints J between import and truth, the worst
cases, and each refusal.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import DataError
from motion_cueing.envs.logs.importer import import_recording
from motion_cueing.envs.logs.readers.recording import Column, Recording, Table
from motion_cueing.envs.logs.signals import ImportOptions
from motion_cueing.envs.maneuvers.registry import get_maneuver, maneuver_names
from motion_cueing.envs.maneuvers.sampling import random_drives

Floats = NDArray[np.float64]
LARGEST_J = 0.15
"""Of the mean squared error, in units of 0.6 m/s^2 and 3 deg/s."""
SIGNALS = ("force_x", "force_y", "force_z", "rate_x", "rate_y", "rate_z", "speed", "course")
COLUMNS = {name: name for name in ("time", *SIGNALS)}
RIGHT_ANGLED: tuple[Floats, ...] = tuple(
    matrix
    for order in itertools.permutations(range(3))
    for signs in itertools.product([1.0, -1.0], repeat=3)
    for matrix in [np.eye(3)[list(order)] * signs]
    if np.linalg.det(matrix) > 0.0
)


@dataclass(frozen=True)
class Sensor:
    """A cheap device: a matrix from car to device axes, and its errors.

    The noise of the rates, in rad/s, is a fiftieth of that of the force.
    """

    matrix: Floats
    lateral_sign: int = 1
    rate_sign: int = 1
    force_bias: float = 0.0
    rate_bias_deg_s: float = 0.0
    delay_s: float = 0.0
    noise: float = 0.0
    seed: int = 0

    def record(self, drive: CueTrace) -> Recording:
        """What the device writes of a drive."""
        rng = np.random.default_rng(self.seed)
        to_device = np.diag([1.0, self.lateral_sign, 1.0]) @ self.matrix
        bias = rng.choice([-1.0, 1.0], (2, 3))
        force = (drive.specific_force + np.array([0.0, 0.0, self.force_bias])) @ to_device
        rate = self.rate_sign * drive.angular_velocity @ to_device
        rate += np.radians(self.rate_bias_deg_s) * bias[1]
        force += self.noise * rng.standard_normal(force.shape)
        rate += 0.02 * self.noise * rng.standard_normal(rate.shape)
        late = drive.time - self.delay_s
        speed = np.interp(late, drive.time, drive.channels["speed_m_s"])
        slip = np.arctan2(drive.channels["lateral_speed_m_s"], np.maximum(drive.channels["speed_m_s"], 1.0))
        course = np.interp(late, drive.time, np.unwrap(drive.channels["heading_rad"]) + slip)
        values = (*force.T, *rate.T, speed, np.mod(course, 2.0 * np.pi))
        columns = [Column(name, column) for name, column in zip(SIGNALS, values, strict=True)]
        return Recording("made", (Table("", (Column("time", drive.time), *columns)),))


def error(drive: CueTrace, sensor: Sensor) -> float:
    """J between the import of a sensor's log and the drive."""
    options = ImportOptions()
    found = import_recording(sensor.record(drive), COLUMNS, options=options, name="log", source="log").trace
    n = min(len(found), len(drive))
    force = (found.specific_force[:n] - drive.specific_force[:n]) / 0.6
    rate = (found.angular_velocity[:n] - drive.angular_velocity[:n]) / np.radians(3.0)
    return float(np.mean(np.sum(force**2 + rate**2, axis=1)))


def drives(random: int) -> dict[str, CueTrace]:
    """All maneuvers, and so many random drives of a minute."""
    named = {name: get_maneuver(name).drive() for name in maneuver_names()}
    return named | {f"random {place}": drive for place, drive in enumerate(random_drives(random, 60.0, 19))}


def sensors(turned: int, seed: int) -> list[Sensor]:
    """A sensor in each right-angled and in ``turned`` random mountings, its errors drawn."""
    rng = np.random.default_rng(seed)
    matrices = [*RIGHT_ANGLED, *(Rotation.random(rng=rng).as_matrix() for _ in range(turned))]
    return [
        Sensor(
            matrix,
            lateral_sign=int(rng.choice([1, -1])),
            rate_sign=int(rng.choice([1, -1])),
            force_bias=float(rng.uniform(-0.2, 0.2)),
            rate_bias_deg_s=float(rng.uniform(0.0, 1.0)),
            delay_s=float(rng.uniform(0.0, 1.0)),
            noise=float(rng.uniform(0.0, 0.2)),
            seed=int(rng.integers(2**31)),
        )
        for matrix in matrices
    ]


def main() -> None:
    """Run the product and print what came back."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--random", type=int, default=50, help="random drives")
    parser.add_argument("--turned", type=int, default=4, help="random mountings of each drive")
    parser.add_argument("--worst", type=int, default=12, help="cases to show")
    given = parser.parse_args()
    start = time.monotonic()
    found: list[tuple[float, str, Sensor]] = []
    refused: Counter[str] = Counter()
    for place, (name, drive) in enumerate(drives(given.random).items()):
        before = len(found), sum(refused.values())
        for sensor in sensors(given.turned, place):
            try:
                found.append((error(drive, sensor), name, sensor))
            except DataError as refusal:
                refused[f"{name}: {str(refusal).split(':')[0][:60]}"] += 1
        errors = [one for one, *_ in found[before[0] :]]
        print(
            f"{name:<22} {len(errors):4d} imports, median J {np.median(errors) if errors else np.nan:.3f}, "
            f"largest {max(errors, default=np.nan):.3f}, {sum(refused.values()) - before[1]} refused",
            flush=True,
        )
    errors = np.array([one for one, *_ in found])
    print(f"\n{len(errors)} imports and {sum(refused.values())} refusals in {time.monotonic() - start:.0f} s")
    quantiles = ", ".join(f"{q:g} %: {np.percentile(errors, q):.4f}" for q in (5, 25, 50, 75, 95, 99, 100))
    print(f"J between import and truth, {quantiles}")
    print(f"J of {LARGEST_J} or more: {int(np.sum(errors >= LARGEST_J))}")
    for one, name, sensor in sorted(found, key=lambda case: -case[0])[: given.worst]:
        said = (
            f"signs {sensor.lateral_sign:+d} {sensor.rate_sign:+d}, bias {sensor.rate_bias_deg_s:.2f} deg/s, "
            f"delay {sensor.delay_s:.2f} s, noise {sensor.noise:.2f} m/s^2"
        )
        print(f"  {one:9.3f}  {name:<22} {said}")
    for text, count in refused.most_common():
        print(f"  refused {count:4d}  {text}")


if __name__ == "__main__":
    main()
