"""What loggers do besides: damaged files, numbers for no value, units and axes that change, local clocks."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.logs.importer import ImportedLog, import_log
from motion_cueing.envs.logs.signals import ImportOptions

from .synthetic_log import WITH_COURSE, Device, Floats, drive, write


def table(noise: float = 0.05) -> dict[str, Floats]:
    records = Device(0.1, -0.05, 0.3, noise=noise).records(drive(60.0, 25.0))
    return {name: column.copy() for name, column in records.items()}


def imported(path: Path, columns: dict[str, Floats] | None = None, **options: object) -> ImportedLog:
    log = path / "log.csv"
    if columns is not None:
        write(log, columns)
    return import_log(log, WITH_COURSE, options=ImportOptions(**options))  # type: ignore[arg-type]


def assert_alike(result: ImportedLog, folder: Path, force: float = 0.1) -> None:
    whole = imported(folder, table())
    n = min(len(result.trace), len(whole.trace))
    difference = result.trace.specific_force[:n] - whole.trace.specific_force[:n]
    assert np.sqrt(np.mean(difference**2)) < force


def damaged(kind: str) -> list[str]:
    lines = Path("whole.csv").read_text().splitlines()
    if kind == "trailing text":
        return [*lines, "*** end of session ***"]
    if kind == "two logs joined":
        return [*lines[:800], lines[0], *lines[800:]]
    if kind == "a line cut short":
        return [*lines[:700], lines[700][: len(lines[700]) // 2], *lines[701:]]
    return [*lines[:900], "\0" * 200, *lines[900:]]


DAMAGES = {
    "trailing text": r"line 1503 has 1 cells, the header has 9",
    "two logs joined": r"line 801 is the header once more",
    "a line cut short": r"line 701 has \d cells, the header has 9",
    "zero bytes": r"line 901 holds zero bytes",
}


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_damaged_file_is_named_and_mended_by_choice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "whole.csv", table())
    (tmp_path / "log.csv").write_text("\n".join(damaged(kind)) + "\n")
    with pytest.raises(DataError, match=DAMAGES[kind] + ".*damage='mend'"):
        imported(tmp_path)
    result = imported(tmp_path, damage="mend")
    assert "left out" in result.findings.changes[0].text
    assert_alike(result, tmp_path)


def test_a_packed_file_that_was_cut_off(tmp_path: Path) -> None:
    content = gzip.compress(write(tmp_path / "whole.csv", table()).read_bytes())
    path = tmp_path / "log.csv.gz"
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(DataError, match=r"the packed file is cut off.*damage='mend'"):
        import_log(path, WITH_COURSE)
    result = import_log(path, WITH_COURSE, options=ImportOptions(damage="mend"))
    assert 20.0 < result.trace.duration < 40.0
    assert "cut off: left out" in result.findings.changes[0].text


@pytest.mark.parametrize("number", [-9999.0, 1e30, 32767.0])
@pytest.mark.parametrize(("signal", "name"), [("force_y", "ay"), ("rate_z", "wz"), ("speed", "v")])
def test_a_number_that_stands_for_none(tmp_path: Path, signal: str, name: str, number: float) -> None:
    columns = table()
    columns[name][[300, 301, 302, 303, 900]] = number
    with pytest.raises(DataError, match=rf"{signal} is .* at data row 301 \(5 in all\), which stands for no"):
        imported(tmp_path, columns)
    result = imported(tmp_path, columns, gaps="bridge")
    assert f"{signal}: {number:.6g} taken as no value (5 in all" in result.findings.changes[0].text
    assert_alike(result, tmp_path)


@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_a_sensor_at_the_end_of_its_range(tmp_path: Path, noise: float) -> None:
    columns = table(noise)
    shake = 6.0 * np.sin(2.0 * np.pi * 2.5 * columns["t"]) * np.exp(-(((columns["t"] - 30.0) / 3.0) ** 2))
    columns["ax"] = np.clip(columns["ax"] + shake, -3.0, 3.0)
    with pytest.raises(DataError, match=r"force_x is cut off at -?3 m/s2 at data row .*saturation='accept'"):
        imported(tmp_path, columns)
    result = imported(tmp_path, columns, saturation="accept")
    assert "accepted as it is" in result.findings.changes[0].text
    assert len(result.findings.changes[0].places) > 2


def test_values_that_are_held_are_thinned_out_by_choice(tmp_path: Path) -> None:
    fine = table(0.0)
    held = {name: one if name == "t" else np.repeat(one[::5], 5)[: len(one)] for name, one in fine.items()}
    truth = imported(tmp_path, fine).trace.specific_force
    kept, thinned = (
        imported(tmp_path, held, holds=holds, longest_step_s=0.3).trace.specific_force
        for holds in ("keep", "thin")
    )
    n = min(map(len, (truth, kept, thinned)))
    errors = [np.sqrt(np.mean((one[100 : n - 100] - truth[100 : n - 100]) ** 2)) for one in (kept, thinned)]
    assert errors[1] < 0.3 * errors[0]


def test_a_block_of_rows_that_comes_again(tmp_path: Path) -> None:
    """A buffer that was written twice: with its stamps, or with new ones."""
    columns = table()
    twice = np.r_[np.arange(600), np.arange(550, len(columns["t"]))]
    repeated = {name: one[twice] for name, one in columns.items()}
    with pytest.raises(DataError, match=r"data rows 601 to 650 repeat rows 551 to 600; set damage='mend'"):
        imported(tmp_path, repeated)
    result = imported(tmp_path, repeated, damage="mend")
    assert "repeat rows 551 to 600: left out" in result.findings.changes[0].text
    assert_alike(result, tmp_path)
    for name in columns:
        if name != "t":
            columns[name][600:640] = columns[name][560:600]
    with pytest.raises(DataError, match=r"data rows 601 to 640 repeat rows 561 to 600"):
        imported(tmp_path, columns)


@pytest.mark.parametrize("hour", [-3600.0, 3600.0])
def test_a_local_clock_that_is_set(tmp_path: Path, hour: float) -> None:
    columns = table()
    columns["t"] = 10_000.0 + columns["t"] + np.where(columns["t"] >= 30.0, hour, 0.0)
    with pytest.raises(DataError, match=r"data row 751.* daylight saving.*clock='mend'"):
        imported(tmp_path, columns)
    result = imported(tmp_path, columns, clock="mend")
    assert "daylight saving" in result.findings.changes[0].text
    assert_alike(result, tmp_path)


UNITS = {
    "force": (("ax", "ay", "az"), 1.0 / 9.80665, "gravity changes from .* the unit of the force changes"),
    "speed": (("v",), 3.6, "speed jumps from .* at data row 501 .*the factor of m/s and km/h"),
}


@pytest.mark.parametrize("kind", UNITS)
@pytest.mark.parametrize("earlier", [True, False])
def test_a_unit_that_changes(tmp_path: Path, kind: str, earlier: bool) -> None:
    names, factor, message = UNITS[kind]
    columns = table()
    first = np.arange(len(columns["t"])) < 500
    for name in names:
        columns[name] = np.where(first == earlier, factor * columns[name], columns[name])
    with pytest.raises(DataError, match=message):
        imported(tmp_path, columns)


def test_axes_that_change(tmp_path: Path) -> None:
    """Half of the log has y and z swapped, as from a phone that fell over."""
    columns = table()
    later = columns["t"] >= 30.0
    changed = dict(columns)
    for name, other, sign in (("ay", "az", -1.0), ("az", "ay", 1.0), ("wy", "wz", -1.0), ("wz", "wy", 1.0)):
        changed[name] = np.where(later, sign * columns[other], columns[name])
    with pytest.raises(DataError, match=r"the vertical tilts by .* the device moved, or its axes change"):
        imported(tmp_path, changed)


def test_a_header_that_is_missing(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", table())
    path.write_text("\n".join(path.read_text().splitlines()[1:]))
    with pytest.raises(DataError, match="missing column t; found #1, #2"):
        import_log(path, WITH_COURSE)
    columns = {name: f"#{place}" for place, name in enumerate(WITH_COURSE, start=1)}
    assert_alike(import_log(path, columns), tmp_path)
