"""Metrics of synthetic drives against independent formulas."""

from __future__ import annotations

import json
from math import radians

import numpy as np
import pytest

from motion_cueing.envs.platform.kernels import ACTUATORS
from motion_cueing.envs.settings import from_dict, to_dict
from motion_cueing.evaluation.metrics import CUE_AXES, Criteria, Metrics, measure

from .synthetic import GRAVITY, drive, trajectory

REST = np.array([0.0, 0.0, -GRAVITY])


def test_cue_error_is_the_headline_formula():
    rng = np.random.default_rng(1)
    f = REST + rng.normal(size=(201, 3))
    w = 0.1 * rng.normal(size=(201, 3))
    metrics = measure(
        trajectory(f_simulator=f, w_simulator=w, perceived_f_simulator=0.5 * f, perceived_w_simulator=2.0 * w)
    )
    expected = np.mean(np.sum((f - REST) ** 2, axis=1) / 0.6**2 + np.sum(w**2, axis=1) / np.radians(3.0) ** 2)
    sensed = np.mean(
        np.sum((0.5 * f - REST) ** 2, axis=1) / 0.6**2 + np.sum((2.0 * w) ** 2, axis=1) / np.radians(3.0) ** 2
    )
    assert metrics.cue_error == pytest.approx(expected, rel=1e-12)
    assert metrics.perceived_cue_error == pytest.approx(sensed, rel=1e-12)
    assert sum(axis.cue_error for axis in metrics.axes.values()) == pytest.approx(expected)


def test_a_perfect_simulator_has_no_error():
    metrics = measure(drive(gain=1.0, lag=0.0))
    assert metrics.cue_error == pytest.approx(0.0, abs=1e-20)
    assert metrics.false_cues == metrics.missing_cues == metrics.tilt_rate_peak == 0.0
    assert metrics.axes["f_y"].correlation == pytest.approx(1.0)
    assert metrics.axes["f_y"].delay == pytest.approx(0.0, abs=1e-9)


def test_no_motion_has_a_normalized_error_of_one_where_the_car_moves():
    metrics = measure(drive(gain=0.0))
    for axis in ("f_x", "f_y", "w_z"):
        assert metrics.axes[axis].nrmse == pytest.approx(1.0)
        assert metrics.axes[axis].correlation is None
        assert metrics.axes[axis].delay is None
    assert metrics.axes["f_z"].nrmse == 0.0
    assert metrics.tilt_rate_peak == 0.0
    wanted = np.abs(drive().f_reference[:, 1])
    assert metrics.axes["f_y"].missing_cues == pytest.approx(np.mean(wanted > 0.17))


def test_gain_and_lag_show_in_error_and_delay():
    half = measure(drive(gain=0.5, lag=0.0)).axes["f_y"]
    assert half.nrmse == pytest.approx(0.5)
    assert half.correlation == pytest.approx(1.0)
    assert measure(drive(lag=0.3)).axes["f_y"].delay == pytest.approx(0.3, abs=0.005)
    assert measure(drive(lag=0.3)).axes["w_z"].delay == pytest.approx(0.3, abs=0.005)


def test_parts_of_the_cue_error_add_up():
    still = measure(drive(gain=0.0)).axes["f_y"]
    wanted = drive().f_reference[:, 1]
    noticed = np.abs(wanted) > 0.17
    assert still.cue_error_false == 0.0
    assert still.cue_error_missing == pytest.approx(np.mean((wanted / 0.6) ** 2 * noticed))
    against = measure(drive(gain=-1.0, lag=0.0)).axes["f_y"]
    assert against.cue_error_missing == 0.0
    assert against.cue_error_false == pytest.approx(
        np.mean((2 * wanted / 0.6) ** 2 * (np.abs(wanted) > 0.17))
    )


@pytest.mark.parametrize(
    ("reference_cue", "simulator_cue", "expected"),
    [
        ((0.0, 0.0), (4.0, 0.0), 4.0),  # tilt coordination of a car that does not roll
        ((0.0, 0.0), (3.0, 4.0), 5.0),
        ((5.0, 0.0), (5.0, 0.0), 0.0),  # the car's own roll
        ((5.0, 0.0), (3.0, 0.0), 0.0),  # a part of it
        ((5.0, 0.0), (7.0, 0.0), 2.0),
        ((5.0, 0.0), (-1.0, 0.0), 1.0),
        ((5.0, -5.0), (0.0, 0.0), 0.0),  # no motion
    ],
)
def test_tilt_rate_is_what_the_car_did_not_ask_for(wanted, felt, expected):
    def rate(pair):
        return np.tile(np.radians([*pair, 9.0]), (201, 1))

    metrics = measure(trajectory(w_reference=rate(wanted), w_simulator=rate(felt)))
    assert metrics.tilt_rate_peak == pytest.approx(radians(expected), abs=1e-12)
    assert metrics.tilt_rate_share == (1.0 if expected > 3.0 else 0.0)


def test_tilt_at_exactly_the_limit_is_not_above_it():
    w = np.tile([radians(3.0) * (1 + 1e-12), 0.0, 0.0], (201, 1))
    assert measure(trajectory(w_simulator=w)).tilt_rate_share == 0.0


def test_vibration_is_of_the_specific_force_alone():
    def vibration(**columns):
        return measure(trajectory(dt=0.01, **columns)).vibration

    shaking = np.outer(0.2 * np.sin(20.0 * np.pi * 0.01 * np.arange(201)), [0.0, 0.0, 1.0])
    assert vibration(f_simulator=REST + shaking) == pytest.approx(0.2 / np.sqrt(2.0), rel=0.03)
    assert vibration(w_simulator=shaking) == pytest.approx(0.0, abs=1e-9)
    assert vibration(f_reference=REST + shaking) == 0.0


def test_strokes_are_shares_of_the_nearer_reached_limit():
    legs = np.zeros((201, 6))
    legs[7, 2], legs[9, 2], legs[5, 4] = 0.335, -0.5, 0.067
    turntable = np.linspace(0.0, -9.0, 201)
    use = measure(trajectory(legs=legs, turntable=turntable)).actuators
    assert use["leg_3"].stroke == pytest.approx(0.5)
    assert use["leg_3"].stroke_share == pytest.approx(0.5 / 0.67)
    assert use["leg_5"].stroke_share == pytest.approx(0.1)
    assert use["turntable"].stroke == pytest.approx(9.0)
    assert use["turntable"].stroke_share is None
    assert list(use) == list(ACTUATORS)


def test_limits_count_samples_by_kind_and_actuator():
    active = np.zeros((200, 9), dtype=np.uint8)
    active[:20, 0] = 1
    active[10:50, 3] = 2
    active[100:110, 8] = 6
    metrics = measure(trajectory(200, limits_active=active))
    assert metrics.at_limit == pytest.approx(60 / 200)
    assert metrics.at_displacement == pytest.approx(20 / 200)
    assert metrics.at_velocity == pytest.approx(50 / 200)
    assert metrics.at_acceleration == pytest.approx(10 / 200)
    assert metrics.actuators["leg_2"].at_limit == pytest.approx(40 / 200)


def test_clipped_counts_steps_whose_acceleration_differs():
    action = np.zeros((201, 9))
    action[1:51, 4] = 1.0
    action[100:, 2] = 1e-5
    assert measure(trajectory(action=action)).clipped == pytest.approx(50 / 200)


def test_step_time_ignores_what_was_not_measured():
    times = np.r_[np.nan, np.arange(1.0, 101.0)]
    metrics = measure(trajectory(101, step_time=times))
    assert metrics.step_time_mean == pytest.approx(50.5)
    assert metrics.step_time_p99 == pytest.approx(np.percentile(np.arange(1.0, 101.0), 99))
    assert measure(trajectory()).step_time_mean is None


def test_metrics_round_trip_through_strict_json():
    metrics = measure(drive(gain=0.0))
    text = json.dumps(to_dict(metrics), allow_nan=False)
    assert from_dict(Metrics, json.loads(text)) == metrics
    assert list(json.loads(text)["axes"]) == list(CUE_AXES)


def test_criteria_change_the_cue_error():
    strict = measure(drive(), Criteria(indifference_force=0.3, indifference_rate=radians(1.5)))
    assert strict.cue_error == pytest.approx(4.0 * measure(drive()).cue_error)
