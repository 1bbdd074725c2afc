"""The maneuvers of the package, exported as logs of a device that sits askew, come back as they were."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs import CueTrace
from motion_cueing.envs.car import get_car
from motion_cueing.envs.logs.importer import ImportedLog, import_log
from motion_cueing.envs.maneuvers.registry import get_maneuver, maneuver_names
from motion_cueing.envs.maneuvers.sampling import random_drives

from .synthetic_log import COLUMNS, WITH_COURSE, Floats, rotation, write

pytestmark = pytest.mark.slow

LARGEST_J = 0.15
"""Of the error, in units of 0.6 m/s^2 and 3 deg/s."""


def exported(folder: Path, drive: CueTrace, device: Floats, bias: float, delay: float, noise: float) -> Path:
    """A log of a drive by a device of attitude (3, 3), with a bias of all rates in deg/s."""
    rng = np.random.default_rng(1)
    force = drive.specific_force @ device + noise * rng.standard_normal((len(drive), 3))
    rate = (drive.angular_velocity + np.radians(bias)) @ device
    rate += 0.02 * noise * rng.standard_normal(rate.shape)
    speed = np.interp(drive.time - delay, drive.time, drive.channels["speed_m_s"])
    slip = np.arctan2(drive.channels["lateral_speed_m_s"], np.maximum(drive.channels["speed_m_s"], 1.0))
    course = np.interp(drive.time - delay, drive.time, np.unwrap(drive.channels["heading_rad"]) + slip)
    table = {
        "t": drive.time,
        **dict(zip(("ax", "ay", "az", "wx", "wy", "wz"), (*force.T, *rate.T), strict=True)),
    }
    return write(folder / "log.csv", {**table, "v": speed, "course": np.mod(course, 2.0 * np.pi)})


def error(result: ImportedLog, drive: CueTrace) -> float:
    """Mean over time of the squared errors in units of the indifference zone."""
    n = min(len(result.trace), len(drive))
    force = (result.trace.specific_force[:n] - drive.specific_force[:n]) / 0.6
    rate = (result.trace.angular_velocity[:n] - drive.angular_velocity[:n]) / np.radians(3.0)
    return float(np.mean(np.sum(force**2 + rate**2, axis=1)))


@pytest.mark.parametrize("columns", [COLUMNS, WITH_COURSE], ids=["speed", "speed and course"])
@pytest.mark.parametrize("name", maneuver_names())
def test_a_level_device(tmp_path: Path, name: str, columns: dict[str, str]) -> None:
    drive = get_maneuver(name).drive()
    result = import_log(exported(tmp_path, drive, np.eye(3), 0.0, 0.0, 0.0), columns)
    assert error(result, drive) < LARGEST_J
    mounting = result.findings.device.mounting
    assert (mounting.lateral_sign, mounting.rate_sign) == (1, 1)
    assert max(abs(mounting.roll), abs(mounting.pitch)) < np.radians(1.0)


@pytest.mark.parametrize("name", ["slalom", "double-lane-change", "obstacle-avoidance"])
def test_another_car_at_constant_speed_is_not_mirrored(tmp_path: Path, name: str) -> None:
    drive = get_maneuver(name).drive(get_car("e-class-suv"))
    result = import_log(exported(tmp_path, drive, np.eye(3), 0.0, 0.0, 0.0), WITH_COURSE)
    assert result.findings.speed_delay < 0.1
    assert error(result, drive) < LARGEST_J


@pytest.mark.parametrize("delay", [0.0, 0.8])
@pytest.mark.parametrize("name", maneuver_names())
def test_a_cheap_device_askew(tmp_path: Path, name: str, delay: float) -> None:
    drive = get_maneuver(name).drive()
    result = import_log(exported(tmp_path, drive, rotation(0.4, -0.7, 2.2), 0.8, delay, 0.1), WITH_COURSE)
    assert error(result, drive) < LARGEST_J


def test_random_drives(tmp_path: Path) -> None:
    for number, drive in enumerate(random_drives(6, 60.0, 7)):
        device = rotation(*np.random.default_rng(number).uniform(-1.5, 1.5, 3))
        result = import_log(exported(tmp_path, drive, device, -0.5, 0.3, 0.1), WITH_COURSE)
        assert error(result, drive) < LARGEST_J


def test_all_right_angled_mountings(tmp_path: Path) -> None:
    """Every way to put a box into a car along its axes, also with one axis mirrored."""
    drive = random_drives(1, 60.0, 3)[0]
    corners = [np.eye(3)[list(order)] * signs
               for order in itertools.permutations(range(3))
               for signs in itertools.product([1.0, -1.0], repeat=3)]  # fmt: skip
    for device in corners[::2] + corners[1::6]:
        result = import_log(exported(tmp_path, drive, device, 0.5, 0.4, 0.05), WITH_COURSE)
        assert error(result, drive) < LARGEST_J
