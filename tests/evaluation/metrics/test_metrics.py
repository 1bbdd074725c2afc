"""Metrics against SciPy, NumPy and closed forms: the formulas, and whole synthetic drives."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from math import radians

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from motion_cueing.envs.platform.kernels import ACTUATORS
from motion_cueing.envs.settings import from_dict, to_dict
from motion_cueing.evaluation import metrics
from motion_cueing.evaluation.metrics import (
    CUE_AXES,
    METRICS,
    ActuatorMetrics,
    AxisMetrics,
    Criteria,
    Metrics,
    declared,
    mean,
    measure,
    over_drives,
)

from ..synthetic import GRAVITY, drive, trajectory

REST = np.array([0.0, 0.0, -GRAVITY])


def test_cue_error_is_the_headline_formula():
    rng = np.random.default_rng(1)
    f = REST + rng.normal(size=(201, 3))
    w = 0.1 * rng.normal(size=(201, 3))
    found = measure(
        trajectory(f_simulator=f, w_simulator=w, perceived_f_simulator=0.5 * f, perceived_w_simulator=2.0 * w)
    )
    expected = np.mean(np.sum((f - REST) ** 2, axis=1) / 0.6**2 + np.sum(w**2, axis=1) / np.radians(3.0) ** 2)
    perceived = np.mean(
        np.sum((0.5 * f - REST) ** 2, axis=1) / 0.6**2 + np.sum((2.0 * w) ** 2, axis=1) / np.radians(3.0) ** 2
    )
    assert found.cue_error == pytest.approx(expected, rel=1e-12)
    assert found.perceived_cue_error == pytest.approx(perceived, rel=1e-12)
    assert sum(axis.cue_error for axis in found.axes.values()) == pytest.approx(expected)


def test_a_perfect_simulator_has_no_error():
    found = measure(drive(gain=1.0, lag=0.0))
    assert found.cue_error == pytest.approx(0.0, abs=1e-20)
    assert found.false_cues == found.missing_cues == found.tilt_rate_peak == 0.0
    assert found.axes["f_y"].correlation == pytest.approx(1.0)
    assert found.axes["f_y"].delay == pytest.approx(0.0, abs=1e-9)


def test_no_motion_has_a_normalized_error_of_one_where_the_car_moves():
    found = measure(drive(gain=0.0))
    for axis in ("f_x", "f_y", "w_z"):
        assert found.axes[axis].nrmse == pytest.approx(1.0)
        assert found.axes[axis].correlation is None
        assert found.axes[axis].delay is None
    assert found.axes["f_z"].nrmse == 0.0
    assert found.tilt_rate_peak == 0.0
    reference = np.abs(drive().f_reference[:, 1])
    assert found.axes["f_y"].missing_cues == pytest.approx(np.mean(reference > 0.17))


def test_gain_and_lag_show_in_error_and_delay():
    half = measure(drive(gain=0.5, lag=0.0)).axes["f_y"]
    assert half.nrmse == pytest.approx(0.5)
    assert half.correlation == pytest.approx(1.0)
    assert measure(drive(lag=0.3)).axes["f_y"].delay == pytest.approx(0.3, abs=0.005)
    assert measure(drive(lag=0.3)).axes["w_z"].delay == pytest.approx(0.3, abs=0.005)


def test_parts_of_the_cue_error_add_up():
    still = measure(drive(gain=0.0)).axes["f_y"]
    reference = drive().f_reference[:, 1]
    noticed = np.abs(reference) > 0.17
    assert still.cue_error_false == 0.0
    assert still.cue_error_missing == pytest.approx(np.mean((reference / 0.6) ** 2 * noticed))
    against = measure(drive(gain=-1.0, lag=0.0)).axes["f_y"]
    assert against.cue_error_missing == 0.0
    assert against.cue_error_false == pytest.approx(
        np.mean((2 * reference / 0.6) ** 2 * (np.abs(reference) > 0.17))
    )


@pytest.mark.parametrize(
    ("reference", "simulated", "expected"),
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
def test_tilt_rate_is_beyond_the_cars_own(reference, simulated, expected):
    def rate(pair):
        return np.tile(np.radians([*pair, 9.0]), (201, 1))

    found = measure(trajectory(w_reference=rate(reference), w_simulator=rate(simulated)))
    assert found.tilt_rate_peak == pytest.approx(radians(expected), abs=1e-12)
    assert found.tilt_rate_share == (1.0 if expected > 3.0 else 0.0)


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
    found = measure(trajectory(200, limits_active=active))
    assert found.at_limit == pytest.approx(60 / 200)
    assert found.at_displacement == pytest.approx(20 / 200)
    assert found.at_velocity == pytest.approx(50 / 200)
    assert found.at_acceleration == pytest.approx(10 / 200)
    assert found.actuators["leg_2"].at_limit == pytest.approx(40 / 200)


def test_clipped_counts_steps_whose_acceleration_differs():
    action = np.zeros((201, 9))
    action[1:51, 4] = 1.0
    action[100:, 2] = 1e-5
    assert measure(trajectory(action=action)).clipped == pytest.approx(50 / 200)


def test_step_time_ignores_what_was_not_measured():
    times = np.r_[np.nan, np.arange(1.0, 101.0)]
    found = measure(trajectory(101, step_time=times))
    assert found.step_time_mean == pytest.approx(50.5)
    assert found.step_time_p99 == pytest.approx(np.percentile(np.arange(1.0, 101.0), 99))
    assert measure(trajectory()).step_time_mean is None


def test_metrics_round_trip_through_strict_json():
    found = measure(drive(gain=0.0))
    text = json.dumps(to_dict(found), allow_nan=False)
    assert from_dict(Metrics, json.loads(text)) == found
    assert list(json.loads(text)["axes"]) == list(CUE_AXES)


def test_criteria_change_the_cue_error():
    strict = measure(drive(), Criteria(indifference_force=0.3, indifference_rate=radians(1.5)))
    assert strict.cue_error == pytest.approx(4.0 * measure(drive()).cue_error)


def test_every_metric_is_a_declared_field():
    for cls in (Metrics, AxisMetrics, ActuatorMetrics):
        assert [one.name for one in declared(cls)] == [field.name for field in fields(cls)]
        assert all(one.definition.endswith(".") and one.unit for one in declared(cls))
    titles = [one.title for one in METRICS.values() if one.header]
    assert len(set(titles)) == len(titles)
    assert all(one.header for one in METRICS.values() if one.tables)


def test_several_drives_combine_as_each_metric_declares():
    drives = [measure(drive(gain, lag)) for gain, lag in ((0.9, 0.0), (0.5, 0.3), (0.0, 0.0))]
    unknown = [replace(one, vibration=None) for one in drives[:2]]
    combined = over_drives(drives)
    assert list(combined) == list(METRICS)
    assert combined["cue_error"] == pytest.approx(np.mean([one.cue_error for one in drives]), rel=1e-14)
    assert combined["tilt_rate_peak"] == max(one.tilt_rate_peak for one in drives)
    assert combined["step_time_mean"] == pytest.approx(2e-5)
    assert over_drives([*unknown, drives[2]])["vibration"] == drives[2].vibration
    assert over_drives(unknown)["vibration"] is None
    assert METRICS["false_cues"].over_drives is mean


# Formulas.


VALUES = st.floats(-10.0, 10.0, allow_subnormal=False)
SIGNAL = arrays(np.float64, 60, elements=VALUES)


def noise(n: int = 400, seed: int = 0) -> np.ndarray:
    """A smooth random signal."""
    raw = np.random.default_rng(seed).normal(size=n + 20)
    return np.convolve(raw, np.hanning(21), mode="valid")


@given(SIGNAL, SIGNAL)
def test_pearson_is_scipys(a, b):
    assume(a.std() > 1e-2)
    assume(b.std() > 1e-2)
    assert metrics.pearson(a, b) == pytest.approx(stats.pearsonr(a, b).statistic, abs=1e-9)


@pytest.mark.parametrize("flat", ["first", "second"])
def test_pearson_of_a_constant_is_undefined(flat):
    wave, constant = np.sin(np.arange(50.0)), np.full(50, 3.0) + 1e-9 * np.arange(50)
    pair = (constant, wave) if flat == "first" else (wave, constant)
    assert metrics.pearson(*pair) is None


def test_correlation_by_lag_is_numpys_on_the_overlap():
    a, b = noise(seed=1), noise(seed=2) + 3.0
    n, reach = len(a), 30
    found = metrics.correlation_by_lag(a, b, reach)
    for lag in range(-reach, reach + 1):
        left = a[max(0, -lag) : n - max(0, lag)]
        right = b[max(0, lag) : n - max(0, -lag)]
        assert found[lag + reach] == pytest.approx(np.corrcoef(left, right)[0, 1], abs=1e-10)


@pytest.mark.parametrize("lag", [-17, -1, 0, 1, 8, 29])
def test_delay_finds_a_shift_of_whole_samples(lag):
    long, dt = noise(500), 0.02
    reference, simulated = long[50:450], 0.4 * long[50 - lag : 450 - lag] + 2.0
    assert metrics.delay(reference, simulated, dt, 1.0, 0.5) == pytest.approx(lag * dt, abs=0.1 * dt)


def test_delay_of_a_sine_is_its_phase_between_samples():
    dt, frequency, late = 0.05, 0.35, 0.123
    time = dt * np.arange(2000)
    reference = np.sin(2 * np.pi * frequency * time)
    simulated = np.sin(2 * np.pi * frequency * (time - late))
    assert metrics.delay(reference, simulated, dt, 1.0, 0.5) == pytest.approx(late, abs=2e-3)


def test_delay_is_undefined_without_a_peak_inside_the_search():
    time = 0.02 * np.arange(1000)
    wave = np.sin(2 * np.pi * 0.1 * time)
    assert metrics.delay(wave, np.sin(2 * np.pi * 0.1 * (time - 2.0)), 0.02, 1.0, 0.5) is None
    assert metrics.delay(noise(seed=3), noise(seed=4), 0.02, 0.5, 0.9) is None
    assert metrics.delay(wave, np.zeros(1000), 0.02, 1.0, 0.5) is None
    assert metrics.delay(wave[:3], wave[:3], 0.02, 1.0, 0.5) is None


@given(SIGNAL, st.floats(0.01, 1.0))
def test_no_motion_has_a_normalized_error_of_one_or_less(reference, floor):
    error = metrics.normalized_rmse(reference, np.zeros_like(reference), floor)
    strong = metrics.rms(reference) >= floor
    assert error == pytest.approx(1.0) if strong else error < 1.0


def test_normalized_rmse_uses_the_floor_where_the_car_is_still():
    assert metrics.normalized_rmse(np.zeros(4), np.full(4, 0.5), 0.25) == pytest.approx(2.0)


def test_false_and_missing_cues_by_hand():
    reference = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.16, -1.0, 0.18])
    simulated = np.array([0.1, 0.5, -0.5, 0.5, 0.1, 0.18, 0.05, 0.16])
    #                 quiet false  false  shape miss  near  miss  near
    assert metrics.false_cues(reference, simulated, 0.17).tolist() == [False, True, True] + [False] * 5
    assert metrics.missing_cues(reference, simulated, 0.17).tolist() == [False] * 4 + [
        True,
        False,
        True,
        False,
    ]


@given(SIGNAL, SIGNAL, st.floats(0.01, 2.0))
def test_a_cue_is_never_false_and_missing_at_once(reference, simulated, threshold):
    both = metrics.false_cues(reference, simulated, threshold) & metrics.missing_cues(
        reference, simulated, threshold
    )
    assert not both.any()
    assert not metrics.false_cues(reference, reference, threshold).any()
    assert not metrics.missing_cues(reference, reference, threshold).any()


@given(SIGNAL, SIGNAL)
def test_beyond_is_the_distance_to_the_interval_from_zero_to_the_cars(reference, simulated):
    for w, f, extra in zip(reference, simulated, metrics.beyond(reference, simulated), strict=True):
        low, high = min(0.0, w), max(0.0, w)
        assert extra == pytest.approx(f - high if f > high else f - low if f < low else 0.0)


TIME = np.arange(0.0, 6.0, 0.01)


def shaking(amplitude: float, frequency: float, *, until: float = 6.0) -> np.ndarray:
    """(n, 2) of which the second shakes for a while."""
    wave = amplitude * np.sin(2.0 * np.pi * frequency * TIME) * (until > TIME)
    return np.column_stack([np.zeros_like(TIME), wave])


@pytest.mark.parametrize("frequency", [8.0, 15.0, 25.0])
def test_vibration_is_the_rms_of_what_shakes(frequency):
    found = metrics.vibration(shaking(0.0, 1.0), shaking(0.3, frequency), 0.01, 4.0, 1.0)
    assert found == pytest.approx(0.3 / np.sqrt(2.0), rel=0.03)


def test_vibration_is_that_of_the_worst_second():
    found = metrics.vibration(shaking(0.0, 1.0), shaking(0.3, 10.0, until=0.5), 0.01, 4.0, 1.0)
    assert found == pytest.approx(0.3 / np.sqrt(2.0) * np.sqrt(0.5), rel=0.05)


def test_slow_motion_and_rest_are_no_vibration():
    rest = shaking(0.0, 1.0)
    assert metrics.vibration(rest, rest - 9.81, 0.01, 4.0, 1.0) == pytest.approx(0.0, abs=1e-9)
    assert metrics.vibration(rest, shaking(5.0, 0.5), 0.01, 4.0, 1.0) < 0.02


def test_the_cars_own_vibration_is_not_the_simulators():
    car, late = shaking(0.3, 10.0), np.roll(shaking(0.3, 10.0), 3, axis=0)
    assert metrics.vibration(car, late, 0.01, 4.0, 1.0) < 0.06  # from the ends alone
    assert metrics.vibration(car, shaking(0.0, 1.0), 0.01, 4.0, 1.0) == 0.0
    both = metrics.vibration(car, np.sqrt(2.0) * late, 0.01, 4.0, 1.0)
    assert both == pytest.approx(0.3 / np.sqrt(2.0), rel=0.05)


@pytest.mark.parametrize(("samples", "dt"), [(100, 0.01), (600, 0.125), (1, 0.01)])
def test_vibration_of_what_is_too_short_or_coarse_is_undefined(samples, dt):
    quiet = np.zeros((samples, 3))
    assert metrics.vibration(quiet, quiet, dt, 4.0, 1.0) is None
