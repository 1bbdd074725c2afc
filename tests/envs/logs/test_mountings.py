"""Devices in any position on short drives, and axes that change during a drive."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from benchmarks.import_round_trip import COLUMNS, LARGEST_J, RIGHT_ANGLED, Sensor
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import DataError
from motion_cueing.envs.logs.importer import ImportedLog, import_recording
from motion_cueing.envs.logs.readers.recording import Column, Recording, Table
from motion_cueing.envs.logs.signals import ImportOptions
from motion_cueing.envs.maneuvers import get_maneuver, random_drives


@lru_cache
def whole(name: str) -> tuple[CueTrace, float]:
    """A drive, and when its part of 18 s begins that turns and changes its speed, s."""
    if name == "roundabout":
        return get_maneuver("roundabout").drive(), 4.0
    return list(random_drives(4, 60.0, 7))[int(name)], 10.0


def short_error(name: str, sensor: Sensor) -> float:
    """J between the import of the part of a sensor's log and the part of the drive.

    Raises:
        DataError: the import refuses it.
    """
    drive, begin = whole(name)
    rows = slice(round(100 * begin), round(100 * begin) + 1800)
    table = sensor.record(drive).tables[0]
    columns = tuple(Column(column.name, column.values[rows]) for column in table.columns)
    found = imported(Recording("made", (Table("", columns),))).trace
    force = (found.specific_force - drive.specific_force[rows][: len(found)]) / 0.6
    rate = (found.angular_velocity - drive.angular_velocity[rows][: len(found)]) / np.radians(3.0)
    return float(np.mean(np.sum(force**2 + rate**2, axis=1)))


def imported(recording: Recording, **options: object) -> ImportedLog:
    return import_recording(
        recording,
        COLUMNS,
        options=ImportOptions(**options),
        name="log",
        source="log",  # type: ignore[arg-type]
    )


pytestmark = pytest.mark.slow

SENSORS: dict[str, dict[str, Any]] = {
    "clean": {},
    "left-handed, slow receiver": {"lateral_sign": -1, "delay_s": 0.6},
    "reversed rates, bias": {"rate_sign": -1, "rate_bias_deg_s": 0.6, "force_bias": 0.15},
    "noise": {"noise": 0.15, "delay_s": 0.3, "rate_bias_deg_s": 0.3, "seed": 4},
}
"""One cause each; drives and mountings take turns with them, so that each pair of the three occurs."""
DRIVES = ("roundabout", "0", "1", "2")


def outcome(drive: str, sensor: Sensor) -> str:
    """Empty where the drive comes back or the refusal names its cause; else what is wrong."""
    try:
        found = short_error(drive, sensor)
    except DataError as refusal:
        return "" if "does not show" in str(refusal) else f"{drive}: {refusal}"
    return "" if found < LARGEST_J else f"{drive}: J {found:.3f}"


@pytest.mark.parametrize("mounting", range(24))
def test_right_angled_mountings_on_short_drives(mounting: int) -> None:
    wrong = {
        kind: outcome(DRIVES[(mounting + place) % len(DRIVES)], Sensor(RIGHT_ANGLED[mounting], **options))
        for place, (kind, options) in enumerate(SENSORS.items())
    }
    assert {kind: said for kind, said in wrong.items() if said} == {}


def test_most_short_drives_are_not_refused() -> None:
    found = [short_error(drive, Sensor(RIGHT_ANGLED[7], noise=0.1)) for drive in DRIVES]
    assert max(found) < LARGEST_J


@given(seed=st.integers(0, 10**6), drive=st.sampled_from(DRIVES), kind=st.sampled_from(sorted(SENSORS)))
@settings(max_examples=12)
def test_any_mounting_on_short_drives(seed: int, drive: str, kind: str) -> None:
    matrix = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    assert outcome(drive, Sensor(matrix, **SENSORS[kind])) == ""


def changed(recording: Recording, share: float, **columns: str) -> Recording:
    """The recording whose columns have others' values (``-`` reverses) from a share of its rows on."""
    table = recording.tables[0]
    values = {column.name: column.values for column in table.columns}
    n = len(values["time"])
    late = np.arange(n) >= share * n

    def of(name: str) -> np.ndarray:
        other = columns.get(name, name)
        source = values[other.removeprefix("-")] * (-1.0 if other.startswith("-") else 1.0)
        return np.where(late, source, values[name])

    made = tuple(Column(name, of(name)) for name in values)
    return replace(recording, tables=(Table("", made),))


SWAPS = {
    "x and y swapped": {"force_x": "force_y", "force_y": "force_x"},
    "x and y turned by 90 deg": {"force_x": "force_y", "force_y": "-force_x"},
    "y reversed": {"force_y": "-force_y"},
    "x and y reversed": {"force_x": "-force_x", "force_y": "-force_y"},
}


@lru_cache
def lively() -> list[CueTrace]:
    """Drives that turn and change their speed long before the middle and long after it."""

    def excited(drive: CueTrace) -> bool:
        half = len(drive) // 2
        parts = (slice(0, half - 800), slice(half + 800, None))
        return all(drive.specific_force[part, axis].std() > 0.7 for part in parts for axis in (0, 1))

    return [drive for drive in random_drives(16, 60.0, 11) if excited(drive)]


@pytest.mark.parametrize("swap", SWAPS)
@pytest.mark.parametrize("degrees", [0.0, 35.0])
def test_axes_that_change_midway_are_refused_with_the_time(swap: str, degrees: float) -> None:
    matrix = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    assert len(lively()) >= 3
    for drive in lively()[:3]:
        recording = Sensor(matrix, noise=0.05, delay_s=0.4).record(drive)
        imported(recording)
        with pytest.raises(DataError, match=r"axes of the force change at about \d+ s"):
            imported(changed(recording, 0.5, **SWAPS[swap]))


def test_rates_that_are_reversed_midway_are_refused() -> None:
    recording = Sensor(np.eye(3)).record(lively()[0])
    reversed_rates = {f"rate_{axis}": f"-rate_{axis}" for axis in "xyz"}
    with pytest.raises(DataError, match=r"change"):
        imported(changed(recording, 0.5, **reversed_rates))


def test_a_change_of_axes_is_accepted_by_choice() -> None:
    recording = changed(Sensor(np.eye(3)).record(lively()[0]), 0.9, **SWAPS["x and y swapped"])
    assert len(imported(recording, slopes="accept").trace) > 5000
