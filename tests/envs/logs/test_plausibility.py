"""Wrong units and missing gravity are refused with the likely cause, whatever the mounting."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.logs.importer import ImportedLog, import_log
from motion_cueing.envs.logs.signals import ImportOptions

from .synthetic_log import COLUMNS, WITH_COURSE, Device, Floats, drive, write

FORCES, RATES = ("ax", "ay", "az"), ("wx", "wy", "wz")
DEVICES = {"level": Device(), "askew": Device(0.4, -0.3, 2.0, rate_bias=(0.01, -0.01, 0.02), noise=0.1)}


def scaled(table: dict[str, Floats], names: tuple[str, ...], factor: float) -> dict[str, Floats]:
    return {name: column * factor if name in names else column for name, column in table.items()}


def imported(
    folder: Path, table: dict[str, Floats], columns: dict[str, str] = WITH_COURSE, **options: object
) -> ImportedLog:
    return import_log(write(folder / "log.csv", table), columns, options=ImportOptions(**options))  # type: ignore[arg-type]


UNITS = {
    "force in g": (FORCES, 1.0 / 9.80665, "gravity is 1.0.*looks like g: declare it .force_x=COLUMN:g"),
    "force in mg": (FORCES, 1000.0 / 9.80665, "gravity is 10.*looks like mg"),
    "force in ft/s2": (FORCES, 1.0 / 0.3048, "gravity is 32.*looks like ft/s2"),
    "speed in km/h": (("v",), 3.6, "f_x on dv/dt 0.2.*the speed is off.*speed=COLUMN:km/h"),
    "speed in mph": (("v",), 1.0 / 0.44704, "f_x on dv/dt 0.4.*the speed is off.*speed=COLUMN:mph"),
    "speed in knots": (("v",), 1.9438, "f_x on dv/dt 0.5.*the speed is off.*knots"),
    "speed too small": (("v",), 1.0 / 3.6, "the speed is off by a factor of 0.2"),
    "rates in deg/s": (RATES, np.degrees(1.0), "no car does.*rate_[xyz]=COLUMN:deg/s"),
    "rates too small": (RATES, np.radians(1.0), "the rates are off by a factor of 0.0175.*rad/s"),
}


@pytest.mark.parametrize("standstill", [0.0, 10.0])
@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("kind", UNITS)
def test_a_wrong_unit_is_named(tmp_path: Path, kind: str, device: str, standstill: float) -> None:
    names, factor, message = UNITS[kind]
    table = DEVICES[device].records(drive(60.0 + standstill, standstill=standstill))
    with pytest.raises(DataError, match=message):
        imported(tmp_path, scaled(table, names, factor))


def test_slow_rates_in_degrees_are_found_by_their_slope(tmp_path: Path) -> None:
    """A motorway turns so slowly that its rates in deg/s could be some car's in rad/s."""
    truth = drive()
    table = Device().records(truth)
    table |= {
        "wz": 0.1 * table["wz"],
        "ay": 0.1 * table["ay"],
        "wx": 0.1 * table["wx"],
        "wy": 0.1 * table["wy"],
    }
    # So that the force of the turns can be judged, the car is four times as fast.
    table |= {"v": 4.0 * table["v"], "ax": 4.0 * table["ax"], "ay": 4.0 * table["ay"]}
    wrong = scaled(table, RATES, np.degrees(1.0))
    with pytest.raises(DataError, match=r"the rates are off by a factor of 57.*deg/s"):
        imported(tmp_path, wrong, COLUMNS)


def test_a_course_of_another_unit(tmp_path: Path) -> None:
    table = Device().records(drive())
    table["course"] = np.unwrap(table["course"])
    path = write(tmp_path / "log.csv", table)
    with pytest.raises(DataError, match=r"the course is off by a factor of 0.0175.*rad"):
        import_log(path, WITH_COURSE, units={"course": "deg"})


def test_a_course_in_degrees_declared_in_radians(tmp_path: Path) -> None:
    table = Device().records(drive())
    table["course"] = np.degrees(np.mod(table["course"] - 0.5, 2.0 * np.pi))
    with pytest.raises(DataError, match=r"course jumps by .* rad at data row \d+: .*course=COLUMN:deg"):
        imported(tmp_path, table)


def test_slopes_are_shown_and_accepted_by_choice(tmp_path: Path) -> None:
    table = Device().records(drive())
    lines = "\n".join(imported(tmp_path, table).findings.lines())
    for name in ("f_x on dv/dt", "f_y on v r", "heading on course"):
        assert f"slope of {name:<18} 1.00" in lines or f"slope of {name:<18} 0.99" in lines
    odd = imported(tmp_path, scaled(table, ("v",), 3.6), slopes="accept").findings
    assert odd.slopes.along is not None
    assert odd.slopes.along.likely == pytest.approx(1.0 / 3.6, rel=0.02)


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.0])
def test_missing_gravity_is_named_and_added_by_choice(tmp_path: Path, yaw: float) -> None:
    truth = drive()
    table = Device(0.2, 0.1, yaw).records(truth)
    rest = Device(0.2, 0.1, yaw).records(replace(truth, force=0.0 * truth.force - [0.0, 0.0, 9.81]))
    without = {**table, **{name: table[name] - rest[name] for name in FORCES}}
    with pytest.raises(DataError, match="comes without gravity; set gravity='add'"):
        imported(tmp_path, without)
    attitude = {"roll_deg": np.degrees(0.2), "pitch_deg": np.degrees(0.1)}
    mended = imported(tmp_path, without, gravity="add", **attitude)
    whole = imported(tmp_path, table, **attitude)
    np.testing.assert_allclose(mended.trace.specific_force, whole.trace.specific_force, atol=1e-6)
    assert "gravity added" in mended.findings.changes[0].text
    with pytest.raises(DataError, match="comes with gravity; leave out gravity='add'"):
        imported(tmp_path, table, gravity="add")


def test_a_device_that_counts_in_a_scale_of_its_own(tmp_path: Path) -> None:
    table = scaled(Device().records(drive()), FORCES, 0.8)
    with pytest.raises(DataError, match=r"gravity is 7.8.*give gravity_m_s2"):
        imported(tmp_path, table)
    assert imported(tmp_path, table, gravity_m_s2=7.85).findings.gravity == 7.85


def test_a_yaw_rate_that_is_dead_for_a_while_is_noted(tmp_path: Path) -> None:
    table = Device().records(drive())
    whole = imported(tmp_path, table).findings.device.notes
    assert not any("may be dead" in note for note in whole)
    for name, expected in (("wz", "f_y varies, v r does not"), ("ay", "v r varies, f_y does not")):
        first = int(np.argmax(np.diff(np.sign(table[name][1000:])) != 0)) + 1000
        dead = {**table, name: np.where(np.arange(len(table["t"])) < first, 0.0, table[name])}
        notes = imported(tmp_path, dead, COLUMNS, slopes="accept", yaw_deg=0.0).findings.device.notes
        assert any(expected in note for note in notes)


def test_a_force_that_does_not_follow_the_speed_is_noted(tmp_path: Path) -> None:
    table = Device().records(drive())
    table["ax"] = np.roll(table["ax"], len(table["ax"]) // 4)
    notes = imported(tmp_path, table, yaw_deg=0.0, speed_delay_s=0.0, slopes="accept").findings.device.notes
    assert any("f_x does not follow dv/dt" in note for note in notes)
