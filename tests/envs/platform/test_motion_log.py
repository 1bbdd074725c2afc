"""Logs of a motion base from files: layout, units, time."""

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.platform.motion_log import parse_motion_columns, read_motion_log

from .motion_logs import write

N = 1201
TIME = 0.01 * np.arange(N)
SETPOINT = np.sin(TIME)[:, None] * np.linspace(0.1, 0.9, 9)
SENSOR = np.cos(TIME)[:, None] * np.linspace(0.1, 0.9, 9)


def test_the_documented_layout(tmp_path):
    log = read_motion_log(write(tmp_path / "log.csv", SETPOINT, SENSOR))
    assert [one.name for one in log.channels][:3] == ["carriage_x", "carriage_y", "leg_1"]
    assert [one.subsystem for one in log.channels] == ["carriage"] * 2 + ["hexapod"] * 6 + ["turntable"]
    assert (log.step, log.duration) == pytest.approx((0.01, 12.0))
    for i, one in enumerate(log.channels):
        np.testing.assert_allclose(one.setpoint, SETPOINT[:, i], atol=1e-8)
        np.testing.assert_allclose(one.sensor, SENSOR[:, i], atol=1e-8)


def table(tmp_path, columns):
    values = np.stack(list(columns.values()), axis=1)
    path = tmp_path / "log.csv"
    np.savetxt(path, values, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path


def test_columns_of_other_names_and_units(tmp_path):
    path = table(
        tmp_path, {"t": 1e3 * TIME, "cmd": 1e3 * SETPOINT[:, 0], "pos": np.degrees(SENSOR[:, 0]), "x": TIME}
    )
    columns = parse_motion_columns(["time=t:ms", "roll_setpoint=cmd:mrad", "roll_sensor=pos:deg"])
    (channel,) = read_motion_log(path, columns).channels
    assert (channel.name, channel.subsystem) == ("roll", "hexapod")
    np.testing.assert_allclose(channel.setpoint, SETPOINT[:, 0], atol=1e-6)
    np.testing.assert_allclose(channel.sensor, SENSOR[:, 0], atol=1e-6)


def test_a_turntable_that_turns_on_is_unwound(tmp_path):
    angle = 3.0 * TIME
    wound = np.angle(np.exp(1j * angle))
    path = table(tmp_path, {"time_s": TIME, "turntable_setpoint_rad": angle, "turntable_sensor_rad": wound})
    (channel,) = read_motion_log(path).channels
    np.testing.assert_allclose(channel.sensor, angle, atol=1e-6)


def broken(time=TIME, **columns):
    return {"time_s": time, "leg_1_setpoint_m": SETPOINT[:, 0], "leg_1_sensor_m": SENSOR[:, 0], **columns}


JUMP = np.where(np.arange(N) < 500, TIME, TIME + 0.5)
BACK = np.where(np.arange(N) == 500, TIME[498], TIME)


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        (broken(1e3 * TIME), "the time step is 10 s.*in another unit, name it by time=COLUMN:ms"),
        (broken(0.1 * TIME), r"lasts 1\.2 s; it must last at least 10 s"),
        (broken(JUMP), "the clock jumps by 510 ms at 4.990 s"),
        (broken(BACK), "the clock does not advance at data row 501"),
        (broken(leg_2_sensor_m=TIME), "there is leg_2_sensor, but no leg_2_setpoint"),
        (broken(leg_1_sensor_m=np.full(N, np.nan)), "column 'leg_1_sensor_m' holds 'nan' at data row 1"),
        ({"time_s": TIME, "speed": TIME}, "no pair of a set-point and a sensor"),
        ({"leg_1_setpoint_m": TIME, "leg_1_sensor_m": TIME}, "no column time_s"),
    ],
)
def test_what_cannot_be_used_is_refused_with_a_sentence(tmp_path, columns, sentence):
    with pytest.raises(DataError, match=sentence):
        read_motion_log(table(tmp_path, columns))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("leg_1_sensor", "expected signal=column"),
        ("leg_7_sensor=a", "unknown signal 'leg_7_sensor'. Did you mean leg_"),
        ("roll_sensor=a:mm", "unit 'mm' of roll_sensor is unknown; use one of rad, mrad, deg"),
    ],
)
def test_columns_that_cannot_be_meant(text, sentence):
    with pytest.raises(ConfigurationError, match=sentence):
        parse_motion_columns([text])


def test_a_column_that_is_missing_and_a_file_that_is_none(tmp_path):
    path = table(tmp_path, broken())
    with pytest.raises(DataError, match=r"there is no column 'tim' for time\. Did you mean time_s"):
        read_motion_log(path, {"time": ("tim", "s")})
    with pytest.raises(DataError, match="there is no such file"):
        read_motion_log(tmp_path / "none.csv")
