"""Signals that plots show, against the arrays of a drive and against its metrics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.evaluation.metrics import Criteria, measure
from motion_cueing.evaluation.reporting.signals import (
    PANELS,
    PHASES,
    gathered_error,
    in_order,
    looks,
    running_error,
    shown_at_first,
    worst_second,
)

from ..synthetic import GRAVITY, drive, trajectory

DRIVE, CRITERIA = drive(), Criteria()
BY_NAME = {panel.name: panel for panel in PANELS}
DEGREES = 180.0 / np.pi


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("f_x", DRIVE.f_simulator[:, 0]),
        ("f_y", DRIVE.f_simulator[:, 1]),
        ("f_z", DRIVE.f_simulator[:, 2] + GRAVITY),
        ("w_x", DEGREES * DRIVE.w_simulator[:, 0]),
        ("w_y", DEGREES * DRIVE.w_simulator[:, 1]),
        ("w_z", DEGREES * DRIVE.w_simulator[:, 2]),
        ("roll", DEGREES * DRIVE.hexapod[:, 3]),
        ("pitch", DEGREES * DRIVE.hexapod[:, 4]),
        ("carriage_x", DRIVE.carriage[:, 0]),
        ("carriage_y", DRIVE.carriage[:, 1]),
        ("turntable", DEGREES * DRIVE.turntable),
        ("at_limit", (DRIVE.limits_active != 0).sum(axis=1)),
        ("step_time", 1e6 * DRIVE.step_time),
    ],
)
def test_a_signal_is_that_of_the_drive(name, expected):
    np.testing.assert_allclose(BY_NAME[name].signal(DRIVE, CRITERIA), expected, atol=1e-12)


def test_cues_of_the_car_are_beside_those_of_the_simulator():
    for i, name in enumerate(("f_x", "f_y", "f_z")):
        car = BY_NAME[name].car(DRIVE, CRITERIA)
        np.testing.assert_allclose(car, DRIVE.f_reference[:, i] + (GRAVITY if i == 2 else 0.0), atol=1e-12)


def test_legs_are_shown_from_shortest_to_longest_with_their_limits():
    low, high = BY_NAME["legs"].signal(DRIVE, CRITERIA).T
    np.testing.assert_array_equal(low, DRIVE.legs.min(axis=1))
    np.testing.assert_array_equal(high, DRIVE.legs.max(axis=1))
    assert BY_NAME["legs"].limits(DRIVE, CRITERIA) == (-0.67, 0.67)


def test_the_errors_and_the_tilt_rate_agree_with_the_metrics():
    metrics = measure(DRIVE)
    assert gathered_error(DRIVE, CRITERIA)[-1] == pytest.approx(metrics.cue_error)
    tilt = BY_NAME["tilt_rate"]
    assert tilt.signal(DRIVE, CRITERIA).max() == pytest.approx(DEGREES * metrics.tilt_rate_peak)
    assert tilt.limits(DRIVE, CRITERIA)[1] == pytest.approx(3.0)


def test_the_running_error_is_the_mean_of_a_second():
    force = np.tile([0.0, 0.0, -GRAVITY], (201, 1))
    force[100, 0] = 0.6  # once the indifference zone, for one sample of 0.05 s
    error = running_error(trajectory(f_simulator=force), CRITERIA)
    assert error[50] == 0.0
    np.testing.assert_allclose(error[90:111], 1.0 / 21.0)
    assert error[89] == error[111] == pytest.approx(0.0, abs=1e-12)


def test_the_worst_second_is_where_the_error_is():
    force = np.tile([0.0, 0.0, -GRAVITY], (201, 1))
    force[60:80, 1] = 1.2
    worst = worst_second(trajectory(f_simulator=force), CRITERIA)
    assert (worst.begin, worst.end, worst.axis) == (pytest.approx(3.0), pytest.approx(4.0), "f_y")
    assert worst.error == pytest.approx(4.0)


def test_the_worst_second_of_a_shorter_drive_is_the_drive():
    worst = worst_second(trajectory(n=5), CRITERIA)
    assert (worst.begin, worst.end, worst.error) == (0.0, pytest.approx(0.2), 0.0)


@pytest.mark.parametrize("phase", PHASES, ids=lambda phase: phase[2])
def test_full_tilt_gives_the_cue_of_the_car(phase):
    """A cab that only tilts feels gravity: its specific force is that of a still car turned into cab axes."""
    _, cue, tilt, sign = phase
    angle = 0.1
    cos, sin = np.cos(angle), np.sin(angle)
    about_x = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    about_y = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    rotation = about_x if tilt == "roll" else about_y
    force = rotation.T @ np.array([0.0, 0.0, -GRAVITY])
    felt = force["xyz".index(cue[-1])]
    assert sign * np.arcsin(felt / GRAVITY) == pytest.approx(angle)


def test_references_come_first_and_no_motion_last():
    errors = {"no-motion": 0.1, "b": 0.5, "a": 0.3, "optimum": 0.2, "optimal-washout-tuned": 2.0, "c": 0.4}
    order = in_order(errors, CRITERIA)
    assert order == ["optimal-washout-tuned", "optimum", "a", "c", "b", "no-motion"]
    assert shown_at_first(order) == ["optimal-washout-tuned", "optimum", "a", "c"]


@given(st.integers(1, 18))
def test_no_two_policies_look_alike(count):
    policies = [f"p{i}" for i in range(count)] + ["no-motion"]
    assert len(set(looks(policies).values())) == len(policies)
