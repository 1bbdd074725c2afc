"""Outliers, frozen sensors and dead speeds are named with row and time, and refused or mended by choice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.logs.channels import drop_frozen
from motion_cueing.envs.logs.importer import ImportedLog, import_log
from motion_cueing.envs.logs.signals import ImportOptions, RawLog

from .synthetic_log import COLUMNS, WITH_COURSE, Device, Floats, drive, write

FROZEN = ("ax", "ay", "wz")
NOISE = {"smooth": 0.0, "noisy": 0.2}


def table(noise: float = 0.0, standstill: float = 0.0) -> dict[str, Floats]:
    device = Device(0.2, -0.1, 1.0, noise=noise)
    return device.records(drive(60.0 + standstill, standstill=standstill))


def imported(
    folder: Path, columns: dict[str, Floats], names: dict[str, str] = WITH_COURSE, **options: object
) -> ImportedLog:
    return import_log(write(folder / "log.csv", columns), names, options=ImportOptions(**options))  # type: ignore[arg-type]


def assert_alike(result: ImportedLog, other: ImportedLog, force: float) -> None:
    n = min(len(result.trace), len(other.trace))
    difference = result.trace.specific_force[:n] - other.trace.specific_force[:n]
    assert np.abs(difference).max() < force


SPIKES = {
    "one": ("force_y", "ay", [1000], 50.0),
    "negative": ("force_x", "ax", [1000], -40.0),
    "first row": ("force_x", "ax", [0], 2.3e6),
    "last row": ("force_z", "az", [3000], 1e4),
    "three samples": ("force_y", "ay", [1000, 1001, 1002], 60.0),
    "two places": ("force_z", "az", [500, 2000], 60.0),
    "many": ("force_x", "ax", list(range(100, 3000, 40)), 60.0),
    "rate": ("rate_z", "wz", [1000], 99.0),
    "speed drops to zero": ("speed", "v", [800], -13.5),
}


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("kind", SPIKES)
def test_outliers(tmp_path: Path, kind: str, noise: str) -> None:
    signal, name, rows, size = SPIKES[kind]
    good = table(NOISE[noise])
    bad = {**good, name: good[name].copy()}
    bad[name][rows] += size
    message = (
        rf"{signal} is .* at data row {rows[0] + 1} \({0.02 * rows[0]:.3f} s\).*\({len(rows)} in all\); set"
    )
    with pytest.raises(DataError, match=message):
        imported(tmp_path, bad)
    mended = imported(tmp_path, bad, spikes="median")
    assert f"data row {rows[0] + 1} " in mended.findings.changes[0].text
    assert_alike(mended, imported(tmp_path, good), 0.4 if NOISE[noise] else 0.05)


def test_a_hard_bump_and_noise_are_no_outliers(tmp_path: Path) -> None:
    columns = table(1.0)
    bump = 12.0 * np.exp(-(((columns["t"] - 20.0) / 0.1) ** 2)) * np.sin(60.0 * (columns["t"] - 20.0))
    columns["az"] = columns["az"] + bump
    assert imported(tmp_path, columns).findings.changes == ()


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize(("start", "length"), [(500, 50), (1000, 90), (2000, 30)])
def test_a_frozen_sensor_is_a_gap(tmp_path: Path, noise: str, start: int, length: int) -> None:
    good = table(NOISE[noise])
    bad = {name: column.copy() for name, column in good.items()}
    for name in FROZEN:
        bad[name][start : start + length] = bad[name][start]
    message = rf"held one value from {0.02 * start:.3f} to .*data rows {start + 1} to .*the sensor froze"
    with pytest.raises(DataError, match=message):
        imported(tmp_path, bad)
    result = imported(tmp_path, bad, gaps="bridge")
    assert "taken as a gap" in result.findings.changes[0].text
    with pytest.raises(DataError, match="too long to bridge"):
        imported(tmp_path, bad, gaps="bridge", longest_gap_s=0.02 * length - 0.1)


def test_one_noisy_axis_that_froze_to_the_end(tmp_path: Path) -> None:
    columns = table(0.2)
    columns["wx"][2000:] = columns["wx"][2000]
    with pytest.raises(DataError, match=r"rate_x held one value from 40.000 to 60.000 s"):
        imported(tmp_path, columns)


def test_a_coarse_or_slow_sensor_is_not_frozen(tmp_path: Path) -> None:
    coarse = table(0.02)
    coarse |= {name: np.round(coarse[name] / 0.05) * 0.05 for name in ("ax", "ay", "az")}
    coarse |= {name: np.round(coarse[name] / 0.01) * 0.01 for name in ("wx", "wy", "wz")}
    assert imported(tmp_path, coarse).findings.changes == ()
    slow = {name: column if name == "t" else np.repeat(column[::5], 5)[: len(column)]
            for name, column in table(0.2).items()}  # fmt: skip
    assert imported(tmp_path, slow).findings.changes == ()


@pytest.mark.parametrize("names", [COLUMNS, WITH_COURSE])
def test_a_dead_speed(tmp_path: Path, names: dict[str, str]) -> None:
    columns = table()
    columns["v"][700:] = 0.0
    with pytest.raises(DataError, match=r"speed jumps from 1\d.* to 0 m/s at data row 701 \(14.000 s\)"):
        imported(tmp_path, columns, names)


@pytest.mark.parametrize("noise", NOISE)
def test_a_standstill_of_the_speed_alone(tmp_path: Path, noise: str) -> None:
    """A receiver without a fix says zero; the first second of each part is slow, so there is no jump."""
    columns = table(NOISE[noise])
    columns["v"][:1500] = 0.0
    with pytest.raises(DataError, match=r"speed says standstill from .* but the device accelerates or turns"):
        imported(tmp_path, columns)


def test_a_speed_of_minus_one_is_no_value(tmp_path: Path) -> None:
    columns = table()
    columns["v"][1000:1003] = -1.0
    with pytest.raises(DataError, match="speed has an empty or NaN cell"):
        imported(tmp_path, columns)
    result = imported(tmp_path, columns, gaps="bridge")
    assert result.findings.timing.empty_cells == 3
    assert_alike(result, imported(tmp_path, table()), 0.02)


@pytest.mark.parametrize(("signal", "name"), [("speed", "v"), ("course", "course")])
def test_a_receiver_that_froze(tmp_path: Path, signal: str, name: str) -> None:
    columns = table()
    columns[name][1000:1600] = columns[name][1000]
    with pytest.raises(DataError, match=rf"{signal} held one value from 20.000 to 31.980 s"):
        imported(tmp_path, columns)


def test_a_course_that_holds_at_standstill_is_none(tmp_path: Path) -> None:
    columns = table(0.05, standstill=10.0)
    columns["course"][columns["v"] < 0.5] = columns["course"][0]
    assert imported(tmp_path, columns).findings.changes == ()


def test_a_steep_beginning_is_no_outlier(tmp_path: Path) -> None:
    columns = {name: column[300:] for name, column in table().items()}
    columns["ax"] = columns["ax"] + np.clip(3.0 * (1.0 - np.arange(len(columns["t"])) / 10.0), 0.0, None)
    assert imported(tmp_path, columns).findings.changes == ()


@pytest.mark.parametrize("speed", [1.5, 5.0])
def test_a_receiver_holds_its_course_while_the_car_is_slow(speed: float) -> None:
    """Receivers tell no course below some 2 m/s; one that holds it at 5 m/s froze."""
    time = np.arange(500) * 0.02
    course = 0.1 * time + np.random.default_rng(0).normal(0.0, 1e-3, 500)
    course[150:350] = course[150]
    log = RawLog(time, {"speed": np.full(500, speed), "course": course}, np.arange(500) + 1)
    if speed > 2.0:
        with pytest.raises(DataError, match="course held one value"):
            drop_frozen(log, ImportOptions())
    else:
        assert drop_frozen(log, ImportOptions())[1] == []
