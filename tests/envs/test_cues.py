"""Cue traces and their CSV form."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motion_cueing.envs import CueTrace
from motion_cueing.envs.cues import CSV_COLUMNS, read_table
from motion_cueing.envs.errors import DataError, MotionCueingError

MOTION = ("specific_force", "angular_velocity", "angular_acceleration")


def fields(n: int = 5, **changes: Any) -> dict[str, Any]:
    """Arguments of a good trace, some of them changed."""
    good: dict[str, Any] = {
        "name": "drive",
        "time": 0.1 * np.arange(n),
        "specific_force": np.tile([0.0, 0.0, -9.81], (n, 1)),
        "angular_velocity": np.arange(3.0 * n).reshape(n, 3),
        "channels": {"speed_m_s": np.full(n, 10.0)},
    }
    return good | changes


def spoilt(shape: tuple[int, ...], value: float) -> np.ndarray:
    array = np.zeros(shape)
    array.flat[-1] = value
    return array


def test_fields_are_copied_and_read_only() -> None:
    force = np.tile([0.0, 0.0, -9.81], (5, 1))
    trace = CueTrace(**fields(specific_force=force))
    force[0, 0] = 1.0
    assert trace.specific_force[0, 0] == 0.0
    for values in (trace.time, trace.specific_force, trace.angular_velocity, trace.channels["speed_m_s"]):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0
    assert (len(trace), trace.dt, trace.duration) == (5, pytest.approx(0.1), pytest.approx(0.4))


def test_the_digest_is_of_the_motion_alone() -> None:
    trace = CueTrace(**fields())
    wanted = trace.digest()
    assert len(bytes.fromhex(wanted)) == 32
    named = CueTrace(**fields(name="other", source="elsewhere", channels={}, time=7.0 + 0.5 * np.arange(5)))
    assert CueTrace(**fields(name="other", source="elsewhere", channels={})).digest() == wanted
    assert CueTrace(**fields(angular_acceleration=trace.angular_acceleration)).digest() == wanted
    moved = {name: np.array(getattr(trace, name)) for name in MOTION}
    changed = [named.digest(), CueTrace(**fields(4)).digest()]
    for name in MOTION:
        other = {key: value.copy() for key, value in moved.items()}
        other[name].flat[-1] = np.nextafter(other[name].flat[-1], np.inf)
        changed.append(CueTrace(**fields(**other)).digest())
    assert len({wanted, *changed}) == 1 + len(changed)


def test_the_digest_tells_which_signal_is_which() -> None:
    """The same numbers in another signal are another drive."""
    one, two = np.arange(15.0).reshape(5, 3), np.ones((5, 3))
    a = CueTrace(**fields(specific_force=one, angular_velocity=two, angular_acceleration=two))
    b = CueTrace(**fields(specific_force=two, angular_velocity=one, angular_acceleration=two))
    assert a.digest() != b.digest()


def test_lists_will_do() -> None:
    trace = CueTrace("lists", [0, 1], [[0, 0, -9.81]] * 2, [[0, 0, 0], [0, 0, 2]])  # type: ignore[arg-type]
    np.testing.assert_array_equal(trace.angular_acceleration, [[0.0, 0.0, 2.0]] * 2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": [0.0, 0.1, 0.1, 0.2, 0.3]}, "time does not increase at sample 2"),
        ({"time": [0.0, 0.2, 0.1, 0.3, 0.4]}, "time does not increase at sample 2"),
        ({"time": [0.0, 0.1, 0.2, 0.3, 0.5]}, "time steps are uneven"),
        ({"time": [0.0, 0.1, 0.2, np.nan, 0.4]}, "time is not finite at sample 3"),
        ({"time": np.zeros((5, 1))}, r"time has shape \(5, 1\), expected \(n\)"),
        ({"specific_force": np.zeros((4, 3))}, r"specific_force has shape \(4, 3\), expected \(5, 3\)"),
        ({"specific_force": np.zeros((5, 2))}, "specific_force has shape"),
        ({"specific_force": spoilt((5, 3), np.nan)}, "specific_force is not finite at sample 4"),
        ({"angular_velocity": spoilt((5, 3), np.inf)}, "angular_velocity is not finite at sample 4"),
        ({"angular_velocity": np.zeros(5)}, "angular_velocity has shape"),
        ({"angular_acceleration": spoilt((5, 3), -np.inf)}, "angular_acceleration is not finite"),
        ({"angular_acceleration": np.zeros((5, 1))}, "angular_acceleration has shape"),
        ({"channels": {"speed_m_s": np.zeros(4)}}, "speed_m_s has shape"),
        ({"channels": {"speed_m_s": spoilt((5,), np.nan)}}, "speed_m_s is not finite"),
        ({"specific_force": "fast"}, "specific_force is not an array of numbers"),
        ({"specific_force": [[1.0, 2.0], [3.0]]}, "specific_force is not an array of numbers"),
    ],
)
def test_bad_fields_are_refused_by_name(change: dict[str, Any], message: str) -> None:
    with pytest.raises(DataError, match=f"drive: {message}"):
        CueTrace(**fields(**change))


@pytest.mark.parametrize("n", [0, 1])
def test_too_few_samples(n: int) -> None:
    with pytest.raises(DataError, match="at least 2"):
        CueTrace(**fields(n))


def test_angular_acceleration_is_the_derivative_of_a_quadratic() -> None:
    time = 0.01 * np.arange(50)
    omega = np.stack([time**2, -3.0 * time, np.ones(50)], axis=1)
    trace = CueTrace("drive", time, np.zeros((50, 3)), omega)
    wanted = np.stack([2.0 * time, np.full(50, -3.0), np.zeros(50)], axis=1)
    np.testing.assert_allclose(trace.angular_acceleration[1:-1], wanted[1:-1], atol=1e-12)


@given(arrays(np.float64, 3, elements=st.floats(-5.0, 5.0)), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_at_point_of_a_car_that_spins_up_in_a_plane(arm: np.ndarray, start: float, gain: float) -> None:
    """In polar form: r psidotdot along the tangent, -r psidot^2 along the radius."""
    time = 0.01 * np.arange(30)
    rate = start + gain * time
    omega = np.stack([np.zeros(30), np.zeros(30), rate], axis=1)
    force = np.tile([0.5, -0.25, -9.81], (30, 1))
    trace = CueTrace("drive", time, force, omega)
    radius, angle = np.hypot(arm[0], arm[1]), np.arctan2(arm[1], arm[0])
    along, across = -radius * rate**2, radius * gain * np.ones(30)
    wanted = force + np.stack(
        [
            along * np.cos(angle) - across * np.sin(angle),
            along * np.sin(angle) + across * np.cos(angle),
            np.zeros(30),
        ],
        axis=1,
    )
    np.testing.assert_allclose(trace.at_point(arm), wanted, atol=1e-9)


def test_at_point_of_a_steady_spin_about_any_axis() -> None:
    """Centripetal: w (w . OP) - |w|^2 OP, and nothing at the origin."""
    omega, arm = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -0.5])
    trace = CueTrace("drive", [0.0, 1.0, 2.0], np.zeros((3, 3)), np.tile(omega, (3, 1)))  # type: ignore[arg-type]
    wanted = omega * (omega @ arm) - (omega @ omega) * arm
    np.testing.assert_allclose(trace.at_point(arm), np.tile(wanted, (3, 1)), atol=1e-14)
    np.testing.assert_array_equal(trace.at_point([0.0, 0.0, 0.0]), np.zeros((3, 3)))
    with pytest.raises(DataError, match="offset has shape"):
        trace.at_point([1.0, 2.0])
    with pytest.raises(DataError, match="offset is not finite"):
        trace.at_point([1.0, np.nan, 0.0])


def test_resampling_a_straight_line_is_exact() -> None:
    time = 2.0 + 0.02 * np.arange(101)
    line = np.stack([time, -2.0 * time, 3.0 * time - 1.0], axis=1)
    trace = CueTrace("drive", time, line, line, channels={"speed_m_s": 5.0 * time})
    for step, samples in ((0.01, 201), (0.02, 101), (0.03, 67), (0.5, 5)):
        other = trace.resampled(step)
        assert len(other) == samples
        assert other.dt == pytest.approx(step)
        assert other.time[0] == 2.0
        wanted = np.stack([other.time, -2.0 * other.time, 3.0 * other.time - 1.0], axis=1)
        np.testing.assert_allclose(other.specific_force, wanted, atol=1e-12)
        np.testing.assert_allclose(other.angular_velocity, wanted, atol=1e-12)
        np.testing.assert_allclose(other.angular_acceleration, np.tile([1.0, -2.0, 3.0], (samples, 1)))
        np.testing.assert_allclose(other.channels["speed_m_s"], 5.0 * other.time)
    assert trace.resampled(0.02) is trace


@pytest.mark.parametrize("step", [0.0, -0.01, float("nan")])
def test_resampling_needs_a_positive_step(step: float) -> None:
    with pytest.raises(DataError, match="time step must be positive"):
        CueTrace(**fields()).resampled(step)


def test_resampling_to_less_than_two_samples() -> None:
    for step in (10.0, float("inf")):
        with pytest.raises(DataError, match=r"drive: 0\.4 s in steps of .* fewer than 2 samples"):
            CueTrace(**fields()).resampled(step)


@pytest.mark.parametrize("step", [4e-8 / 1.0001, 1e-300, 5e-324])
def test_resampling_to_more_samples_than_memory_holds(step: float) -> None:
    with pytest.raises(DataError, match=r"drive: 0\.4 s in steps of .* more than 10 million samples"):
        CueTrace(**fields()).resampled(step)


@settings(max_examples=30)
@given(
    arrays(np.float64, (6, 7), elements=st.floats(-100.0, 100.0, allow_subnormal=False)),
    st.sampled_from(["", ".gz"]),
)
def test_csv_round_trip(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray, suffix: str) -> None:
    path = tmp_path_factory.mktemp("csv") / f"drive.csv{suffix}"
    trace = CueTrace(
        "x", 0.01 * np.arange(6), values[:, :3], values[:, 3:6], channels={"speed_m_s": values[:, 6]}
    )
    trace.to_csv(path)
    back = CueTrace.from_csv(path)
    assert back.name == "drive"
    assert back.source == str(path)
    np.testing.assert_allclose(back.time, trace.time, rtol=1e-8)
    np.testing.assert_allclose(back.specific_force, trace.specific_force, rtol=1e-8)
    np.testing.assert_allclose(back.angular_velocity, trace.angular_velocity, rtol=1e-8)
    np.testing.assert_allclose(back.channels["speed_m_s"], trace.channels["speed_m_s"], rtol=1e-8)


def test_csv_with_decimals_is_short_and_always_the_same(tmp_path: Path) -> None:
    force = np.array([[0.123456, -0.00001, -9.81], [1.0, 2.0, 3.0]])
    trace = CueTrace("drive", [0.0, 0.01], force, np.zeros((2, 3)))  # type: ignore[arg-type]
    trace.to_csv(tmp_path / "a.csv", decimals=3)
    rows = (tmp_path / "a.csv").read_text().splitlines()
    assert rows[0] == ",".join(CSV_COLUMNS)
    assert rows[1] == "0.000,0.123,0.000,-9.810,0.000,0.000,0.000"
    trace.to_csv(tmp_path / "a.csv.gz", decimals=3)
    packed = (tmp_path / "a.csv.gz").read_bytes()
    assert gzip.decompress(packed) == (tmp_path / "a.csv").read_bytes()
    trace.to_csv(tmp_path / "b.csv.gz", decimals=3)
    assert (tmp_path / "b.csv.gz").read_bytes() == packed


HEADER = ",".join(CSV_COLUMNS)
ROW = "0,0,0,-9.81,0,0,0"
NEXT = "0.01,0,0,-9.81,0,0,0"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        (HEADER, "empty"),
        (f"{HEADER}\n\n\n", "empty"),
        (f"{HEADER}\n{ROW}\n", "at least 2"),
        (f"{HEADER}\n{ROW}\n{NEXT},1\n", "line 3 has 8 cells, the header has 7"),
        (f"{HEADER}\n\n{ROW}\n0.01,0\n", "line 4 has 2 cells"),
        (f"{HEADER}\n{ROW}\n0.01,zero,0,0,0,0,0\n", "column specific_force_x_m_s2: '.*' is no number"),
        (
            f"{HEADER}\n{ROW}\n0.01,,0,0,0,0,0\n",
            "line 3, column specific_force_x_m_s2: not a finite number; fill",
        ),
        (f"{HEADER}\n{ROW}\n\n0.01,0,0,inf,0,0,0\n", "line 4, column specific_force_z_m_s2: not a finite"),
        (f"{HEADER}\n{ROW}\n0.01,0,0,0,nan,0,0\n0.02,0,0,0,,0,0\n", r"line 3.*\(2 such cells\)"),
        (f"{HEADER}\n{ROW}\n0.01,0,-1001,0,0,0,0\n", r"-1001 is beyond 1000 m/s\^2.*check the unit"),
        (
            f"{HEADER}\n{ROW}\n0.01,0,0,0,0,0,101\n",
            "column angular_velocity_z_rad_s: 101 is beyond 100 rad/s",
        ),
        (f"{HEADER}\n{ROW}\n{ROW}\n", "time does not increase at sample 1"),
        (f"{HEADER},time_s\n{ROW},0\n{NEXT},0\n", "column time_s occurs more than once"),
        ("time_s,ax\n0,1\n1,1\n", "missing column specific_force_x_m_s2, .*found time_s, ax.*import"),
    ],
)
def test_bad_csv(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=message) as caught:
        CueTrace.from_csv(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_unreadable_files(tmp_path: Path) -> None:
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01")
    (tmp_path / "plain.csv.gz").write_text(f"{HEADER}\n{ROW}\n{NEXT}\n")
    (tmp_path / "cut.csv.gz").write_bytes(gzip.compress(f"{HEADER}\n{ROW}\n{NEXT}\n".encode())[:-12])
    for name in ("missing.csv", "binary.csv", "plain.csv.gz", "cut.csv.gz", "."):
        with pytest.raises(DataError, match="cannot be read"):
            CueTrace.from_csv(tmp_path / name)


def test_a_foreign_csv_with_byte_order_mark_and_other_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "excel.csv"
    columns = [CSV_COLUMNS[i] for i in (1, 0, 2, 3, 4, 5, 6)]
    text = "\r\n".join([", ".join(columns), "7,0,0,-9.81,0,0,0", "7,0.01,0,-9.81,0,0,0", ""])
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    np.testing.assert_array_equal(CueTrace.from_csv(path, name="mine").specific_force[:, 0], [7.0, 7.0])
    assert CueTrace.from_csv(path, name="mine").name == "mine"


def test_read_table_ignores_text_in_other_columns(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,note,v\n0,start,1\n1,,\n")
    table = read_table(path, ["v", "t"])
    np.testing.assert_array_equal(table["v"], [1.0, np.nan])
    assert list(table) == ["v", "t"]
    with pytest.raises(MotionCueingError, match="missing column w; found t, note, v"):
        read_table(path, ["w"])
