"""Clocks of logs: order, wraps, and segments that are swapped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.logs.importer import ImportedLog, import_log
from motion_cueing.envs.logs.signals import ImportOptions

from .synthetic_log import WITH_COURSE, Device, Floats, drive, write


def table() -> dict[str, Floats]:
    return {name: column.copy() for name, column in Device().records(drive()).items()}


def imported(path: Path, columns: dict[str, Floats], unit: str, **options: object) -> ImportedLog:
    log = write(path / "log.csv", columns)
    return import_log(log, WITH_COURSE, units={"time": unit}, options=ImportOptions(**options))  # type: ignore[arg-type]


WRAPPING = {
    "midnight": (86_400_000.0 - 20_000.0, 86_400_000.0, 1e3, "ms", "a day"),
    "32 bits of us": (2.0**32 - 30e6, 2.0**32, 1e6, "us", "32 bits of us"),
    "32 bits of ms": (2.0**32 - 5e3, 2.0**32, 1e3, "ms", "32 bits of ms"),
    "a week": (604_800.0 - 59.0, 604_800.0, 1.0, "s", "a week"),
    "an hour": (3600.0 - 1.0, 3600.0, 1.0, "s", "an hour"),
    "twice": (50_000.0, 2.0**16, 1e3, "ms", "16 bits of ms"),
}


@pytest.mark.parametrize("kind", WRAPPING)
def test_a_clock_that_wraps_is_named_and_unwrapped_by_choice(tmp_path: Path, kind: str) -> None:
    start, period, scale, unit, name = WRAPPING[kind]
    columns = table()
    stamps = start + scale * columns["t"]
    columns["t"] = stamps % period
    first = int(np.argmax(stamps >= period)) + 1
    with pytest.raises(
        DataError, match=rf"backwards at data row {first}, .* wraps after {name} .*clock='mend'"
    ):
        imported(tmp_path, columns, unit)
    # The order is checked before anything is cut.
    with pytest.raises(DataError, match="runs backwards"):
        imported(tmp_path, columns, unit, start_s=1.0)
    mended = imported(tmp_path, columns, unit, clock="mend")
    assert mended.trace.duration == pytest.approx(60.0, abs=0.011)
    assert f"data row {first}" in mended.findings.changes[0].text
    plain = imported(tmp_path, table(), "s")
    n = min(len(plain.trace), len(mended.trace))
    np.testing.assert_allclose(mended.trace.specific_force[:n], plain.trace.specific_force[:n], atol=1e-3)


@pytest.mark.parametrize("clock", ["refuse", "mend"])
@pytest.mark.parametrize("place", [500, 1500, 2900])
def test_swapped_segments_are_refused(tmp_path: Path, place: int, clock: str) -> None:
    columns = {name: np.r_[column[place:], column[:place]] for name, column in table().items()}
    row = len(columns["t"]) - place + 1
    with pytest.raises(DataError, match=rf"time runs backwards at data row {row}, .*wrong order"):
        imported(tmp_path, columns, "s", clock=clock)


@pytest.mark.parametrize("offset", [0.0, 1.4e9])
def test_a_clock_that_begins_again_is_no_wrap(tmp_path: Path, offset: float) -> None:
    columns = table()
    columns["t"] = offset + np.where(columns["t"] < 40.0, columns["t"] + 7.0, columns["t"] - 40.0)
    with pytest.raises(DataError, match=r"time runs backwards at data row 2001, .*; sort or split the log"):
        imported(tmp_path, columns, "s", clock="mend")


@pytest.mark.parametrize("size", [2, 5, 10])
def test_stamps_in_bursts_are_spread_by_choice(tmp_path: Path, size: int) -> None:
    columns = table()
    rows = np.arange(len(columns["t"]))
    columns["t"] = 0.02 * size * (rows // size) + 2e-5 * (rows % size)
    with pytest.raises(DataError, match=r"come in bursts: .*clock='mend'"):
        imported(tmp_path, columns, "s")
    mended = imported(tmp_path, columns, "s", clock="mend")
    assert mended.findings.timing.rate_hz == pytest.approx(50.0, rel=0.01)
    plain = imported(tmp_path, table(), "s").trace.specific_force
    n = min(len(plain), len(mended.trace))
    # The burst is handed over up to its own length late.
    assert np.abs(mended.trace.specific_force[:n] - plain[:n]).max() < 0.02 * size * 3.0


def test_stamps_that_jitter_are_no_bursts(tmp_path: Path) -> None:
    columns = table()
    columns["t"] = columns["t"] + np.random.default_rng(1).uniform(-0.008, 0.008, len(columns["t"]))
    assert imported(tmp_path, columns, "s").findings.changes == ()


def test_nanoseconds_are_known_and_recognized(tmp_path: Path) -> None:
    columns = table()
    columns["t"] = 1e18 + 1e9 * columns["t"]
    assert imported(tmp_path, columns, "ns").trace.duration == pytest.approx(60.0, abs=0.011)
    with pytest.raises(DataError, match="looks like ns"):
        imported(tmp_path, columns, "us")


@pytest.mark.parametrize(
    "start", [9 * 3600 + 58 * 60 + 50, 9 * 3600 + 59 * 60 + 50, 86400 - 20, 12 * 3600 + 29]
)
def test_clock_times_are_recognized_and_read(tmp_path: Path, start: int) -> None:
    columns = table()
    seconds = (start + columns["t"]) % 86400.0
    columns["t"] = np.round(seconds // 3600 * 1e4 + seconds // 60 % 60 * 100 + seconds % 60, 4)
    midnight = start > 86000
    with pytest.raises(
        DataError, match="runs backwards" if midnight else "looks like HHMMSS.*time=COLUMN:hhmmss"
    ):
        imported(tmp_path, columns, "s")
    result = imported(tmp_path, columns, "hhmmss", clock="mend")
    assert result.trace.duration == pytest.approx(60.0, abs=0.011)
    assert bool(result.findings.changes) == midnight


def test_what_is_no_clock_time(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="the time 60 at data row 3001 is no HHMMSS"):
        imported(tmp_path, table(), "hhmmss")
    columns = {name: np.delete(column, slice(1000, 2990)) for name, column in table().items()}
    with pytest.raises(DataError, match=r"gap of 39.8 s .*\(longest_step_s=0.2\); set gaps"):
        imported(tmp_path, columns, "s")
