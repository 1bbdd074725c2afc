"""Import of logs whose truth is known."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.errors import ConfigurationError, DataError, MotionCueingError
from motion_cueing.envs.logs.importer import ImportedLog, import_log
from motion_cueing.envs.logs.mounting import Mounting, level
from motion_cueing.envs.logs.signals import ImportOptions, low_pass

from .synthetic_log import COLUMNS, WITH_COURSE, Device, Floats, Truth, drive, rotation, write

INSIDE = slice(300, -300)
"""Away from the ends, where filters and the delayed speed have edges."""

ANGLE = st.floats(-math.pi, math.pi)
SIGN = st.sampled_from([1, -1])
BIAS = st.floats(-0.05, 0.05)


def imported(
    folder: Path, device: Device, truth: Truth, columns: dict[str, str] = WITH_COURSE, **options: object
) -> ImportedLog:
    path = write(folder / "log.csv", device.records(truth))
    return import_log(path, columns, options=ImportOptions(**options))  # type: ignore[arg-type]


def at_100_hz(truth: Truth, values: Floats) -> Floats:
    time = np.arange(round(truth.time[-1] * 100) + 1) / 100
    return np.stack([np.interp(time, truth.time, column) for column in values.T], axis=1)


def assert_recovered(result: ImportedLog, truth: Truth, force: float, rate: float) -> None:
    trace = result.trace
    assert trace.dt == pytest.approx(0.01, rel=1e-12)
    wanted = at_100_hz(truth, truth.force), at_100_hz(truth, truth.rate)
    np.testing.assert_allclose(trace.specific_force[INSIDE], wanted[0][INSIDE], atol=force)
    np.testing.assert_allclose(trace.angular_velocity[INSIDE], wanted[1][INSIDE], atol=rate)


@pytest.mark.slow
@settings(max_examples=25)
@given(
    roll=ANGLE,
    pitch=st.floats(-1.5, 1.5),
    yaw=ANGLE,
    lateral=SIGN,
    rates=SIGN,
    bias=st.tuples(BIAS, BIAS, BIAS),
)
def test_any_mounting_is_recovered(
    tmp_path_factory: pytest.TempPathFactory,
    roll: float,
    pitch: float,
    yaw: float,
    lateral: int,
    rates: int,
    bias: tuple[float, float, float],
) -> None:
    truth = drive()
    device = Device(roll, pitch, yaw, lateral, rates, bias, gravity_error=0.2)
    result = imported(tmp_path_factory.mktemp("log"), device, truth)
    found = result.findings.device
    assert found.mounting.lateral_sign == lateral
    assert found.mounting.rate_sign == rates
    turned = np.diag([1.0, lateral, 1.0]) @ rotation(roll, pitch, yaw)
    assert np.abs(found.mounting.matrix - turned).max() < 0.01
    np.testing.assert_allclose(found.rate_bias, bias, atol=2e-3)
    assert result.findings.gravity == pytest.approx(10.01, abs=0.01)
    assert found.force_speed > 0.99
    assert found.force_turn > 0.99
    assert_recovered(result, truth, force=0.06, rate=4e-3)


def test_noise_and_a_late_speed(tmp_path: Path) -> None:
    truth = drive(seconds=120.0)
    device = Device(0.1, -0.2, 2.5, -1, -1, (0.01, -0.02, 0.03), noise=0.5, speed_delay=0.8)
    result = imported(tmp_path, device, truth, cutoff_hz=1.0)
    assert result.findings.speed_delay == pytest.approx(0.8, abs=0.1)
    mounting = result.findings.device.mounting
    assert mounting.roll == pytest.approx(0.1, abs=0.01)
    assert mounting.pitch == pytest.approx(-0.2, abs=0.01)
    assert mounting.yaw == pytest.approx(2.5, abs=0.03)
    rms = np.sqrt(np.mean((result.trace.specific_force - at_100_hz(truth, truth.force))[INSIDE] ** 2, axis=0))
    assert np.all(rms < 0.15)
    speed = result.trace.channels["speed_m_s"][INSIDE]
    np.testing.assert_allclose(speed, at_100_hz(truth, truth.speed[:, None])[INSIDE, 0], atol=0.2)


def test_standstill_gives_gravity_and_biases(tmp_path: Path) -> None:
    truth = drive(seconds=70.0, standstill=10.0)
    device = Device(0.3, 0.2, -1.0, rate_bias=(0.02, -0.03, 0.04), gravity_error=-0.3)
    result = imported(tmp_path, device, truth, columns=COLUMNS)
    found = result.findings.device
    assert found.rest_from == "standstill"
    assert found.bias_from == ("standstill", "standstill")
    np.testing.assert_allclose(found.rate_bias, device.rate_bias, atol=3e-4)
    assert_recovered(result, truth, force=0.03, rate=2e-3)
    resting = result.trace.specific_force[100:700]
    np.testing.assert_allclose(resting, np.tile([0.0, 0.0, -9.81], (600, 1)), atol=2e-3)


def test_without_course_a_single_reversed_axis_is_mended_and_noted(tmp_path: Path) -> None:
    truth = drive()
    result = imported(tmp_path, Device(lateral_sign=-1), truth, columns=COLUMNS)
    assert result.findings.device.mounting.lateral_sign == -1
    assert any("mirror image" in note for note in result.findings.device.notes)
    assert_recovered(result, truth, force=0.06, rate=4e-3)


def test_an_accelerometer_that_counts_backwards(tmp_path: Path) -> None:
    """All three force axes reversed: with a course, left and right come out right."""
    truth = drive()
    columns = {**WITH_COURSE, **{f"force_{axis}": f"-a{axis}" for axis in "xyz"}}
    result = imported(tmp_path, Device(0.1, 0.2, 0.3), truth, columns=columns)
    assert_recovered(result, truth, force=0.06, rate=4e-3)


def test_overrides_replace_every_estimate(tmp_path: Path) -> None:
    truth = drive()
    result = imported(
        tmp_path,
        Device(0.1, 0.2, 0.3),
        truth,
        roll_deg=1.0,
        pitch_deg=2.0,
        yaw_deg=3.0,
        lateral_sign="flip",
        rate_sign="flip",
        gravity_m_s2=9.7,
        rate_bias_deg_s=(1.0, 2.0, 3.0),
        speed_delay_s=0.5,
    )
    findings = result.findings
    expected = Mounting(math.radians(1.0), math.radians(2.0), math.radians(3.0), -1, -1)
    assert findings.device.mounting == expected
    assert findings.gravity == 9.7
    assert findings.speed_delay == 0.5
    np.testing.assert_allclose(np.degrees(findings.device.rate_bias), [1.0, 2.0, 3.0])
    force = expected.force_in_car(result.raw_force) + np.array([0.0, 0.0, 9.7 - 9.81])
    np.testing.assert_allclose(result.trace.specific_force, low_pass(force, 100.0, 5.0), atol=2e-3)
    rate = expected.rate_in_car(result.raw_rate) - np.radians([1.0, 2.0, 3.0])
    np.testing.assert_allclose(result.trace.angular_velocity, low_pass(rate, 100.0, 5.0), atol=1e-4)


def test_units_and_constants(tmp_path: Path) -> None:
    truth = drive()
    si = Device().records(truth)
    scaled = {
        "t": 1.4e12 + 1000.0 * si["t"],
        **{axis: si[axis] / 9.80665 for axis in ("ax", "ay", "az")},
        **{axis: np.degrees(si[axis]) for axis in ("wx", "wy", "wz")},
        "v": 3.6 * si["v"],
        "course": np.degrees(si["course"]),
    }
    units = {"time": "ms", "speed": "km/h", "course": "deg"}
    units |= {f"force_{axis}": "g" for axis in "xyz"} | {f"rate_{axis}": "deg/s" for axis in "xyz"}
    plain = import_log(write(tmp_path / "si.csv", si), WITH_COURSE).trace
    other = import_log(write(tmp_path / "other.csv", scaled), WITH_COURSE, units=units).trace
    np.testing.assert_allclose(other.specific_force, plain.specific_force, atol=1e-6)
    np.testing.assert_allclose(other.angular_velocity, plain.angular_velocity, atol=1e-7)
    np.testing.assert_allclose(other.channels["speed_m_s"], plain.channels["speed_m_s"], atol=1e-6)
    mph = {**si, "v": si["v"] / 0.44704}
    in_mph = import_log(write(tmp_path / "mph.csv", mph), WITH_COURSE, units={"speed": "mph"}).trace
    np.testing.assert_allclose(in_mph.specific_force, plain.specific_force, atol=1e-9)
    level_car = import_log(tmp_path / "si.csv", {**WITH_COURSE, "rate_x": "0", "force_z": "-9.81"}).trace
    np.testing.assert_allclose(level_car.angular_velocity[INSIDE, 0], 0.0, atol=2e-3)


def test_swapped_columns(tmp_path: Path) -> None:
    truth = drive()
    si = Device().records(truth)
    swapped = {**si, "ax": si["ay"], "ay": -si["ax"], "wx": si["wy"], "wy": -si["wx"]}
    columns = {**WITH_COURSE, "force_x": "-ay", "force_y": "ax", "rate_x": "-wy", "rate_y": "wx"}
    plain = import_log(write(tmp_path / "a.csv", si), WITH_COURSE).trace
    other = import_log(write(tmp_path / "b.csv", swapped), columns).trace
    np.testing.assert_array_equal(other.specific_force, plain.specific_force)
    np.testing.assert_array_equal(other.angular_velocity, plain.angular_velocity)


@given(roll=st.floats(-3.1, 3.1), pitch=st.floats(-1.5, 1.5))
def test_levelling_inverts_the_mounting(roll: float, pitch: float) -> None:
    rest = Mounting(roll, pitch).matrix.T @ [0.0, 0.0, -9.81]
    np.testing.assert_allclose(level(rest), (roll, pitch), atol=1e-9)


@given(roll=ANGLE, pitch=ANGLE, yaw=ANGLE, lateral=SIGN)
def test_mounting_matrix_is_the_textbook_rotation(
    roll: float, pitch: float, yaw: float, lateral: int
) -> None:
    wanted = np.diag([1.0, lateral, 1.0]) @ rotation(roll, pitch, yaw)
    np.testing.assert_allclose(Mounting(roll, pitch, yaw, lateral).matrix, wanted, atol=1e-14)


def test_low_pass_has_no_delay_and_the_stated_gain() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    for frequency, gain in ((2.0, 0.5), (0.2, 1.0), (20.0, 0.0)):
        passed = low_pass(np.sin(2.0 * np.pi * frequency * time), 100.0, 2.0)
        wanted = gain * np.sin(2.0 * np.pi * frequency * time)
        np.testing.assert_allclose(passed[500:-500], wanted[500:-500], atol=2e-3)
    with pytest.raises(DataError, match="cutoff 60 Hz"):
        low_pass(time, 100.0, 60.0)


def test_a_faster_log_does_not_alias(tmp_path: Path) -> None:
    """A 98 Hz shake in a 400 Hz log would be a 2 Hz one in 100 Hz samples."""
    truth = drive(rate_hz=400.0)
    columns = Device().records(truth)
    columns["az"] = columns["az"] + 2.0 * np.sin(2.0 * np.pi * 98.0 * truth.time)
    result = import_log(write(tmp_path / "log.csv", columns), WITH_COURSE)
    assert result.trace.dt == pytest.approx(0.01)
    assert np.abs(result.trace.specific_force[INSIDE, 2] + 9.81).max() < 2e-3


def broken(kind: str) -> dict[str, Floats]:
    """A good log with one fault at 20 s."""
    table = {name: column.copy() for name, column in Device().records(drive()).items()}
    if kind == "gap":
        keep = (table["t"] < 20.0) | (table["t"] > 20.8)
        return {name: column[keep] for name, column in table.items()}
    if kind == "long gap":
        keep = (table["t"] < 20.0) | (table["t"] > 25.0)
        return {name: column[keep] for name, column in table.items()}
    if kind == "repeat":
        table["t"][1000] = table["t"][999]
    elif kind == "backwards":
        table["t"][1000] = 1.0
    elif kind == "infinite":
        table["wy"][1000] = np.inf
    else:
        table[kind][1000] = np.nan
    return table


BRIDGED = {
    "gap": "gap of 0.84 s in force_x at 19.980 s",
    "repeat": "time stamp repeats at data row 1001",
    "ay": "force_y has an empty or NaN cell at data row 1001",
    "v": "speed has an empty or NaN cell at data row 1001",
    "t": "time is empty at data row 1001",
}


@pytest.mark.parametrize("kind", BRIDGED)
def test_missing_data_is_refused_or_bridged_by_choice(tmp_path: Path, kind: str) -> None:
    path = write(tmp_path / "log.csv", broken(kind))
    with pytest.raises(DataError, match=BRIDGED[kind]):
        import_log(path, WITH_COURSE)
    result = import_log(path, WITH_COURSE, options=ImportOptions(gaps="bridge"))
    assert_recovered(result, drive(), force=0.1, rate=0.02)
    timing = result.findings.timing
    counted = (timing.bridged > 0, timing.repeated, timing.empty_cells)
    assert counted == {"gap": (True, 0, 0), "ay": (False, 0, 1), "v": (False, 0, 1)}.get(kind, (False, 1, 0))


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("long gap", "too long to bridge"),
        ("backwards", "time runs backwards at data row 1001"),
        ("infinite", "rate_y is infinite at data row 1001"),
    ],
)
def test_what_cannot_be_bridged(tmp_path: Path, kind: str, message: str) -> None:
    path = write(tmp_path / "log.csv", broken(kind))
    with pytest.raises(DataError, match=message):
        import_log(path, WITH_COURSE, options=ImportOptions(gaps="bridge"))


def test_a_fault_outside_start_and_end_does_not_matter(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", broken("long gap"))
    trace = import_log(path, WITH_COURSE, options=ImportOptions(start_s=26.0, end_s=56.0)).trace
    assert trace.time[0] == 0.0
    assert trace.duration == pytest.approx(30.0)
    with pytest.raises(DataError, match="too long to bridge"):
        import_log(path, WITH_COURSE, options=ImportOptions(start_s=10.0, gaps="bridge"))
    with pytest.raises(DataError, match="no rows are left"):
        import_log(path, WITH_COURSE, options=ImportOptions(start_s=1000.0))


def test_rows_are_counted_from_the_top_of_the_file(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", broken("ay"))
    with pytest.raises(DataError, match="empty or NaN cell at data row 1001 "):
        import_log(path, WITH_COURSE, options=ImportOptions(start_s=10.0))


def with_a_slow_receiver() -> tuple[Any, dict[str, Any]]:
    """A drive and its log, in which speed and course stand in one row of fifty."""
    truth = drive()
    table = Device(yaw=1.0).records(truth)
    between = np.arange(len(truth.time)) % 50 != 0
    table["v"][between] = np.nan
    table["course"][between] = np.nan
    return truth, table


def test_sparse_speed_is_bridged(tmp_path: Path) -> None:
    """A receiver that reports once a second leaves the other cells empty."""
    truth, table = with_a_slow_receiver()
    path = write(tmp_path / "log.csv", table)
    result = import_log(path, WITH_COURSE, options=ImportOptions(gaps="bridge"))
    assert_recovered(result, truth, force=0.1, rate=0.01)


@pytest.mark.parametrize(
    ("columns", "units", "message"),
    [
        ({**COLUMNS, "sped": "v"}, {}, "unknown signal 'sped'. Did you mean speed"),
        (COLUMNS, {"speed": "furlongs"}, "unit 'furlongs' of speed is unknown; use m/s or km/h or mph or kn"),
        ({"time": "t", "force_x": "none"}, {}, "no column for force_x"),
        ({**COLUMNS, "speed": "velocity"}, {}, "missing column velocity"),
        ({**COLUMNS, "time": "0.01"}, {}, "time has to be a column"),
        ({**COLUMNS, "time": "-t"}, {}, "time has to be a column"),
    ],
)
def test_wrong_arguments(
    tmp_path: Path, columns: dict[str, str], units: dict[str, str], message: str
) -> None:
    path = write(tmp_path / "log.csv", Device().records(drive()))
    with pytest.raises(MotionCueingError, match=message):
        import_log(path, columns, units=units)


def test_a_record_that_shows_nothing_asks_for_the_yaw(tmp_path: Path) -> None:
    truth = drive()
    columns = {name: column for name, column in COLUMNS.items() if name != "speed"}
    path = write(tmp_path / "log.csv", Device().records(truth))
    with pytest.raises(DataError, match="give yaw_deg"):
        import_log(path, columns)
    result = import_log(path, columns, options=ImportOptions(yaw_deg=0.0))
    assert result.trace.channels == {}
    assert_recovered(result, truth, force=0.5, rate=4e-3)


def test_a_short_log_is_refused(tmp_path: Path) -> None:
    table = {name: column[:20] for name, column in Device().records(drive()).items()}
    with pytest.raises(DataError, match="shorter than 1 s"):
        import_log(write(tmp_path / "log.csv", table), COLUMNS)
    with pytest.raises(ConfigurationError):
        import_log(tmp_path / "log.csv", COLUMNS, units={"tme": "s"})


def test_a_missing_horizontal_force_shows_no_yaw(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", Device().records(drive()))
    for signal in ("force_x", "force_y"):
        with pytest.raises(DataError, match=f"{signal} is constant .* give yaw_deg"):
            import_log(path, {**WITH_COURSE, signal: "0"})
    result = import_log(path, {**WITH_COURSE, "force_y": "0"}, options=ImportOptions(yaw_deg=0.0))
    assert_recovered_along(result)


def assert_recovered_along(result: ImportedLog) -> None:
    wanted = at_100_hz(drive(), drive().force)
    np.testing.assert_allclose(result.trace.specific_force[INSIDE, 0], wanted[INSIDE, 0], atol=0.06)


def test_a_delay_at_the_end_of_its_range_is_noted(tmp_path: Path) -> None:
    result = imported(tmp_path, Device(speed_delay=2.6), drive())
    assert any("at the end of its range" in note for note in result.findings.device.notes)


def test_a_receiver_of_its_own_rate_needs_no_bridge(tmp_path: Path) -> None:
    truth, table = with_a_slow_receiver()
    path = write(tmp_path / "log.csv", table)
    assert_recovered(import_log(path, WITH_COURSE), truth, force=0.1, rate=0.01)
    table["v"][900:1200] = np.nan
    with pytest.raises(DataError, match=r"gap of .* s in speed at .*its usual step is 1 s"):
        import_log(write(path, table), WITH_COURSE)
    table["ay"][1000] = np.nan
    with pytest.raises(DataError, match="force_y has an empty or NaN cell"):
        import_log(write(path, table), WITH_COURSE)


def test_only_repeated_columns_that_are_used_matter(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", Device().records(drive()))
    header, *rows = path.read_text().splitlines()
    path.write_text("\n".join([header + ",x,x", *(row + ",1,2" for row in rows)]))
    assert import_log(path, WITH_COURSE).trace.duration == pytest.approx(60.0)
    with pytest.raises(DataError, match="column x occurs more than once"):
        import_log(path, {**WITH_COURSE, "speed": "x"})


@pytest.mark.parametrize("rate_sign", [1, -1])
def test_a_log_without_forces_takes_them_from_the_speed_by_choice(tmp_path: Path, rate_sign: int) -> None:
    truth = drive()
    device = Device(rate_sign=rate_sign, rate_bias=(0.0, 0.0, 0.02))
    columns = {name: column for name, column in WITH_COURSE.items() if not name.startswith("force")}
    path = write(tmp_path / "log.csv", device.records(truth))
    path = write(path, {name: one for name, one in device.records(truth).items() if name[0] != "a"})
    with pytest.raises(ConfigurationError, match=r"no column for force_x.* set force='from-speed'"):
        import_log(path, columns)
    result = import_log(path, columns, options=ImportOptions(force="from-speed"))
    assert "force not measured" in result.findings.changes[0].text
    wanted = at_100_hz(truth, truth.force)[INSIDE]
    wanted[:, 2] -= at_100_hz(truth, truth.speed[:, None] * truth.rate)[INSIDE, 1]
    np.testing.assert_allclose(result.trace.specific_force[INSIDE], wanted, atol=0.1)
    np.testing.assert_allclose(
        result.trace.angular_velocity[INSIDE], at_100_hz(truth, truth.rate)[INSIDE], atol=4e-3
    )
    no_speed = {**columns, "speed": "none"}
    with pytest.raises(ConfigurationError, match="no column for speed"):
        import_log(path, no_speed, options=ImportOptions(force="from-speed"))
