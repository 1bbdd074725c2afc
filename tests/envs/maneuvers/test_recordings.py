"""The recorded drives in the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import motion_cueing.envs.maneuvers.registry as recordings
from motion_cueing.envs.errors import UnknownNameError
from motion_cueing.envs.maneuvers.registry import get_recording, recording_names

NAMES = ["city-drive", "commute"]
TURNS = [(22.0, 32.0, 77.1), (62.0, 68.0, 85.3), (140.0, 152.0, -92.9), (190.0, 202.0, -82.6)]


def slow(values: np.ndarray) -> np.ndarray:
    return np.asarray(sosfiltfilt(butter(2, 0.5, fs=100.0, output="sos"), values))


def test_names() -> None:
    assert recording_names() == NAMES
    with pytest.raises(UnknownNameError, match="Did you mean city-drive"):
        get_recording("city-drve")


@pytest.mark.parametrize(("name", "seconds"), [("city-drive", 213.99), ("commute", 59.98)])
def test_time(name: str, seconds: float) -> None:
    trace = get_recording(name)
    assert trace.name == name
    assert trace.dt == pytest.approx(0.01, rel=1e-9)
    assert trace.time[0] == 0.0
    assert trace.duration == pytest.approx(seconds, abs=1e-6)
    assert trace.source


@pytest.mark.parametrize("name", NAMES)
def test_the_cues_agree_with_the_motion_of_the_car(name: str) -> None:
    """Gravity points down, speeding up gives f_x > 0, turning right gives r > 0 and f_y > 0."""
    trace = get_recording(name)
    force, speed = trace.specific_force, trace.channels["speed_m_s"]
    assert force[:, 2].mean() == pytest.approx(-9.81, abs=0.02)
    assert np.abs(force[:, :2].mean(axis=0)).max() < 0.05
    assert np.abs(trace.angular_velocity.mean(axis=0)).max() < np.radians(1.0)
    along, across = np.gradient(slow(speed), 0.01), slow(speed * trace.angular_velocity[:, 2])
    assert np.corrcoef(slow(force[:, 0]), along)[0, 1] > 0.75
    assert np.corrcoef(slow(force[:, 1]), across)[0, 1] > 0.8


@pytest.mark.parametrize("name", NAMES)
def test_no_spikes(name: str) -> None:
    """Below 3 Hz nothing jumps: bounded values, and a bounded change from sample to sample."""
    trace = get_recording(name)
    force = trace.specific_force - [0.0, 0.0, -9.81]
    assert np.abs(force).max() < 5.0
    assert np.abs(np.diff(force, axis=0)).max() < 0.4
    assert np.degrees(np.abs(trace.angular_velocity)).max() < 50.0
    assert np.abs(trace.angular_acceleration).max() < 3.0
    speed = trace.channels["speed_m_s"]
    assert speed.min() >= 0.0
    assert speed.max() < 25.0


@pytest.mark.parametrize(("start", "end", "change"), TURNS)
def test_the_city_drive_turns_as_its_log_says(start: float, end: float, change: float) -> None:
    """Against the course over ground, degrees, read from the log a second later (its delay)."""
    trace = get_recording("city-drive")
    within = (trace.time >= start) & (trace.time < end)
    assert np.degrees(trace.angular_velocity[within, 2].sum() * 0.01) == pytest.approx(change, abs=12.0)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("city-drive", ["Paul Balzer", "CC BY-SA 2.0", "same license", "Changed", "motion-cueing import"]),
        ("commute", ["Copyright (c) 2018 comma.ai", "MIT License", "Changed", "motion-cueing import"]),
    ],
)
def test_each_has_its_notice_and_its_command(name: str, words: list[str]) -> None:
    folder = Path(recordings.__file__).parent / "recorded" / name
    notice = (folder / "NOTICE.md").read_text(encoding="utf-8")
    assert [word for word in words if word not in notice] == []
    assert (folder / "cues.csv.gz").stat().st_size < 500_000
