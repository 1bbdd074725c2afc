"""A trajectory checks what it is given and survives its file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from motion_cueing.envs import storage
from motion_cueing.envs.errors import DataError
from motion_cueing.evaluation.trajectory import LimitTable, Trajectory

from .synthetic import drive, limits, trajectory

ARRAYS = [field.name for field in fields(Trajectory) if field.type in ("Floats", "Flags")]


def test_a_file_gives_back_every_field(tmp_path):
    before = drive()
    before.save(tmp_path / "deep" / "drive.npz")
    after = Trajectory.load(tmp_path / "deep" / "drive.npz")
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
        assert getattr(after, name).dtype == getattr(before, name).dtype
    for name in ("position_min", "position_max", "velocity", "acceleration"):
        np.testing.assert_array_equal(getattr(after.limits, name), getattr(before.limits, name))
    assert (after.maneuver, after.policy, after.platform, after.car) == ("weave", "washout", "base", "sedan")
    assert after.metadata == before.metadata


def test_metadata_keeps_its_strings(tmp_path):
    trajectory(metadata={"parameters": '{"gain": 0.5}', "note": "Grüße"}).save(tmp_path / "a.npz")
    assert Trajectory.load(tmp_path / "a.npz").metadata == {"parameters": '{"gain": 0.5}', "note": "Grüße"}


def test_arrays_are_copies_and_read_only():
    legs = np.zeros((201, 6))
    made = trajectory(legs=legs)
    legs[0, 0] = 1.0
    assert made.legs[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.legs[0, 0] = 1.0


def test_positions_are_in_the_order_of_the_limits():
    legs = np.tile(np.arange(3.0, 9.0), (201, 1))
    made = trajectory(carriage=np.tile([1.0, 2.0], (201, 1)), legs=legs, turntable=np.full(201, 9.0))
    assert made.positions[7].tolist() == list(range(1, 10))
    assert made.dt == pytest.approx(0.05)


@pytest.mark.parametrize(
    "name", [name for name in ARRAYS if name not in ("time", "limits_active", "step_time")]
)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_refused_by_name(name, bad):
    values = np.array(getattr(trajectory(), name))
    values[(5,) + (0,) * (values.ndim - 1)] = bad
    with pytest.raises(DataError, match=f"{name} is not finite at sample 5"):
        trajectory(**{name: values})


@pytest.mark.parametrize("name", [name for name in ARRAYS if name != "time"])
def test_a_wrong_shape_is_refused_by_name(name):
    with pytest.raises(DataError, match=f"{name} has shape"):
        trajectory(**{name: getattr(trajectory(), name)[1:]})


def test_time_must_increase_and_have_samples():
    time = 0.05 * np.arange(201)
    time[10] = time[9]
    with pytest.raises(DataError, match="time does not increase at sample 10"):
        trajectory(time=time)
    with pytest.raises(DataError, match="at least 2"):
        trajectory(time=[0.0])


def test_what_is_no_array_of_numbers_is_refused():
    with pytest.raises(DataError, match="legs is not an array of numbers"):
        trajectory(legs="long")
    with pytest.raises(DataError, match="velocity must be 9 numbers"):
        LimitTable(limits().position_min, limits().position_max, np.ones(8), np.ones(9))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 broken", b"time,f_x\n0,1\n"])
def test_a_broken_file_is_refused(tmp_path, content):
    path = tmp_path / "broken.npz"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"broken\.npz"):
        Trajectory.load(path)


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "damaged.npz"
    drive().save(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(DataError, match=r"damaged\.npz"):
        Trajectory.load(path)


def test_other_files_and_versions_are_refused(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        Trajectory.load(tmp_path / "missing.npz")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(DataError, match="not a saved trajectory"):
        Trajectory.load(tmp_path / "other.npz")
    np.save(tmp_path / "array.npy", np.zeros(3))
    with pytest.raises(DataError, match="one array"):
        Trajectory.load(tmp_path / "array.npy")
    np.savez(tmp_path / "future.npz", about=np.array('{"schema": 99}'))
    with pytest.raises(DataError, match="version 99"):
        Trajectory.load(tmp_path / "future.npz")


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "drive.npz"
    trajectory(policy="old").save(path)

    def full(*_):
        raise OSError("no space left")

    monkeypatch.setattr(storage.os, "replace", full)
    with pytest.raises(OSError, match="no space"):
        trajectory(policy="new").save(path)
    assert Trajectory.load(path).policy == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["drive.npz"]


def test_a_file_of_the_version_before_is_read(tmp_path):
    """Its arrays are called f_wanted, f_felt, sensed_f_felt and so on."""
    path = Path(__file__).parent / "before" / "lane-change--classical-1.npz"
    old, drive = np.load(path), Trajectory.load(path)
    for now, before in (
        ("f_reference", "f_wanted"), ("w_simulator", "w_felt"), ("head_f_reference", "head_f_wanted"),
        ("perceived_f_simulator", "sensed_f_felt"), ("perceived_w_reference", "sensed_w_wanted"),
    ):  # fmt: skip
        np.testing.assert_array_equal(getattr(drive, now), old[before])
    assert np.abs(drive.f_reference - drive.f_simulator).max() > 0.1
    drive.save(tmp_path / "now.npz")
    again = Trajectory.load(tmp_path / "now.npz")
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(drive, name))
