"""Incongruence, the worst second, classes of cue errors, fast tilt, and jerk: closed forms and properties."""

from __future__ import annotations

from math import pi, radians, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motion_cueing.evaluation.metrics import (
    CUE_AXES,
    AxisSignals,
    Criteria,
    cab_motion,
    cue_error,
    incongruence,
    jerk,
    measure,
    worst_window,
)

from ..synthetic import GRAVITY, drive, trajectory

REST = np.array([0.0, 0.0, -GRAVITY])
SIGNAL = arrays(np.float64, 40, elements=st.floats(-5.0, 5.0, allow_subnormal=False))


def offset(x: float, y: float, n: int = 1001, dt: float = 0.01, begin: int = 0):
    """A simulator whose force is off by a constant from a sample on."""
    force = np.tile(REST, (n, 1))
    force[begin:, 0] += x
    force[begin:, 1] += y
    return trajectory(n, dt, f_simulator=force)


@pytest.mark.parametrize(("x", "y"), [(1.0, 0.0), (0.0, -1.0), (-2.0, 1.0)])
def test_incongruence_rises_as_a_first_order_system_to_the_weighted_mismatch(x, y):
    found = measure(offset(x, y), Criteria(incongruence_time=2.0))
    final = 0.34 * abs(x) + 0.66 * abs(y)
    assert found.incongruence_max == pytest.approx(final * (1.0 - np.exp(-10.0 / 2.0)), rel=1e-3)
    # The mean of 1 - exp(-t/2) over 10 s.
    assert found.incongruence_mean == pytest.approx(final * (1.0 - 0.2 * (1.0 - np.exp(-5.0))), rel=2e-3)


def test_incongruence_forgets_with_its_time_constant():
    error = np.zeros((601, 2))
    error[:100, 1] = 1.0
    found = incongruence(error, (0.34, 0.66), 0.01, 1.5)
    assert found[399] == pytest.approx(found[99] * np.exp(-3.0 / 1.5))


@given(arrays(np.float64, 30, elements=st.floats(0.0, 100.0)), st.integers(1, 30))
def test_the_worst_window_is_the_worst_of_all(values, count):
    means = [values[i : i + count].mean() for i in range(len(values) - count + 1)]
    worst, begin = worst_window(values, 0.1, 0.1 * count)
    assert worst == pytest.approx(max(means), abs=1e-9)
    assert means[round(begin / 0.1)] == pytest.approx(worst, abs=1e-9)


def test_the_worst_second_of_j_is_found_with_its_time():
    force = np.tile(REST, (1001, 1))
    force[620:720, 1] += 1.2
    found = measure(trajectory(1001, 0.01, f_simulator=force))
    assert found.worst_second == pytest.approx(4.0)
    assert found.worst_second_time == pytest.approx(6.2)
    assert measure(offset(1.2, 0.0, n=31)).worst_second == pytest.approx(4.0)  # shorter than a second
    moving = drive()
    assert measure(moving).worst_second <= cue_error(*cab_motion(moving)).max()
    assert measure(moving).worst_second >= measure(moving).cue_error


@given(SIGNAL, SIGNAL, st.floats(0.01, 1.0))
def test_each_error_is_scaled_or_missing_or_false(reference, simulated, threshold):
    motions = np.stack([reference, simulated, reference, simulated])
    axis = AxisSignals(motions, 0.01, 0.6, threshold, Criteria())
    masks = np.stack([axis.scaled, axis.missing, axis.false])
    assert np.array_equal(masks.sum(axis=0), np.ones(40))
    assert sum(np.sum(axis.error[mask]) for mask in masks) == pytest.approx(np.sum(axis.error))
    present = np.maximum(np.abs(reference), np.abs(simulated)) > threshold
    noticed = axis.scaled & present & (np.abs(simulated - reference) > threshold)
    # A noticeable scaled error has a cue in both, of the same sign.
    assert np.all(np.abs(reference[noticed]) > threshold)
    assert np.all(np.abs(simulated[noticed]) > threshold)
    assert np.all(reference[noticed] * simulated[noticed] > 0.0)
    assert np.all(np.abs(reference[axis.missing]) > threshold)
    assert np.all(np.abs(simulated[axis.missing]) <= threshold)
    assert np.all(np.abs(simulated[axis.false]) > threshold)


@pytest.mark.parametrize(("gain", "lag"), [(0.7, 0.3), (1.5, 0.0), (0.0, 0.0), (-1.0, 0.0)])
def test_scaled_missing_and_false_parts_sum_to_j(gain, lag):
    found = measure(drive(gain, lag))
    parts = found.cue_error_scaled, found.cue_error_missing, found.cue_error_false
    assert sum(parts) == pytest.approx(found.cue_error)
    for axis in CUE_AXES:
        one = found.axes[axis]
        assert one.cue_error_scaled + one.cue_error_missing + one.cue_error_false == pytest.approx(
            one.cue_error
        )


def test_a_gain_scales_a_still_machine_misses_and_a_reversed_one_is_false():
    half, still, against = (measure(drive(gain, 0.0)).axes["f_y"] for gain in (0.6, 0.0, -1.0))
    assert half.cue_error_scaled > 0.9 * half.cue_error
    assert still.cue_error_missing > 0.9 * still.cue_error
    assert against.cue_error_false > 0.9 * against.cue_error


def test_a_perfect_machine_has_no_incongruence_and_the_cars_jerk():
    found = measure(drive(gain=1.0, lag=0.0))
    assert found.incongruence_max == found.incongruence_mean == pytest.approx(0.0, abs=1e-12)
    assert found.worst_second == pytest.approx(0.0, abs=1e-12)
    assert found.jerk_ratio == pytest.approx(1.0)


@pytest.mark.parametrize(("rate", "share"), [(2.0, 0.0), (5.0, 0.0), (7.0, 1.0)])
def test_tilt_above_6_degrees_a_second_is_counted_apart(rate, share):
    w = np.tile([radians(rate), 0.0, 0.0], (201, 1))
    found = measure(trajectory(w_simulator=w))
    assert found.tilt_rate_share_high == share
    assert found.tilt_rate_share == (1.0 if rate > 3.0 else 0.0)


def test_jerk_of_a_sine_is_its_derivative():
    time = 0.01 * np.arange(2001)
    wave = 2.0 * np.sin(2.0 * pi * 0.5 * time)
    found = measure(trajectory(2001, 0.01, f_simulator=REST + np.outer(wave, [0.6, 0.8, 0.0])))
    assert found.jerk_max == pytest.approx(2.0 * pi, rel=0.025)
    assert found.jerk_rms == pytest.approx(2.0 * pi / sqrt(2.0), rel=0.01)


def test_jerk_ignores_what_is_above_the_low_pass():
    time = 0.01 * np.arange(1001)
    shaking = np.outer(np.sin(2.0 * pi * 40.0 * time), [1.0, 0.0, 0.0])
    # A second-order low-pass run twice: (10 / 40)^4 of the derivative remains.
    assert np.median(jerk(shaking, 0.01, 10.0)) < 2.0 * pi * 40.0 * (10.0 / 40.0) ** 4


@pytest.mark.parametrize(("samples", "dt"), [(19, 0.01), (600, 0.05)])
def test_jerk_of_what_is_too_short_or_coarse_is_undefined(samples, dt):
    assert jerk(np.zeros((samples, 3)), dt, 10.0) is None
    found = measure(trajectory(samples, dt))
    assert found.jerk_max is found.jerk_rms is found.jerk_ratio is None
